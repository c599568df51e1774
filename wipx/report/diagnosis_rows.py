"""The tables and bars of a diagnosis page as rows of finished texts."""

import math
from dataclasses import dataclass

from wipx.core.diagnosis import ConsideredEffect, Diagnosis
from wipx.core.results import Estimate
from wipx.effects.words import effect_in_words, site_in_words
from wipx.report import diagnosis_words as words
from wipx.report.diagnosis_charts import bar_length, full_bar, ranked_candidates
from wipx.report.numbers import MISSING, compact, significant


@dataclass(frozen=True)
class Bar:
    """A row with a horizontal bar, ready to print.

    Attributes:
        label: What it belongs to, in words.
        name: Its name in files; empty where it has none.
        length: From 0 to 100.
        value: Its value, in words.
        remark: What is said of it; may be empty.
        chosen: Whether it stands out.
    """

    label: str
    name: str
    length: float
    value: str
    remark: str
    chosen: bool


@dataclass(frozen=True)
class NumberRow:
    """A number of an effect, ready to print.

    Attributes:
        symbol: In the law.
        value: Rounded as its interval demands.
        unit: SI unit; empty for ratios.
        interval: The 95 % interval.
        meaning: In words.
        at_bound: Whether the search stopped at a bound.
    """

    symbol: str
    value: str
    unit: str
    interval: str
    meaning: str
    at_bound: bool


@dataclass(frozen=True)
class RivalRow:
    """Another effect in the place of a found one, ready to print.

    Attributes:
        words: In words.
        name: "site/kind".
        separation: How far the recordings are from it.
        values: Its numbers.
        tied: Whether these recordings cannot tell it from the found one.
    """

    words: str
    name: str
    separation: str
    values: str
    tied: bool


@dataclass(frozen=True)
class EffectRow:
    """A row of the table of effects, ready to print.

    Attributes:
        words: In words.
        name: "site/kind".
        law: Its equation.
        source: Paper or book.
        outside_vocabulary: Whether the vocabulary lacks it.
        numbers: Its parameters.
        evidence: Nats.
        heldout_gain: Per cent.
        probability: Per cent.
        share: Per cent of the explained mismatch.
        tied: Effects that it cannot be told from, in words.
        rivals: Other effects in its place.
    """

    words: str
    name: str
    law: str
    source: str
    outside_vocabulary: bool
    numbers: tuple[NumberRow, ...]
    evidence: str
    heldout_gain: str
    probability: str
    share: str
    tied: tuple[str, ...]
    rivals: tuple[RivalRow, ...]


@dataclass(frozen=True)
class SuspectRow:
    """What was asked about, ready to print.

    Attributes:
        words: In words.
        name: "site/kind".
        named: Whether the answer names it.
        numbers: Its parameters, if they are free.
        evidence: Nats that it adds then.
        needed: Nats that it needs to be named.
        heldout_gain: Per cent.
        sentence: What the recordings say of it.
    """

    words: str
    name: str
    named: bool
    numbers: tuple[NumberRow, ...]
    evidence: str
    required_gain: str
    heldout_gain: str
    sentence: str


@dataclass(frozen=True)
class BoundRow:
    """How large an absent effect could be, ready to print.

    Attributes:
        words: The effect in words.
        name: "site/kind.symbol".
        interval: The 95 % interval.
        unit: SI unit; empty for ratios.
    """

    words: str
    name: str
    interval: str
    unit: str


@dataclass(frozen=True)
class ModelRow:
    """A number of the rigid body, ready to print.

    Attributes:
        name: In files.
        unit: SI unit.
        nominal: Before.
        completed: After.
        changed: Whether they differ.
    """

    name: str
    unit: str
    nominal: str
    completed: str
    changed: bool


def effect_rows(diagnosis: Diagnosis) -> list[EffectRow]:
    """What was left out, the largest effect first."""
    kind = diagnosis.model.plant.kind
    return [
        EffectRow(
            words=words.capitalised(effect_in_words(effect.name, kind)),
            name=effect.name,
            law=effect.law,
            source=effect.source,
            outside_vocabulary=effect.outside_vocabulary,
            numbers=tuple(map(_number_row, effect.parameters)),
            evidence=words.nats(effect.log_evidence_gain),
            heldout_gain=words.percent(effect.heldout_gain),
            probability=words.probability(effect.present_probability),
            share=words.percent(effect.share),
            tied=tuple(words.capitalised(effect_in_words(name, kind)) for name in effect.equivalent),
            rivals=tuple(
                RivalRow(
                    words=words.capitalised(effect_in_words(rival.name, kind)),
                    name=rival.name,
                    separation=significant(rival.separation, 2),
                    values=words.values_in_words(rival.parameters),
                    tied=rival.name in effect.equivalent,
                )
                for rival in effect.rivals
            ),
        )
        for effect in diagnosis.effects
    ]


