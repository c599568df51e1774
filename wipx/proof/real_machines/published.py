"""What the authors of a rig published about physics that their nominal model lacks, and how an answer compares with it.

No diagnosis sees any of it before its answer is complete.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from wipx.core.errors import unknown_name
from wipx.core.model import Model
from wipx.recordings.model_file import check_keys, mapping_of, model_of
from wipx.tasks.shared.job import Job

Naming = Literal["name", "tie", "same physics", "missed"]


class Named(Protocol):
    """An effect of an answer."""

    @property
    def name(self) -> str:
        """Of the effect, "site/kind"."""
        ...

    @property
    def equivalent(self) -> tuple[str, ...]:
        """Effects that the recordings cannot tell from it."""
        ...


@dataclass(frozen=True)
class Published:
    """Published physics of a rig.

    Attributes:
        known: What the authors found missing, by "site/kind", with the figure that they give, in words.
        main: Effects that an answer must have, by "site/kind", each with other kinds of law at the same site that
            describe the same physics, richer or simpler.
        plausible: Further effects for which the sources give a reason; an answer with them is not counted as wrong.
        authors: Their full model: `parameters` and `effects` that replace or join those of the nominal one, as in
            robot.yaml; empty where they published none.
        figures: Their figures of known effects, by symbol [SI], where `authors` has none.
    """

    known: dict[str, str] = field(default_factory=dict)
    main: dict[str, list[str]] = field(default_factory=dict)
    plausible: tuple[str, ...] = ()
    authors: dict[str, dict[str, Any]] = field(default_factory=dict)
    figures: dict[str, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in (*self.figures, *self.main):
            if name not in self.known:
                raise unknown_name("effect", name, self.known, "published: figures, main")

    @property
    def suspects(self) -> dict[str, dict[str, float]]:
        """The known effects with the authors' figures [SI]; without any where they give none."""
        published = {**self.authors.get("effects", {}), **self.figures}
        return {name: dict(published.get(name, {})) for name in self.known}

    def authors_model(self, nominal: Model, where: str) -> Model | None:
        """The authors' full model; None where they published none.

        Raises:
            InputError: the model is at fault; `where` is its key.
        """
        if not self.authors:
            return None
        check_keys(self.authors, ("parameters", "effects"), where)
        parameters = {**nominal.parameters, **mapping_of(self.authors, "parameters", where)}
        effects = {**nominal.effects, **mapping_of(self.authors, "effects", where)}
        return model_of(nominal.plant, parameters, effects, where)

    def same_physics(self, main: str) -> tuple[str, ...]:
        """Other laws for the physics of a main effect, as "site/kind"."""
        site = main.partition("/")[0]
        return tuple(f"{site}/{kind}" for kind in self.main[main])

    def naming(self, found: Iterable[Named]) -> dict[str, Naming]:
        """How an answer has each of the main effects."""
        found = tuple(found)
        names = {effect.name for effect in found}
        ties = {other for effect in found for other in effect.equivalent}
        return {main: _naming(main, self.same_physics(main), names, ties) for main in self.main}

    def not_published(self, found: Iterable[Named]) -> tuple[str, ...]:
        """Names of an answer that are neither known nor plausible, not even as a tie; not necessarily wrong."""
        accepted = {*self.known, *self.plausible, *(other for main in self.main for other in self.same_physics(main))}
        return tuple(effect.name for effect in found if accepted.isdisjoint({effect.name, *effect.equivalent}))


def published_of(job: Job, settings: Mapping[str, Any], where: str) -> Published:
    """What settings of a configuration say, `where` their key; without any, nothing is published.

    Raises:
        InputError: they are at fault.
    """
    return job.build({"_target_": f"{Published.__module__}.Published", **settings}, where)


def _naming(main: str, alike: tuple[str, ...], names: set[str], ties: set[str]) -> Naming:
    if main in names:
        return "name"
    if main in ties:
        return "tie"
    return "missed" if (names | ties).isdisjoint(alike) else "same physics"


def counted(namings: Iterable[Mapping[str, Naming]]) -> dict[Naming, int]:
    """How often each way of naming occurs over answers and main effects."""
    counts: dict[Naming, int] = {"name": 0, "tie": 0, "same physics": 0, "missed": 0}
    for one in namings:
        for naming in one.values():
            counts[naming] += 1
    return counts
