"""What is wrong with single signals and streams: rates, jitter, gaps, duplicates; saturated and frozen signals."""

import numpy as np

from wipx.core.log_preview import ColumnSummary, StreamSummary, Trace
from wipx.importing.clock import Clock, difference
from wipx.importing.cutting import longest_gap, resolution
from wipx.importing.mapping import LogMapping, MappedColumn
from wipx.importing.merge import Episode
from wipx.importing.spool import StoredStream

SATURATED_SHARE = 0.005  # of the values at an end, from which on a signal may be saturated
SATURATED_STAY = 3.0  # usual stays at a value, from which on the signal dwells at an end
SATURATED_ARRIVAL = (
    0.25  # of the usual step: a signal that is cut off arrives at speed, one that turns or stops slows down
)
SATURATED_COUNTS = 4.0  # resolutions per step, below which speed is not to be told
FEWEST_LEVELS = 20  # values that a signal has; one with fewer is no measured quantity but a state
POINTS = 1200  # of a trace in a picture


def unused_stream(stream: StoredStream) -> StreamSummary:
    """A stream that no column comes from, with its rate by the stamps that it has."""
    stamps = stream.header()
    if np.count_nonzero(stamps != np.iinfo(np.int64).min) < len(stamps):
        stamps = stream.receive()
    steps = np.diff(stamps) / 1e9
    usual = float(np.median(steps)) if len(steps) else 0.0
    rate = 1.0 / usual if usual > 0.0 else float("nan")
    return StreamSummary(stream.name, stream.kind, stream.rows, _shown(stream), rate=rate)


def used_stream(stream: StoredStream, clock: Clock, episodes: list[Episode], mapping: LogMapping) -> StreamSummary:
    """A stream that columns come from, over all episodes."""
    steps, gaps, counts = [], 0, np.zeros(3, dtype=int)
    for part in episodes:
        order = part.order[stream.name]
        t = part.times(stream.name)
        step = np.diff(t)
        steps.append(step)
        gaps += int(np.count_nonzero(step > longest_gap(t, mapping)))
        counts += (order.duplicates, order.out_of_order, order.unstamped)
    together = np.concatenate(steps) if steps else np.zeros(0)
    usual = float(np.median(together)) if len(together) else float("nan")
    regular = together[together <= 10.0 * usual] if len(together) else together
    return StreamSummary(
        name=stream.name,
        kind=stream.kind,
        rows=stream.rows,
        fields=_shown(stream),
        clock=clock.of[stream.name],
        rate=1.0 / usual if usual > 0.0 else float("nan"),
        jitter=float(np.std(regular)) if len(regular) else float("nan"),
        gaps=gaps,
        longest_step=float(together.max()) if len(together) else float("nan"),
        duplicates=int(counts[0]),
        out_of_order=int(counts[1]),
        unstamped=int(counts[2]),
        difference=difference(stream),
    )


def column_summary(
    column: MappedColumn, values: np.ndarray, missing: int, frozen: tuple[float, float]
) -> ColumnSummary:
    """A column over all episodes.

    Args:
        column: The column.
        values: All its finite values, shape (n,) [SI].
        missing: Messages without a finite value.
        frozen: Duration and beginning of the longest time in which it is constant but should not be [s].
    """
    step = resolution(values)
    low, high = (float(values.min()), float(values.max())) if len(values) else (float("nan"),) * 2
    return ColumnSummary(
        name=column.name,
        stream=column.stream,
        field=column.field,
        unit=column.si_unit,
        held=column.held,
        samples=len(values),
        missing=missing,
        low=low,
        high=high,
        resolution=step,
        at_low=_share_at(values, low),
        at_high=_share_at(values, high),
        frozen=frozen[0],
        frozen_at=frozen[1],
    )


def longest_constant(t: np.ndarray, values: np.ndarray, active: np.ndarray) -> tuple[float, float]:
    """Duration and beginning of the longest time in which a signal keeps one value while the robot is active [s].

    Args:
        t: Times of the rows, shape (rows,) [s].
        values: Of the signal, shape (rows,).
        active: Whether something else moves or is commanded, shape (rows,).
    """
    if len(t) < 2:
        return 0.0, 0.0
    same = (np.diff(values) == 0.0) & active[1:] & active[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    if not len(edges):
        return 0.0, 0.0
    begins, ends = t[edges[::2]], t[edges[1::2]]
    longest = int(np.argmax(ends - begins))
    return float(ends[longest] - begins[longest]), float(begins[longest])


def trace(t: np.ndarray, values: np.ndarray) -> Trace:
    """A column for a picture: lowest and highest value in each of `POINTS` parts.

    Args:
        t: Times, increasing, shape (n,) [s].
        values: Shape (n,) [SI].
    """
    parts = max(1, -(-len(t) // POINTS))
    starts = np.arange(0, len(t), parts)
    if not len(starts):
        return Trace(t, values, values)
    return Trace(t[starts], np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts))


def _share_at(values: np.ndarray, end: float) -> float:
    """Share of the values at an end of a signal's range; 0 where that is no saturation.

    A signal is cut off where it dwells at an end at least twice, and arrived there at speed most of the times.
    """
    at = values == end
    share = float(np.mean(at)) if len(values) else 0.0
    if share < SATURATED_SHARE or len(np.unique(values)) < FEWEST_LEVELS:
        return 0.0
    changes = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    visited, stays = values[changes], np.diff(np.append(changes, len(values)))
    steps = np.abs(np.diff(visited))
    dwells = np.flatnonzero((visited == end) & (stays >= SATURATED_STAY * np.median(stays)))
    arrivals = steps[dwells[dwells >= 2] - 2]  # the last step that the end has not shortened
    speed = max(SATURATED_ARRIVAL * float(np.sqrt(np.mean(steps**2))), SATURATED_COUNTS * resolution(values))
    fast = np.count_nonzero(arrivals >= speed)
    return share if fast >= max(2, len(arrivals) / 2) else 0.0


def _shown(stream: StoredStream) -> tuple[str, ...]:
    return tuple(stream.fields)
