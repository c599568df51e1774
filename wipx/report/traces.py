"""Recordings and predictions made ready to draw: fewer points, and lines that break where predictions restart."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from wipx.core.results import Trace

Change = Callable[[np.ndarray], np.ndarray]


def decimate(trace: Trace, limit: int) -> Trace:
    """About `limit` rows of a trace that keep the extremes of what was recorded and commanded.

    Rows are divided into equal runs, and of every run the rows stay at which a recorded or commanded
    column is lowest or highest. Rows on both sides of a restart stay too, so no prediction is cut short.
    """
    if len(trace.t) <= limit:
        return trace
    columns = [*trace.recorded.values(), *trace.command.values()]
    run = -(-len(trace.t) * 2 * len(columns) // limit)
    kept = [extreme for values in columns for extreme in (_lowest(values, run), _lowest(-values, run))]
    restarts = restart_rows(trace)
    rows = np.unique(np.concatenate([*kept, restarts, restarts - 1, [0, len(trace.t) - 1]]))
    return _changed(trace, lambda values: values[rows], lambda values: values[rows])


def break_at_restarts(trace: Trace) -> Trace:
    """The trace with every restart's row doubled, its first copy without predictions.

    A line drawn through the predictions then stops at the end of a window instead of jumping to the
    next; recorded columns and commands look the same as before.
    """
    rows = restart_rows(trace)
    return _changed(
        trace,
        lambda values: np.insert(values, rows, values[rows]),
        lambda values: np.insert(values, rows, np.nan),
    )


def restart_rows(trace: Trace) -> np.ndarray:
    """First row of every window but one that begins the trace, ascending, shape (restarts,)."""
    rows = np.unique(np.searchsorted(trace.t, trace.starts - 1e-9))  # 1e-9 s: rounding of times in text files
    return rows[(rows > 0) & (rows < len(trace.t))]


def prediction_error(trace: Trace, predicted: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Root mean square of predicted minus recorded by column; NaN where nothing was predicted."""
    return {column: _rms(predicted[column] - recorded) for column, recorded in trace.recorded.items()}


def improvement(trace: Trace) -> float:
    """Mean over the columns of log(nominal error / completed error); NaN where that has no value."""
    nominal = np.array(list(prediction_error(trace, trace.nominal).values()))
    completed = np.array(list(prediction_error(trace, trace.completed).values()))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.mean(np.log(nominal) - np.log(completed)))


def between(trace: Trace, begin: float, end: float) -> Trace:
    """Rows with begin <= t < end [s]."""
    first, last = np.searchsorted(trace.t, (begin - 1e-9, end - 1e-9))
    return _changed(trace, lambda values: values[first:last], lambda values: values[first:last])


def _rms(error: np.ndarray) -> float:
    known = error[~np.isnan(error)]
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _lowest(values: np.ndarray, run: int) -> np.ndarray:
    """Row of the lowest value in every run of rows; NaN counts as highest."""
    runs = -(-len(values) // run)
    padded = np.full(runs * run, np.inf)
    padded[: len(values)] = np.where(np.isnan(values), np.inf, values)
    rows = padded.reshape(runs, run).argmin(axis=1) + run * np.arange(runs)
    return rows[rows < len(values)]


def _changed(trace: Trace, change_measured: Change, change_predicted: Change) -> Trace:
    """The trace with one function applied to time, commands and recorded columns, another to predictions."""
    return replace(
        trace,
        t=change_measured(trace.t),
        command={name: change_measured(values) for name, values in trace.command.items()},
        recorded={name: change_measured(values) for name, values in trace.recorded.items()},
        nominal={name: change_predicted(values) for name, values in trace.nominal.items()},
        completed={name: change_predicted(values) for name, values in trace.completed.items()},
    )
