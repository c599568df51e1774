"""The numbers behind the page's charts, as plain data for its script; the script decides how they look."""

import base64
import math
from collections.abc import Iterable

import numpy as np

from wipx.core.results import FitErrors, IdentificationResult, SearchHistory, Trace
from wipx.report.numbers import scale_for, significant
from wipx.report.outcome import ModelComparison, SignalErrors, error_scale, judged_fit, signal_errors
from wipx.report.traces import break_at_restarts, decimate, prediction_error

MOST_ROWS = 4000  # rows of one trace; more than a screen has pixels
MOST_VALUES = 180_000  # in all charts: half a megabyte of the page, beside 0.7 of plotly.js
MISSING = 65535  # of a rounded value that is not a number
FURTHEST = 3.0  # ranges of the recorded motion; what lies beyond is drawn there, outside the axes
MOST_TRACES = 12


def shown_traces(result: ModelComparison) -> tuple[Trace, ...]:
    """The traces that the page shows: held-out ones first, `MOST_TRACES` at most."""
    return tuple(sorted(result.traces, key=lambda trace: not trace.held_out))[:MOST_TRACES]


def row_limit(traces: tuple[Trace, ...]) -> int:
    """Rows that each trace may have, so that the page stays small."""
    columns = sum(1 + len(trace.command) + 3 * len(trace.recorded) for trace in traces)
    return min(MOST_ROWS, MOST_VALUES // max(columns, 1))


def chart_data(result: IdentificationResult) -> dict:
    """Everything that the page's script draws; holds only what JSON can, nothing infinite."""
    return {**comparison_data(result), "search": _search(result.history)}


def comparison_data(result: ModelComparison) -> dict:
    """The part of a page's data that compares the nominal with the completed model."""
    traces = shown_traces(result)
    limit = row_limit(traces)
    return {
        "traces": [_trace(result, trace, limit) for trace in traces],
        "errors": _errors(signal_errors(result)),
    }


def _trace(result: ModelComparison, trace: Trace, limit: int) -> dict:
    shown = break_at_restarts(decimate(trace, limit))
    return {
        "caption": _caption(result, trace, len(decimate(trace, limit).t)),
        "t": packed(shown.t),
        "signals": [_signal(result, shown, column) for column in shown.recorded],
        "commands": [_command(result, column, values) for column, values in shown.command.items()],
    }


def _signal(result: ModelComparison, shown: Trace, column: str) -> dict:
    recorded = shown.recorded[column]
    scale = scale_for([_largest(recorded)], result.units.get(column, ""))
    errors = error_scale(result, column)
    return {
        "name": column,
        "factor": scale.factor,
        "unit": scale.unit,
        "errorFactor": errors.factor,
        "errorUnit": errors.unit,
        "noiseFloor": json_number(_floors(judged_fit(result), column)),
        "recorded": rounded(recorded),
        "nominal": rounded(_within_reach(shown.nominal[column], recorded)),
        "completed": rounded(_within_reach(shown.completed[column], recorded)),
    }


def _command(result: ModelComparison, column: str, values: np.ndarray) -> dict:
    scale = scale_for([_largest(values)], result.units.get(column, ""))
    return {"name": column, "factor": scale.factor, "unit": scale.unit, "values": rounded(values)}


def _caption(result: ModelComparison, trace: Trace, rows: int) -> str:
    """The errors of one recording, and whether it is drawn with fewer points than it has."""
    nominal, completed = prediction_error(trace, trace.nominal), prediction_error(trace, trace.completed)
    changes = []
    for column in trace.recorded:
        scale = error_scale(result, column)
        before, after = significant(scale.factor * nominal[column]), significant(scale.factor * completed[column])
        changes.append(f"{column} {before} \N{RIGHTWARDS ARROW} {after} {scale.unit}")
    kind = "Held-out" if trace.held_out else "Used for the fit"
    thinned = "" if rows == len(trace.t) else f" Drawn with {rows} of {len(trace.t)} rows; peaks are kept."
    return f"{kind}. Error in this recording: {', '.join(changes)}.{thinned}"


def _errors(rows: tuple[SignalErrors, ...]) -> list[dict]:
    """One chart per signal; its groups are the kinds of recordings."""
    charts = []
    for signal in dict.fromkeys(row.signal for row in rows):
        group = [row for row in rows if row.signal == signal]
        values = [(row.nominal, row.completed, row.noise_floor) for row in group]
        charts.append(
            {
                "signal": signal,
                "unit": group[0].scale.unit,
                "recordings": [row.recordings for row in group],
                "nominal": [json_number(row.nominal) for row in group],
                "completed": [json_number(row.completed) for row in group],
                "noiseFloor": [json_number(row.noise_floor) for row in group],
                "nominalText": [significant(row.nominal) for row in group],
                "completedText": [significant(row.completed) for row in group],
                "noiseFloorText": [significant(row.noise_floor) for row in group],
                "logarithmic": wants_logarithm(value for row in values for value in row),
            }
        )
    return charts


def wants_logarithm(values: Iterable[float], ratio: float = 10.0) -> bool:
    """Whether values need a logarithmic axis: none negative, the largest above the least positive by `ratio`."""
    finite = [value for value in values if math.isfinite(value)]
    positive = [value for value in finite if value > 0.0]
    return bool(positive) and min(finite) >= 0.0 and max(positive) > ratio * min(positive)


def _search(history: SearchHistory) -> dict | None:
    if len(history.evaluations) == 0:
        return None
    return {
        "evaluations": [int(count) for count in history.evaluations],
        "seconds": [json_number(time) for time in history.seconds],
        "bestLoss": [json_number(loss) for loss in history.best_loss],
        "logarithmic": wants_logarithm(history.best_loss.tolist()),
    }


def _floors(errors: FitErrors, column: str) -> float:
    return errors.noise_floor.get(column, math.nan)


def _largest(values: np.ndarray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max(initial=0.0))


def json_number(value: float) -> float | None:
    """A number that JSON can hold; None for NaN and infinities."""
    return float(value) if math.isfinite(value) else None


def packed(values: np.ndarray) -> str:
    """Little-endian 32-bit floats in base64: a third of the size of their decimal digits."""
    with np.errstate(over="ignore"):
        return base64.b64encode(np.asarray(values, dtype="<f4").tobytes()).decode("ascii")


def _within_reach(predicted: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """A prediction whose values that ran away do not take the steps of the others."""
    low, high = np.nanmin(recorded), np.nanmax(recorded)
    reach = FURTHEST * (high - low)
    return np.clip(predicted, low - reach, high + reach) if reach > 0.0 else predicted


def rounded(values: np.ndarray) -> dict:
    """A series in 16 bits a value: the least value, the step, and the steps above it in base64."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    step = (high - low) / (MISSING - 1)
    steps = np.full(len(values), MISSING, dtype="<u2")
    steps[np.isfinite(values)] = np.rint((finite - low) / (step or 1.0))
    return {"low": low, "step": step, "steps": base64.b64encode(steps.tobytes()).decode("ascii")}
