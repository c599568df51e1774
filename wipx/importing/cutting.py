"""Where a log is cut into recordings, and why: gaps, stops, pauses."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from wipx.importing.mapping import LogMapping, MappedColumn, is_command, is_position
from wipx.importing.merge import Episode, MergedEpisode, Series

USUAL_STEPS = 10.0  # a gap is longer than so many usual steps
SHORTEST_GAP = 0.1  # [s] that count as a gap at least
IRREGULAR = 3.0  # where the 95 % step is so many usual ones, messages come when something changes, and not at a rate
REST = 0.5  # [s] over which a signal must stay still
KEPT_REST = 0.5  # [s] of a pause that a recording keeps on either side: friction shows when motion begins and ends
STILL_SHARE = 1e-3  # of the span of a signal, by which it may move at rest
STILL_MOST = 0.1  # of the span, at most
STILL_STEPS = 4.0  # steps of its resolution, likewise
NEARLY_WHOLE = 1e-3  # by which a change may miss a multiple of the resolution, as a share of it
MOSTLY = 0.95  # of the changes must be multiples
MOST_STEPS = 100.0  # steps that a usual change between neighbouring values may have
STILL_NOISE = 6.0  # standard deviations of its noise, likewise


@dataclass(frozen=True)
class Interruption:
    """A time in which no recording may be.

    Attributes:
        begin: [s]; a row at that time still belongs to the recording before.
        end: [s]; a row at that time belongs to the recording after.
        reason: In words.
    """

    begin: float
    end: float
    reason: str


@dataclass(frozen=True)
class Stretch:
    """Rows first <= k < last that belong together.

    Attributes:
        first: First row.
        last: Row behind the last.
        begins: Why it begins there.
        ends: Why it ends there.
    """

    first: int
    last: int
    begins: str
    ends: str


def longest_gap(t: np.ndarray, mapping: LogMapping) -> float:
    """The step of a stream from which on it has a gap [s]; infinite where it does not come at a rate.

    Args:
        t: Times of its messages, shape (n,) [s].
        mapping: May say it.
    """
    if mapping.longest_gap is not None:
        return mapping.longest_gap
    if len(t) < 3:
        return np.inf
    steps = np.diff(t)
    return max(USUAL_STEPS * float(np.median(steps)), SHORTEST_GAP)


def is_irregular(t: np.ndarray) -> bool:
    """Whether messages come when something changes, and not at a rate.

    Args:
        t: Their times, shape (n,) [s].
    """
    if len(t) < 10:
        return True
    steps = np.diff(t)
    return bool(np.percentile(steps, 95.0) > IRREGULAR * np.median(steps))


def gaps(column: MappedColumn, series: Series, mapping: LogMapping) -> list[Interruption]:
    """The times in which a column is not known.

    Args:
        column: The column.
        series: Its values.
        mapping: Says how long a gap is.
    """
    if len(series.t) == 0:
        return [Interruption(-np.inf, np.inf, f"{column.stream} has nothing for {column.name}")]
    found = [Interruption(-np.inf, float(series.t[0]), f"{column.stream} begins")]
    limit = longest_gap(series.t, mapping)
    if column.held and is_irregular(series.t):
        return found
    steps = np.diff(series.t)
    for k in np.flatnonzero(steps > limit):
        reason = f"gap of {steps[k]:.3g} s in {column.stream}"
        found.append(Interruption(float(series.t[k]), float(series.t[k + 1]), reason))
    end = float(series.t[-1]) + (limit if column.held else 0.0)
    return [*found, Interruption(end, np.inf, f"{column.stream} ends")]


def stops(episode: Episode, fields: Iterable[tuple[str, str]]) -> list[Interruption]:
    """The times in which the robot is stopped."""
    found = []
    for stream, name in fields:
        stored = episode.spool.streams[stream]
        begin, end = stored.part(episode.label)
        values = stored.values(name, begin, end)[episode.order[stream].rows]
        t = episode.times(stream)
        on = np.concatenate([[False], np.nan_to_num(values) != 0.0, [False]])
        edges = np.flatnonzero(np.diff(on.astype(int)))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            until = float(t[last]) if last < len(t) else np.inf
            found.append(Interruption(float(t[first]), until, f"stop ({stream} {name})"))
    return found


def at_rest(merged: MergedEpisode) -> np.ndarray:
    """Whether neither positions nor commands move around a row, shape (rows,)."""
    names = [name for name in merged.names if is_position(name) or is_command(name)]
    still = np.full(len(merged.t), bool(names))
    for name in names:
        still &= is_still(merged.t, merged.column(name), measured=not is_command(name))
    return still


def is_still(t: np.ndarray, values: np.ndarray, *, measured: bool) -> np.ndarray:
    """Whether a signal stays where it is around a row, shape (rows,).

    Args:
        t: Times of the rows, shape (rows,) [s].
        values: The signal, shape (rows,); rows where it is not known are still.
        measured: Whether it has noise; a command that trembles is one of a controller at work.
    """
    known = np.isfinite(values)
    if len(t) < 3 or not known.any():
        return np.ones(len(t), dtype=bool)
    window = max(3, round(REST / float(np.median(np.diff(t)))))
    filled = np.interp(t, t[known], values[known])
    moved = maximum_filter1d(filled, window) - minimum_filter1d(filled, window)
    return moved <= still_within(filled, measured=measured)


def still_within(values: np.ndarray, *, measured: bool) -> float:
    """By how much a signal may move at rest.

    Args:
        values: The signal, shape (rows,).
        measured: Whether it has noise.
    """
    noise = float(np.median(np.abs(np.diff(values, 2)))) / 0.6745 / np.sqrt(6.0) if len(values) > 2 else 0.0
    span = float(np.ptp(values))
    tolerance = max(STILL_SHARE * span, STILL_STEPS * resolution(values), STILL_NOISE * noise if measured else 0.0)
    return min(tolerance, STILL_MOST * span)


def resolution(values: np.ndarray) -> float:
    """The step of which all changes of a signal are multiples; 0 where there is none, as of floating-point numbers.

    Args:
        values: Finite, shape (n,).
    """
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * float(np.ptp(values))] if len(steps) else steps
    if not len(steps):
        return 0.0
    step = float(steps.min())
    multiples = steps / step
    whole = np.abs(multiples - np.rint(multiples)) < NEARLY_WHOLE * np.maximum(multiples, 1.0)
    return step if np.mean(whole) > MOSTLY and np.median(multiples) < MOST_STEPS else 0.0


def pauses(t: np.ndarray, still: np.ndarray, longest: float) -> list[Interruption]:
    """The times without motion that are longer than a recording keeps.

    Args:
        t: Times of the rows, shape (rows,) [s].
        still: Whether nothing moves around a row, shape (rows,).
        longest: Pause that cuts nothing yet [s].
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    found = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        begin, end = float(t[first]), float(t[last - 1])
        if end - begin <= longest:
            continue
        reason = f"pause of {end - begin:.3g} s"
        at_begin, at_end = first == 0, last == len(t)
        found.append(
            Interruption(-np.inf if at_begin else begin + KEPT_REST, np.inf if at_end else end - KEPT_REST, reason)
        )
    return found