def _number_row(number: Estimate) -> NumberRow:
    return NumberRow(
        symbol=words.symbol_of(number.name),
        value=words.shown_value(number),
        unit=_unit(number.unit),
        interval=words.shown_interval(number),
        meaning=number.meaning,
        at_bound=number.at_bound,
    )


def suspect_rows(diagnosis: Diagnosis) -> list[SuspectRow]:
    """What was asked about, in the order of the questions."""
    kind = diagnosis.model.plant.kind
    return [
        SuspectRow(
            words=words.capitalised(effect_in_words(suspect.name, kind)),
            name=suspect.name,
            named=suspect.named and suspect.unnamed is None,
            numbers=tuple(map(_number_row, suspect.parameters)),
            evidence=words.nats(suspect.log_evidence_gain),
            required_gain=words.nats(suspect.required_gain),
            heldout_gain=words.percent(suspect.heldout_gain),
            sentence=suspect.sentence,
        )
        for suspect in diagnosis.suspects
    ]


def site_bars(diagnosis: Diagnosis) -> list[Bar]:
    """Shares of the mismatch by site, the largest first."""
    kind = diagnosis.model.plant.kind
    shares = sorted(diagnosis.location.sites.items(), key=lambda item: -item[1])
    return [
        Bar(
            label=words.capitalised(site_in_words(site, kind)),
            name=site,
            length=100.0 * share,
            value=words.percent(share),
            remark="",
            chosen=True,
        )
        for site, share in shares
    ]


def candidate_bars(diagnosis: Diagnosis) -> list[Bar]:
    """What was considered, the largest gain first."""
    kind, full = diagnosis.model.plant.kind, full_bar(diagnosis)
    return [_candidate_bar(candidate, full, kind) for candidate in ranked_candidates(diagnosis)]


def _candidate_bar(candidate: ConsideredEffect, full: float, plant_kind: str) -> Bar:
    return Bar(
        label=words.capitalised(effect_in_words(candidate.name, plant_kind)),
        name=candidate.name,
        length=100.0 * bar_length(candidate.gain, full),
        value=words.nats(candidate.gain),
        remark=candidate.reason,
        chosen=candidate.chosen,
    )


def menu_bars(diagnosis: Diagnosis) -> list[Bar]:
    """The experiments that were simulated, the best first."""
    following = diagnosis.next_experiment
    if following is None:
        return []
    largest = max((e.separation for e in following.menu if math.isfinite(e.separation)), default=0.0)
    return [
        Bar(
            label=words.capitalised(experiment.name),
            name="",
            length=100.0 * experiment.separation / largest if largest > 0.0 and experiment.separation > 0.0 else 0.0,
            value=significant(experiment.separation, 2),
            remark=experiment.how,
            chosen=experiment.name == following.best.name,
        )
        for experiment in following.menu
    ]


def bound_rows(diagnosis: Diagnosis) -> list[BoundRow]:
    """Effects that were not found, and how large they could be."""
    kind = diagnosis.model.plant.kind
    return [
        BoundRow(
            words=words.capitalised(effect_in_words(bound.name.rpartition(".")[0] or bound.name, kind)),
            name=bound.name,
            interval=f"[{significant(bound.low)}, {significant(bound.high)}]",
            unit=_unit(bound.unit),
        )
        for bound in diagnosis.bounds
    ]


def model_rows(diagnosis: Diagnosis) -> list[ModelRow]:
    """The rigid body's numbers before and after."""
    before, after = diagnosis.nominal, diagnosis.model
    rows = []
    for name, value in before.parameters.items():
        completed = after.parameters.get(name, math.nan)
        specification = before.plant.parameters.get(name)
        unit = specification.unit if specification else MISSING
        rows.append(ModelRow(name, unit, compact(value, 6), compact(completed, 6), changed=completed != value))
    return rows


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit
