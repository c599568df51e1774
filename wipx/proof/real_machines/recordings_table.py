"""The table of `task=real_recordings`: what authors know of their robots, and what was found blind."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.suspect import Suspect
from wipx.proof.baseline_answers import MethodAnswer
from wipx.proof.real_machines.published import Published
from wipx.report.diagnosis_words import nats, value_in_words
from wipx.report.numbers import compact, significant

HEAD = (
    "recordings",
    "the authors found",
    "found blind",
    "known effects named",
    "asked about the authors' figures",
    "verdict",
    "horizon",
    "error before",
    "after",
    "the authors' full model",
    "sensor noise",
)
METHODS_HEAD = ("recordings", "method", "named", "main effects", "names not published", "error over 0.5 s", "time [s]")


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of predictions of one horizon, root mean square by column [SI], on recordings that no fit saw.

    Attributes:
        horizon: Length of a prediction [s].
        nominal: Of the model that the diagnosis started from.
        completed: Of the model that it ended with.
        authors: Of the authors' full model; None where they published none.
        noise_floor: Of a perfect model, from the sensor noise.
    """

    horizon: float
    nominal: Mapping[str, float]
    completed: Mapping[str, float]
    authors: Mapping[str, float] | None
    noise_floor: Mapping[str, float]


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        title: Of the dataset.
        published: What the authors found missing.
        diagnosis: The answer; None where the diagnosis refused the recordings.
        errors: One entry per horizon; empty without an answer.
        refusal: Why there is no answer; empty where there is one.
        methods: The answer beside those of other methods; empty where no other was asked.
        units: SI unit by column.
    """

    title: str
    published: Published
    diagnosis: Diagnosis | None
    errors: tuple[HeldOutErrors, ...]
    refusal: str = ""
    methods: tuple[MethodAnswer, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)


def markdown(outcomes: Sequence[Outcome]) -> str:
    """All outcomes as one Markdown table, and a second one where other methods were asked."""
    table = _table(HEAD, map(cells, outcomes))
    compared = [_method_cells(outcome, answer) for outcome in outcomes for answer in outcome.methods]
    return f"{table}\n{_table(METHODS_HEAD, compared)}" if compared else table


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, ("---",) * len(head), *rows))


def _method_cells(outcome: Outcome, answer: MethodAnswer) -> tuple[str, ...]:
    """A method's answer as cells under `METHODS_HEAD`."""
    if answer.refusal:
        return (outcome.title, answer.method, f"no answer: {answer.refusal}", *("-",) * (len(METHODS_HEAD) - 3))
    published = outcome.published
    namings = list(published.naming(answer.effects).values())
    return (
        outcome.title,
        answer.method,
        _stacked(effect.name for effect in answer.effects) or "nothing",
        f"{len(namings) - namings.count('missed')} of {len(namings)}",
        str(len(published.not_published(answer.effects))),
        _in_units(answer.errors, outcome.units),
        f"{answer.seconds:.0f}",
    )


def cells(outcome: Outcome) -> tuple[str, ...]:
    """An outcome as cells under `HEAD`."""
    known = _stacked(f"{name}: {figure}" for name, figure in outcome.published.known.items())
    if outcome.diagnosis is None:
        return (outcome.title, known, f"no answer: {outcome.refusal}", *("-",) * (len(HEAD) - 3))
    effects, units = outcome.diagnosis.effects, outcome.diagnosis.units
    return (
        outcome.title,
        known,
        _stacked(map(_shown, effects)) or "nothing",
        score(outcome.published.known, effects),
        _stacked(map(asked, outcome.diagnosis.suspects)),
        outcome.diagnosis.verdict,
        _stacked(f"{e.horizon:g} s" for e in outcome.errors),
        _stacked(_in_units(e.nominal, units) for e in outcome.errors),
        _stacked(_in_units(e.completed, units) for e in outcome.errors),
        _stacked("-" if e.authors is None else _in_units(e.authors, units) for e in outcome.errors),
        _stacked(_in_units(e.noise_floor, units) for e in outcome.errors),
    )


def score(known: Mapping[str, str], found: tuple[FoundEffect, ...]) -> str:
    """How many of the known effects were named, how many more only as a tie, and how many other effects were named."""
    names = {effect.name for effect in found}
    ties = {name for effect in found for name in effect.equivalent} - names
    counts = [f"{len(names & known.keys())} of {len(known)}"]
    if ties & known.keys():
        counts.append(f"{len(ties & known.keys())} tied")
    if names - known.keys():
        counts.append(f"{len(names - known.keys())} beside")
    return ", ".join(counts)


def asked(suspect: Suspect) -> str:
    """What came of a known effect: its free size, and of the authors' figure."""
    values = ", ".join(value_in_words(number) for number in suspect.parameters)
    others = f" in place of {' and '.join(suspect.in_place_of)}" if suspect.in_place_of else ""
    evidence = f"gains {nats(suspect.log_evidence_gain)} nats of {nats(suspect.required_gain)}"
    standing = "named" if suspect.unnamed is None else "in the model without a name"
    named = standing if suspect.named else evidence if suspect.supported else "not named"
    if suspect.size is None:
        return f"{suspect.name}{others}: {standing if suspect.named else evidence}; {values}"
    loss = suspect.size.loss_to_free if suspect.size.against_free else suspect.size.loss
    apart = f"{nats(abs(loss))} nats {'worse' if loss >= 0.0 else 'better'}"
    if suspect.size.excluded:
        found = f"excluded: {apart}, held-out error {significant(suspect.size.error_ratio, 2)} times"
    else:
        found = f"size agrees: {apart}" if suspect.supported else f"not excluded: {apart}"
    return f"{suspect.name}{others}: {named}, {found}; {values}"


def _shown(effect: FoundEffect) -> str:
    values = ", ".join(value_in_words(number) for number in effect.parameters)
    alike = f" (or {', '.join(effect.equivalent)})" if effect.equivalent else ""
    return f"{effect.name}{alike}: {values}"


def _in_units(errors: Mapping[str, float], units: Mapping[str, str]) -> str:
    return ", ".join(f"{column} {compact(error, 3)} {units[column]}" for column, error in errors.items())


def _stacked(lines: Iterable[str]) -> str:
    return "<br>".join(lines)
