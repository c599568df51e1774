"""The numbers behind the charts of a diagnosis page, as plain data for its script."""

import math
from dataclasses import dataclass

import numpy as np

from wipx.core.curve import Curve
from wipx.core.diagnosis import ConsideredEffect, Diagnosis
from wipx.core.location import ErrorMap
from wipx.effects.words import effect_in_words, site_in_words
from wipx.report.charts import comparison_data, json_number
from wipx.report.diagnosis_words import capitalised

MOST_RUNS = 24  # strips of recordings; more are no longer read
MOST_REFERENCE_ROWS = 2000
LEAST_FULL_BAR = 20.0  # nats; where no candidate gains anything, no bar must look long


@dataclass(frozen=True)
class TitledCurve:
    """A curve with what it belongs to.

    Attributes:
        title: In words.
        curve: The force.
        stand_in: Whether it stands in for what no effect explains.
    """

    title: str
    curve: Curve
    stand_in: bool


def titled_curves(diagnosis: Diagnosis) -> tuple[TitledCurve, ...]:
    """The laws that were found, the largest effect first, then the stand-in for what is left over."""
    kind = diagnosis.model.plant.kind
    found = [(effect.name, effect.curve) for effect in diagnosis.effects]
    curves = [
        TitledCurve(capitalised(effect_in_words(name, kind)), curve, stand_in=False)
        for name, curve in found
        if curve is not None
    ]
    left = diagnosis.unexplained
    if left.curve is not None:
        place = f" at {site_in_words(left.site, kind)}" if left.site else ""
        curves.append(TitledCurve(f"Unexplained{place}", left.curve, stand_in=True))
    return tuple(curves)


def ranked_candidates(diagnosis: Diagnosis) -> tuple[ConsideredEffect, ...]:
    """What was considered, each once, the largest gain first; those without a known gain last.

    An effect of the answer has its gain there, others the largest that they had in the search.
    """
    found: dict[str, ConsideredEffect] = {}
    for candidate in diagnosis.candidates:
        before = found.get(candidate.name)
        if not candidate.chosen and (before is None or not before.gain >= candidate.gain):
            found[candidate.name] = candidate
    for effect in diagnosis.effects:
        found[effect.name] = ConsideredEffect(effect.name, effect.log_evidence_gain, True, "part of the answer")
    return tuple(sorted(found.values(), key=lambda c: -c.gain if math.isfinite(c.gain) else math.inf))


def full_bar(diagnosis: Diagnosis) -> float:
    """The gain of a bar of full length [nats]."""
    return max([LEAST_FULL_BAR, *(c.gain for c in ranked_candidates(diagnosis) if math.isfinite(c.gain))])


def bar_length(gain: float, largest: float) -> float:
    """Length of a bar from 0 to 1, proportional to log(1 + gain): gains of rivals differ by powers of ten."""
    return math.log1p(gain) / math.log1p(largest) if math.isfinite(gain) and gain > 0.0 else 0.0


def diagnosis_data(diagnosis: Diagnosis) -> dict:
    """Everything that the page's script draws; holds only what JSON can, nothing infinite."""
    where = diagnosis.location.map
    return {
        **comparison_data(diagnosis),
        "map": None if where is None else _map(where),
        "strips": None if where is None else _strips(where),
        "curves": [_curve(titled) for titled in titled_curves(diagnosis)],
        "reference": _reference(diagnosis),
    }


def strip_runs(where: ErrorMap) -> tuple[int, ...]:
    """Positions of the recordings whose strips are shown: the `MOST_RUNS` with the largest excess, in their order."""
    means = [float(np.nansum(along)) for along in where.along]
    largest = sorted(range(len(where.runs)), key=lambda run: -means[run])[:MOST_RUNS]
    return tuple(sorted(largest))


def colour_top(values: np.ndarray) -> float:
    """The value of the strongest colour; single bins above it must not pale all others."""
    positive = values[np.isfinite(values) & (values > 0.0)]
    return float(np.quantile(positive, 0.98)) if len(positive) else 1.0


def force_range(curve: Curve) -> tuple[float, float]:
    """Range of the ordinate that shows the law and the data's means; error bars may leave it."""
    values = np.concatenate([curve.law, curve.force])
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return -1.0, 1.0
    low, high = min(float(finite.min()), 0.0), max(float(finite.max()), 0.0)
    margin = 0.12 * (high - low) or 1.0
    return low - margin, high + margin


def _map(where: ErrorMap) -> dict:
    return {
        "signals": list(where.signals),
        "units": list(where.units),
        "edges": [_numbers(edges) for edges in where.edges],
        "excess": [_numbers(row) for row in where.excess.T],
        "top": colour_top(where.excess),
    }


def _strips(where: ErrorMap) -> dict:
    runs = strip_runs(where)
    shown = [where.along[run] for run in runs]
    return {
        "runs": [where.runs[run] for run in runs],
        "edges": [_numbers(_edges(where.times[run])) for run in runs],
        "excess": [_numbers(along) for along in shown],
        "top": colour_top(np.concatenate(shown)) if shown else 1.0,
    }


def _edges(middles: np.ndarray) -> np.ndarray:
    """Edges of bins with these middles [s]."""
    if len(middles) < 2:
        return np.concatenate([middles - 0.5, middles[-1:] + 0.5])
    between = 0.5 * (middles[1:] + middles[:-1])
    return np.concatenate([[2.0 * middles[0] - between[0]], between, [2.0 * middles[-1] - between[-1]]])


def _curve(titled: TitledCurve) -> dict:
    curve = titled.curve
    return {
        "title": titled.title,
        "standIn": titled.stand_in,
        "signal": curve.signal,
        "signalUnit": curve.signal_unit,
        "force": curve.quantity,
        "forceUnit": curve.force_unit,
        "at": _numbers(curve.at),
        "law": _numbers(curve.law),
        "bins": _numbers(curve.bins),
        "mean": _numbers(curve.force),
        "spread": _numbers(2.0 * curve.spread),
        "range": list(force_range(curve)),
    }


def _reference(diagnosis: Diagnosis) -> dict | None:
    following = diagnosis.next_experiment
    if following is None or "t" not in following.reference:
        return None
    t = following.reference["t"]
    rows = slice(None, None, max(1, -(-len(t) // MOST_REFERENCE_ROWS)))
    return {
        "t": _numbers(t[rows]),
        "columns": [
            {
                "name": name,
                "unit": diagnosis.units.get(name, diagnosis.nominal.plant.unit_of(name)),
                "values": _numbers(values[rows]),
            }
            for name, values in following.reference.items()
            if name != "t"
        ],
    }


def _numbers(values: np.ndarray) -> list[float | None]:
    """Numbers with the six digits that a picture can show."""
    return [json_number(float(f"{value:.6g}")) for value in np.asarray(values, dtype=float).tolist()]
