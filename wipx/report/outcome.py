"""What a completed model achieved, in figures and words that page, tables and figures share."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from wipx.core.results import Estimate, FitErrors, IdentificationResult, Trace
from wipx.report.numbers import Scale, compact, scale_for, significant

HELD_OUT = "held-out"
FIT = "fit"


class ModelComparison(Protocol):
    """What identification and diagnosis both leave: predictions by the nominal and the completed model."""

    @property
    def title(self) -> str:
        """Of the page."""
        ...

    @property
    def units(self) -> Mapping[str, str]:
        """SI unit by column."""
        ...

    @property
    def fit(self) -> FitErrors:
        """Errors on the recordings that were fitted."""
        ...

    @property
    def held_out(self) -> FitErrors | None:
        """Errors on the others; None where there are none."""
        ...

    @property
    def traces(self) -> tuple[Trace, ...]:
        """Recordings beside predictions."""
        ...


@dataclass(frozen=True)
class SignalErrors:
    """Prediction errors of one recorded column, in the unit they are shown in.

    Attributes:
        signal: The column.
        recordings: `HELD_OUT` or `FIT`.
        scale: From SI to the unit shown.
        nominal: Root mean square error of the nominal model [scale.unit].
        completed: Of the completed model.
        noise_floor: Of a perfect model.
    """

    signal: str
    recordings: str
    scale: Scale
    nominal: float
    completed: float
    noise_floor: float

    @property
    def change(self) -> str:
        """By how much the completed model predicts better or worse, in words."""
        if not math.isfinite(self.completed):
            return "completed model fails to predict"
        if not math.isfinite(self.nominal):
            return "nominal model fails to predict"
        if self.completed <= 0.0 or self.nominal <= 0.0:
            return ""
        ratio = self.nominal / self.completed
        if 0.98 < ratio < 1.02:
            return "unchanged"
        return f"{_factor(ratio)} times smaller" if ratio > 1.0 else f"{_factor(1.0 / ratio)} times larger"

    @property
    def above_floor(self) -> str:
        """How far the completed model is from a perfect one, in words; empty where the floor is unknown."""
        if not (math.isfinite(self.completed) and math.isfinite(self.noise_floor) and self.noise_floor > 0.0):
            return ""
        ratio = self.completed / self.noise_floor
        return "at the sensor-noise floor" if ratio < 1.15 else f"{_factor(ratio)} times the sensor-noise floor"

    @property
    def worse(self) -> bool:
        """Whether the completed model predicts worse than the nominal one, or not at all."""
        return not self.completed <= 1.02 * self.nominal


def signal_errors(result: ModelComparison) -> tuple[SignalErrors, ...]:
    """Errors of every signal, held-out recordings first; a signal has one unit throughout."""
    parts = _parts(result)
    rows = []
    for label, errors in parts:
        for signal in errors.nominal:
            scale = error_scale(result, signal)
            values = (errors.nominal[signal], errors.completed[signal], errors.noise_floor.get(signal, math.nan))
            rows.append(SignalErrors(signal, label, scale, *(scale.factor * value for value in values)))
    return tuple(rows)


def error_scale(result: ModelComparison, signal: str) -> Scale:
    """The unit in which errors of a signal are shown."""
    sizes = [size.get(signal, math.nan) for _, part in _parts(result) for size in (part.nominal, part.completed)]
    return scale_for(sizes, result.units.get(signal, ""))


def judged_errors(result: ModelComparison) -> tuple[SignalErrors, ...]:
    """Errors that the outcome is judged by: on held-out recordings where there are any."""
    rows = signal_errors(result)
    return tuple(row for row in rows if row.recordings == rows[0].recordings)


def judged_fit(result: ModelComparison) -> FitErrors:
    """The errors behind `judged_errors`."""
    return held_out_errors(result) or result.fit


def held_out_errors(result: ModelComparison) -> FitErrors | None:
    """Errors on held-out recordings; None where no window of any was predicted."""
    return result.held_out if result.held_out is not None and result.held_out.windows > 0 else None


def windows_by_part(result: ModelComparison) -> dict[str, int]:
    """Number of windows behind the errors of `HELD_OUT` and `FIT`."""
    return {HELD_OUT: 0, **{label: errors.windows for label, errors in _parts(result)}}


def headline(result: ModelComparison, arrow: str = "->") -> str:
    """The outcome in one sentence with its figures."""
    rows = judged_errors(result)
    where = "held-out recordings" if held_out_errors(result) else "the fitted recordings (none were held out)"
    changes = ", ".join(
        f"{row.signal} {significant(row.nominal)} {arrow} {significant(row.completed)} {row.scale.unit}" for row in rows
    )
    floors = [f"{significant(row.noise_floor)} {row.scale.unit}" for row in rows if math.isfinite(row.noise_floor)]
    floor = f" (sensor-noise floor {', '.join(floors)})" if floors else ""
    return f"Prediction error over {compact(judged_fit(result).horizon)} s on {where}: {changes}{floor}"


def remark(estimate: Estimate) -> str:
    """What a reader must know before using an identified number; empty where there is nothing."""
    remarks = []
    if estimate.at_bound:
        remarks.append("at a bound of the search; the true value may lie beyond")
    if math.isnan(estimate.low) and math.isnan(estimate.high):
        remarks.append("this objective gives no interval")
    elif not (math.isfinite(estimate.low) and math.isfinite(estimate.high)):
        remarks.append("interval unbounded: these recordings do not determine it")
    elif estimate.low <= estimate.nominal <= estimate.high:
        remarks.append("interval includes the value before: the change is not significant")
    elif estimate.high - estimate.low > abs(estimate.value):
        remarks.append("weakly determined: the interval is wider than the value")
    if estimate.from_run_to_run is not None:
        low, high = estimate.from_run_to_run
        remarks.append(f"moves from {compact(low)} to {compact(high)} from run to run")
    return "; ".join(remarks)


def search_summary(result: IdentificationResult) -> str:
    """The optimizer, what it spent and why it stopped, in one phrase."""
    history = result.history
    if len(history.evaluations) == 0:
        return f"{history.optimizer}: {history.stopped}"
    spent = f"{int(history.evaluations[-1])} evaluations in {compact(float(history.seconds[-1]), 3)} s"
    return f"{history.optimizer}: {spent}, stopped: {history.stopped}"


def _parts(result: ModelComparison) -> tuple[tuple[str, FitErrors], ...]:
    fit, held_out = (FIT, result.fit), held_out_errors(result)
    return (fit,) if held_out is None else ((HELD_OUT, held_out), fit)


def _factor(ratio: float) -> str:
    return f"{ratio:.2f}" if ratio < 1.1 else significant(ratio, 2) if ratio < 100.0 else f"{ratio:.0f}"
