"""Judging one diagnosis against what was hidden.

How the errors on unseen recordings are obtained is the caller's choice; tables over many cases are in `table`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, sqrt
from typing import Any

import numpy as np

from wipx.proof.blind_robots.dirty_score import DirtyScore, dirty_score
from wipx.proof.blind_robots.tree_score import TreeScore, same_force, tree_score

LEAST_SHARE = 0.1  # of the mismatch that a site must be given to count as named


@dataclass(frozen=True)
class UnseenErrors:
    """Prediction errors on recordings that the diagnosis never saw, root mean square by signal [m, rad].

    Attributes:
        nominal: Of the owner's model.
        completed: Of the completed model.
        floor: What a perfect model would leave.
        reference: Of the true effects, fitted to the visible recordings; of a robot with dirt only, of the owner's
            model. None where that is not known, as for exact robots.
    """

    nominal: Mapping[str, float]
    completed: Mapping[str, float]
    floor: Mapping[str, float]
    reference: Mapping[str, float] | None = None

    def removed(self) -> float | None:
        """Share of the explainable squared error that is gone; None where the nominal model leaves none.

        1 - (completed^2 - floor^2) / (nominal^2 - floor^2), summed over signals in units of their floor.
        """
        before = sum((self.nominal[name] / floor) ** 2 - 1.0 for name, floor in self.floor.items())
        after = sum((self.completed[name] / floor) ** 2 - 1.0 for name, floor in self.floor.items())
        return 1.0 - after / before if before > 0.05 * len(self.floor) and isfinite(after) else None

    def over_floor(self) -> float | None:
        """Error of the completed model in units of the floor, root mean square over signals; None where it diverges."""
        return self._over(self.floor)

    def over_reference(self) -> float | None:
        """The same in units of the reference."""
        return None if self.reference is None else self._over(self.reference)

    def _over(self, unit: Mapping[str, float]) -> float | None:
        squares = [(self.completed[name] / size) ** 2 for name, size in unit.items()]
        return sqrt(sum(squares) / len(squares)) if isfinite(sum(squares)) else None


@dataclass(frozen=True)
class ParameterScore:
    """An identified number beside the true one.

    Attributes:
        name: "site/kind.symbol".
        true: Value that was hidden [SI].
        value: Value of the diagnosis.
        low: Lower end of its 95 % interval; None where the diagnosis gives none.
        high: Upper end.
    """

    name: str
    true: float
    value: float
    low: float | None
    high: float | None

    @property
    def error(self) -> float:
        """Relative to the true value; the difference itself where that is zero."""
        return abs(self.value - self.true) / (abs(self.true) or 1.0)

    @property
    def covered(self) -> bool:
        """Whether the true value lies in the interval."""
        return self.low is not None and self.high is not None and self.low <= self.true <= self.high


@dataclass(frozen=True)
class CaseScore:
    """What a diagnosis got right of one case; None where a question does not arise.

    Attributes:
        case: Name of the folder.
        tier: Of the case.
        plant: Kind of plant.
        truth: Hidden effects, "site/kind".
        outside: Hidden physics that the vocabulary lacks.
        contrast: Difference that the hidden physics makes in the signal that shows it best, over the noise; of
            several effects, that of the faintest.
        answer: Effects that were named.
        verdict: Of the diagnosis.
        exact: Whether every hidden effect was found, by its name or as an equivalent, and nothing else was named.
        false_alarms: Named effects that were not hidden.
        verdict_right: Whether the verdict is the one that the truth asks for.
        site_right: For one effect, whether its site carries most of the mismatch; for several, whether all carry some.
        region_error: 1 - intersection / union of the sticky spot with the regions named for x.
        time_error: The same of the payload's event and the times named, mean over recordings.
        parameters: Of the effects that were named as they are hidden.
        flagged: Whether outside physics was called unexplained.
        aliased: Whether outside physics was explained away by the vocabulary.
        removed: Share of the explainable squared error on unseen recordings that is gone, where physics is hidden.
        over_floor: Error there over what a perfect model would leave.
        seconds: Time of the diagnosis [s].
        failure: Why there is no answer; empty where there is one.
        dirty: What was named of a dirty robot, of which `exact` forgives laws that correct what the owner has wrong;
            None for an exact robot.
        tree: What was named joint by joint; None for a robot of the five plants.
    """

    case: str
    tier: str
    plant: str
    truth: tuple[str, ...]
    outside: str | None
    contrast: float | None
    answer: tuple[str, ...]
    verdict: str
    exact: bool | None
    false_alarms: int
    verdict_right: bool
    site_right: bool | None
    region_error: float | None
    time_error: float | None
    parameters: tuple[ParameterScore, ...]
    flagged: bool | None
    aliased: bool | None
    removed: float | None
    over_floor: float | None
    seconds: float
    failure: str = ""
    dirty: DirtyScore | None = None
    tree: TreeScore | None = None

    @property
    def accused(self) -> bool | None:
        """Whether a false alarm was raised: physics named that is not hidden, or left over where none is hidden."""
        if self.outside is not None or self.failure:
            return None
        if self.dirty is not None:  # something is left over of every dirty robot
            return self.dirty.false_laws > 0
        return self.false_alarms > 0 or (not self.truth and self.verdict != "consistent")


def score(
    case: str,
    truth: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    seconds: float,
    errors: UnseenErrors | None = None,
) -> CaseScore:
    """Compare what is hidden, see `write.truth`, with the content of diagnosis.json.

    Args:
        case: Name of the case.
        truth: What is hidden.
        diagnosis: What was answered.
        seconds: Time that it took [s].
        errors: On the unseen recordings; None where they are not known.
    """
    hidden = {effect["name"]: effect["parameters"] for effect in truth["effects"]}
    named = {effect["name"]: effect for effect in diagnosis["effects"]}
    verdict, outside = diagnosis["verdict"], None if truth["outside"] is None else truth["outside"]["name"]
    of_tree = "joints" in truth
    if of_tree:
        named = same_force(named, tuple(hidden))
    found = matches(tuple(hidden), named)
    expected = "unexplained" if outside else "mismatch" if hidden else "consistent"
    location = diagnosis["location"]
    dirty = None
    if truth["dirt"] is not None:
        dirty = dirty_score(truth, tuple(named), found, None if errors is None else errors.over_reference())
    allowed = len(named) if dirty is None else len(named) - dirty.corrected
    tree = tree_score(truth, tuple(named), found, location["sites"]) if of_tree else None
    right = verdict == expected if dirty is None else _right_of_dirty(verdict, dirty)
    return CaseScore(
        case=case,
        tier=truth["tier"],
        plant=truth["plant"],
        truth=tuple(hidden),
        outside=outside,
        contrast=_contrast(truth["contrast"]),
        answer=tuple(named),
        verdict=verdict,
        exact=None if outside else len(found) == len(hidden) == allowed,
        false_alarms=len(named) - len(found) if dirty is None else dirty.false_laws,
        verdict_right=right,
        site_right=_site_right(found, tuple(hidden), location["sites"], tree) if hidden else None,
        region_error=_region_error(truth["regions"], location["regions"]),
        time_error=_time_error(truth["times"], location["times"]),
        parameters=_parameters(hidden, named),
        flagged=verdict == "unexplained" if outside else None,
        aliased=verdict == "mismatch" if outside else None,
        removed=errors.removed() if errors is not None and (hidden or outside) else None,
        over_floor=None if errors is None else errors.over_floor(),
        seconds=seconds,
        dirty=dirty,
        tree=tree,
    )


def _right_of_dirty(verdict: str, dirty: DirtyScore) -> bool:
    """Whether a verdict on a dirty robot is right: physics is missing, or, with dirt only, no law of it is named."""
    return verdict != "consistent" if dirty.dominant else dirty.false_laws == 0


def failed(case: str, truth: Mapping[str, Any], seconds: float, failure: str) -> CaseScore:
    """The score of a case without an answer: nothing of it is right."""
    hidden = tuple(effect["name"] for effect in truth["effects"])
    outside = None if truth["outside"] is None else truth["outside"]["name"]
    return CaseScore(
        case=case,
        tier=truth["tier"],
        plant=truth["plant"],
        truth=hidden,
        outside=outside,
        contrast=_contrast(truth["contrast"]),
        answer=(),
        verdict="none",
        exact=None if outside else False,
        false_alarms=0,
        verdict_right=False,
        site_right=False if hidden else None,
        region_error=1.0 if truth["regions"] else None,
        time_error=1.0 if truth["times"] else None,
        parameters=(),
        flagged=False if outside else None,
        aliased=False if outside else None,
        removed=None,
        over_floor=None,
        seconds=seconds,
        failure=failure,
        dirty=None if truth["dirt"] is None else DirtyScore(len(hidden), 0, 0, 0, 0, None),
        tree=tree_score(truth, (), {}, {}) if "joints" in truth else None,
    )


def _contrast(contrast: Mapping[str, Mapping[str, float]]) -> float | None:
    return min((max(signals.values()) for signals in contrast.values()), default=None)


def matches(hidden: tuple[str, ...], named: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """The named effect that stands for each hidden one, as many pairs as possible.

    A hidden effect is found under its own name or as an equivalent of the named one, which stands for one only.
    """
    from scipy.optimize import linear_sum_assignment

    exact = {name: name for name in hidden if name in named}
    open_hidden = [name for name in hidden if name not in exact]
    free = [name for name in named if name not in exact]
    stands = np.array([[name in named[one].get("equivalent", ()) for one in free] for name in open_hidden], dtype=int)
    if not stands.size:
        return exact
    pairs = zip(*linear_sum_assignment(stands, maximize=True), strict=True)
    return {**exact, **{open_hidden[i]: free[j] for i, j in pairs if stands[i, j]}}


def _site_right(
    found: Mapping[str, str], hidden: tuple[str, ...], sites: Mapping[str, float], tree: TreeScore | None
) -> bool:
    if tree is not None:
        return tree.sites == tree.effects
    # where effects cannot be told apart, the site of the one that was named is as right as the hidden one's
    allowed = [{name.partition("/")[0], found.get(name, name).partition("/")[0]} for name in hidden]
    if not sites:
        return False
    if len(hidden) == 1:
        return max(sites, key=lambda site: sites[site]) in allowed[0]
    return all(any(sites.get(site, 0.0) >= LEAST_SHARE for site in pair) for pair in allowed)


def overlap_error(low: float, high: float, intervals: list[tuple[float, float]]) -> float:
    """1 - intersection / union of an interval with a set of intervals; 1 where the set is empty."""
    edges = sorted({low, high, *(end for interval in intervals for end in interval)})
    both = either = 0.0
    for begin, end in pairwise(edges):
        middle = 0.5 * (begin + end)
        inside = low <= middle <= high
        named = any(start <= middle <= stop for start, stop in intervals)
        both += (end - begin) * (inside and named)
        either += (end - begin) * (inside or named)
    return 1.0 - both / either if either > 0.0 else 1.0


def _region_error(true: list[dict[str, Any]], named: list[dict[str, Any]]) -> float | None:
    if not true:
        return None
    found = [(entry["low"], entry["high"]) for entry in named if entry["signal"] == true[0]["signal"]]
    return overlap_error(true[0]["low"], true[0]["high"], found)


def _time_error(true: list[dict[str, Any]], named: list[dict[str, Any]]) -> float | None:
    if not true:
        return None
    total = 0.0
    for entry in true:
        found = [(one["low"], one["high"]) for one in named if one.get("recording") in (None, entry["recording"])]
        total += overlap_error(entry["low"], entry["high"], found)
    return total / len(true)


def _parameters(
    hidden: Mapping[str, Mapping[str, float]], named: Mapping[str, Mapping[str, Any]]
) -> tuple[ParameterScore, ...]:
    found = []
    for name, values in hidden.items():
        answers = named.get(name, {}).get("parameters", {})
        for symbol, true in values.items():
            if symbol in answers:
                answer = answers[symbol]
                low, high = answer["ci95"]
                found.append(ParameterScore(f"{name}.{symbol}", true, answer["value"], low, high))
    return tuple(found)
