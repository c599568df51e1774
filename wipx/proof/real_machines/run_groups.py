"""Disjoint groups of a rig's runs: runs are cut into pieces, and pieces are put together in one of several ways."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatch
from itertools import pairwise

from wipx.core.errors import InputError, check_positive
from wipx.core.recording import Recording
from wipx.recordings.source import RecordingSource

SHORTEST = 1.0  # [s] of a piece: a prediction of 0.5 s starts 0.5 s after the first row


@dataclass(frozen=True)
class ChosenRecordings(RecordingSource):
    """A source that hands out recordings which were read and cut before.

    Attributes:
        chosen: The recordings.
    """

    chosen: tuple[Recording, ...] = ()

    def load(self) -> tuple[Recording, ...]:
        """The chosen recordings."""
        return self.chosen


def choose(source: RecordingSource, recordings: tuple[Recording, ...]) -> ChosenRecordings:
    """These recordings of a source alone."""
    return ChosenRecordings(source.path, source.title, source.robot, origin=source.origin, chosen=recordings)


@dataclass(frozen=True)
class Way:
    """A way of dividing pieces of runs into groups; with no setting each piece is a group.

    Attributes:
        piece: Length of the consecutive spans into which runs are cut, about [s]; None for whole runs.
        blocks: Number of groups, each of pieces that follow each other; None for another rule.
        interleaved: Number of groups, of which each takes its turn; None for another rule.
        named: Patterns of the names of recordings by the name of the group; empty for another rule.
    """

    piece: float | None = None
    blocks: int | None = None
    interleaved: int | None = None
    named: dict[str, list[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.piece is not None:
            check_positive(piece=self.piece)
        for number in (self.blocks, self.interleaved):
            if number is not None and number < 2:
                raise InputError(f"task.rigs: {number} groups, expected 2 or more: one to diagnose, one to predict")
        if sum((self.blocks is not None, self.interleaved is not None, bool(self.named))) > 1:
            raise InputError("task.rigs: blocks, interleaved and named exclude each other; keep one of them")

    def groups(self, runs: Sequence[Recording]) -> dict[str, tuple[Recording, ...]]:
        """Groups of two or more recordings or parts of them, by a name that can be a folder's.

        Args:
            runs: All that is usable of a rig.

        Raises:
            InputError: fewer than two groups come of it, or a pattern matches nothing.
        """
        pieces = [part for run in runs for part in (consecutive(run, self.piece) if self.piece else (run,))]
        if self.named:
            groups = {name: _matching(pieces, patterns, name) for name, patterns in self.named.items()}
        else:
            groups = _numbered(pieces, self.blocks, self.interleaved)
        if len(groups) < 2:
            raise InputError(f"task.rigs: {len(groups)} group of {len(pieces)} pieces, expected 2 or more; cut shorter")
        return groups


def usable(source: RecordingSource, parts: dict[str, list[list[float]]]) -> tuple[Recording, ...]:
    """What is usable of a source.

    Args:
        source: The rig's recordings; its spans hold for files that are not in `parts`.
        parts: Intervals [from, to] in s by pattern of file names; several of one file become recordings of their own.

    Raises:
        InputError: a file is missing or at fault, or an interval holds less than a second.
    """
    spans = {pattern: span for pattern, span in source.spans.items() if pattern not in parts}
    recordings = []
    for recording in replace(source, spans=spans).load():
        chosen = [intervals for pattern, intervals in parts.items() if fnmatch(recording.name, pattern)]
        recordings += [_part(recording, *interval) for interval in chosen[0]] if chosen else [recording]
    return tuple(recordings)


def consecutive(run: Recording, length: float) -> tuple[Recording, ...]:
    """Equal spans of a run that follow each other, each about `length` [s] long."""
    count = max(1, round(run.duration / length))
    if count == 1:
        return (run,)
    first, share = float(run.t[0]), run.duration / count
    ends = [first + k * share for k in range(count)] + [float("inf")]
    return tuple(_part(run, begin, end) for begin, end in pairwise(ends))


def _part(run: Recording, begin: float, end: float) -> Recording:
    part = run.between(begin, end)
    if len(part) < 2 or part.duration < SHORTEST:
        raise InputError(f"{run.source}: [{begin:g}, {end:g}] s holds less than {SHORTEST:g} s; take a longer part")
    stem, _, suffix = run.name.partition("@")[0].rpartition(".")
    return replace(part, name=f"{stem}@{part.t[0]:.4g}-{part.t[-1]:.4g}s.{suffix}")


def _matching(pieces: Sequence[Recording], patterns: list[str], group: str) -> tuple[Recording, ...]:
    found = tuple(piece for piece in pieces if any(fnmatch(piece.name, pattern) for pattern in patterns))
    if not found:
        have = ", ".join(piece.name for piece in pieces)
        raise InputError(f"task.rigs: group {group}: {', '.join(patterns)} matches none of {have}; mend the pattern")
    return found


def _numbered(
    pieces: Sequence[Recording], blocks: int | None, interleaved: int | None
) -> dict[str, tuple[Recording, ...]]:
    count = blocks or interleaved or len(pieces)
    if count > len(pieces):
        raise InputError(f"task.rigs: {count} groups of {len(pieces)} pieces; ask for fewer groups")
    if interleaved:
        chosen = [tuple(pieces[first::count]) for first in range(count)]
    else:
        cuts = [round(k * len(pieces) / count) for k in range(count + 1)]
        chosen = [tuple(pieces[first:last]) for first, last in pairwise(cuts)]
    return {f"group{number:02d}": group for number, group in enumerate(chosen, start=1)}