def cut(t: np.ndarray, interruptions: Iterable[Interruption], whole: str) -> list[Stretch]:
    """The rows that are left, in stretches that no interruption divides.

    Args:
        t: Times of the rows, strictly increasing, shape (rows,) [s].
        interruptions: May overlap.
        whole: What begins and ends where nothing interrupts, e.g. "the log".
    """
    free = np.ones(len(t), dtype=bool)
    before: dict[int, str] = {}  # row: why a stretch ends in front of it
    after: dict[int, str] = {}  # row: why a stretch begins with it
    for one in interruptions:
        first = int(np.searchsorted(t, one.begin, side="right"))
        last = int(np.searchsorted(t, one.end, side="left"))
        if first >= last and not 0 < first < len(t):
            continue  # outside of the rows
        free[first:last] = False
        before.setdefault(first, one.reason)
        after.setdefault(last, one.reason)
    stretches = []
    boundaries = sorted({0, len(t), *before, *after, *(np.flatnonzero(np.diff(free.astype(int))) + 1).tolist()})
    for begin, end in pairwise(boundaries):
        if not free[begin]:
            continue
        begins = after.get(begin) or before.get(begin) or f"{whole} begins"
        ends = before.get(end) or after.get(end) or f"{whole} ends"
        stretches.append(Stretch(begin, end, begins, ends))
    return stretches
