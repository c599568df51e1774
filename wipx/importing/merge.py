"""Columns of several streams, with their own rates, on the rows of one of them.

A measurement is interpolated between two messages. A command is held: a row has its mean over the time until the next
row (contract section 1), which is the command itself where it does not change in between.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.importing.clock import Clock, OrderedRows, ordered
from wipx.importing.mapping import MappedColumn
from wipx.importing.spool import Spool

LONGEST_STEP = 1.5  # usual steps over which the mean of a command is taken at most; a row before a gap ends there


@dataclass(frozen=True)
class Series:
    """A column as its stream has it, in one episode.

    Attributes:
        t: Strictly increasing, shape (n,) [s] since the episode's origin.
        values: Shape (n,) [SI].
        missing: Messages without a finite value.
    """

    t: np.ndarray
    values: np.ndarray
    missing: int


@dataclass(frozen=True)
class Episode:
    """A part of the log, on one clock.

    Attributes:
        label: Of the part; "" where the log has one only.
        spool: The log.
        clock: Which stamps count.
        order: The messages in their order, by stream.
        origin: Time 0 of the episode [ns].
    """

    label: str
    spool: Spool
    clock: Clock
    order: Mapping[str, OrderedRows]
    origin: int

    def times(self, stream: str) -> np.ndarray:
        """Times of a stream's messages, shape (n,) [s]."""
        return (self.order[stream].stamps - self.origin) / 1e9

    def series(self, column: MappedColumn) -> Series:
        """A column as its stream has it."""
        stored = self.spool.streams[column.stream]
        begin, end = stored.part(self.label)
        rows = self.order[column.stream].rows
        values = stored.values(column.field, begin, end)[rows]
        t = self.times(column.stream)
        chosen = np.ones(len(rows), dtype=bool)
        for name, value in column.source.where.items():
            chosen &= stored.values(name, begin, end)[rows] == value
        finite = chosen & np.isfinite(values)
        t, values = t[finite], values[finite]
        if column.source.wraps is not None:
            values = np.unwrap(values, period=column.source.wraps)
        values = column.source.scale * column.factor * values + column.source.offset
        return Series(t, values, int(np.count_nonzero(chosen) - np.count_nonzero(finite)))


def episode(label: str, spool: Spool, clock: Clock) -> Episode:
    """A part of the log with its messages in order."""
    order = {}
    for name in clock.of:
        begin, end = spool.streams[name].part(label)
        order[name] = ordered(clock.stamps(spool.streams[name], begin, end))
    first = [int(rows.stamps[0]) for rows in order.values() if len(rows.stamps)]
    return Episode(label, spool, clock, order, min(first, default=0))


class MergedEpisode:
    """The columns of an episode on its rows, one file for each.

    Args:
        t: Times of the rows, strictly increasing, shape (rows,) [s].
        folder: Takes the files; it exists and is empty.
    """

    def __init__(self, t: np.ndarray, folder: Path) -> None:
        self.t = t
        self._folder = folder
        self._files: dict[str, Path] = {}

    def add(self, name: str, series: Series, *, held: bool) -> None:
        """Put a column on the rows."""
        self._files[name] = self._folder / str(len(self._files))
        on_rows(series, self.t, held=held).tofile(self._files[name])

    @property
    def names(self) -> Sequence[str]:
        """Columns, in the order in which they were added."""
        return tuple(self._files)

    def column(self, name: str, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Rows begin <= k < end of a column, shape (end - begin,) [SI]; NaN where its stream has nothing yet."""
        count = (len(self.t) if end is None else end) - begin
        return np.fromfile(self._files[name], dtype=np.float64, count=count, offset=8 * begin)


def on_rows(series: Series, t: np.ndarray, *, held: bool) -> np.ndarray:
    """A column at the times of rows, shape (rows,) [SI]; NaN before its first message, if linear after its last too.

    Args:
        series: The column.
        t: Times of the rows, strictly increasing, shape (rows,) [s].
        held: Whether a value lasts until the next message.
    """
    if len(series.t) == 0 or len(t) == 0:
        return np.full(len(t), np.nan)
    if not held:
        return np.interp(t, series.t, series.values, left=np.nan, right=np.nan)
    return _mean_of_held(series, t)


def _mean_of_held(series: Series, t: np.ndarray) -> np.ndarray:
    usual = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
    ends = np.minimum(np.append(t[1:], np.inf), t + LONGEST_STEP * usual)
    first = np.searchsorted(series.t, t, side="right") - 1
    last = np.searchsorted(series.t, ends, side="left") - 1
    known = first >= 0
    values = np.where(known, series.values[np.maximum(first, 0)], np.nan)
    several = known & (last > first)
    if several.any():
        # Integral of the held value from the series' beginning to each of its times.
        integral = np.concatenate([[0.0], np.cumsum(series.values[:-1] * np.diff(series.t))])
        a, b = first[several], last[several]
        until_end = integral[b] + series.values[b] * (ends[several] - series.t[b])
        until_begin = integral[a] + series.values[a] * (t[several] - series.t[a])
        values[several] = (until_end - until_begin) / (ends[several] - t[several])
    return values
