"""From a log to recordings: read, put on one clock, merge, cut, check. Nothing is written but to a working folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.errors import InputError
from wipx.core.log_preview import ColumnSummary, LogPreview, Motion, Piece, ShiftEstimate, Trace
from wipx.importing.checks import column_summary, longest_constant, trace, unused_stream, used_stream
from wipx.importing.clock import Clock, check_not_set_back, choose_clock, set_back
from wipx.importing.cutting import Interruption, Stretch, at_rest, cut, gaps, is_still, pauses, stops
from wipx.importing.log_format import Chunk, Loss
from wipx.importing.mapping import LogMapping, MappedColumn, is_command, mapped_columns, mapped_stops, witnesses
from wipx.importing.merge import Episode, MergedEpisode, episode
from wipx.importing.shifts import estimate_shifts
from wipx.importing.spool import Spool, StoredStream

BETWEEN_EPISODES = 1.0  # [s] in the picture
Watcher = Callable[[str, float], None]


@dataclass(frozen=True)
class CutEpisode:
    """An episode on its rows, and its stretches.

    Attributes:
        part: Its messages.
        merged: Its columns.
        stretches: Those long enough for a recording, and the others.
        still: Whether nothing moves around a row, shape (rows,).
    """

    part: Episode
    merged: MergedEpisode
    stretches: tuple[Stretch, ...]
    still: np.ndarray


@dataclass(frozen=True)
class ImportedRecording:
    """A recording that the log gives.

    Attributes:
        piece: Where it is in the log.
        merged: The columns of its episode.
        first: Its first row.
        last: The row behind its last.
    """

    piece: Piece
    merged: MergedEpisode
    first: int
    last: int


@dataclass(frozen=True)
class ImportedLog:
    """What a log gives.

    Attributes:
        preview: For people.
        recordings: Still in the working folder.
    """

    preview: LogPreview
    recordings: tuple[ImportedRecording, ...] = ()


def import_log(mapping: LogMapping, folder: Path, watcher: Watcher) -> ImportedLog:
    """Read a log and cut it into recordings.

    Args:
        mapping: The log, and what becomes of it.
        folder: Takes what is read; it exists, is empty, and is needed as long as the recordings are.
        watcher: Is told what is done, and which share of it.

    Raises:
        InputError: the log or the mapping is at fault.
    """
    path = _path(mapping)
    spool, losses = _read(mapping, path, folder, watcher)
    if not mapping.columns:
        streams = tuple(unused_stream(stream) for stream in spool.streams.values())
        return ImportedLog(LogPreview(str(path), streams, losses=losses))
    columns = mapped_columns(mapping, spool)
    events = mapped_stops(mapping, spool)
    used = [spool.streams[name] for name in dict.fromkeys([*(c.stream for c in columns), *(s for s, _ in events)])]
    clock = choose_clock(used, mapping.clock)
    _divide_where_set_back(used, clock)
    rows_from = _rows_from(mapping, columns)
    labels = [label for label in spool.episodes() if any(s.part(label)[1] for s in used)]
    parts = []
    for number, label in enumerate(labels):
        watcher("merging", number / len(labels))
        place = folder / f"merged_{number}"
        place.mkdir()
        parts.append(_cut_episode(episode(label, spool, clock), columns, rows_from, events, mapping, place))
    return _imported(str(path), spool, mapping, columns, clock, parts, losses, rows_from.stream, watcher)


def _path(mapping: LogMapping) -> Path:
    if mapping.path is None:
        raise InputError("log.path is needed: the log's file or folder; give log.path=FILE")
    path = Path(mapping.path).expanduser()
    if not path.exists():
        raise InputError(f"log.path {path} does not exist; check the path")
    return path


def _read(mapping: LogMapping, path: Path, folder: Path, watcher: Watcher) -> tuple[Spool, tuple[str, ...]]:
    place = folder / "log"
    place.mkdir()
    spool = Spool(place, mapping.keeps)
    losses: list[Loss] = []
    for item in mapping.format.read(path, mapping.wants):
        if isinstance(item, Chunk):
            spool.add(item)
            watcher("reading", item.done)
        else:
            losses.append(item)
    if not spool.streams:
        reason = f" ({losses[0]})" if losses else ""
        raise InputError(f"{path}: there is no message in the log{reason}; check the file")
    return spool, tuple(map(str, losses))


def _divide_where_set_back(used: list[StoredStream], clock: Clock) -> None:
    """Let a table whose time begins anew be several episodes; of several streams nobody knows where the others are."""
    for stream in used:
        for label, _ in list(stream.episodes):
            begin, end = stream.part(label)
            stamps = clock.stamps(stream, begin, end)
            if len(used) > 1:
                check_not_set_back(stamps, stream.name, clock.of[stream.name])
            else:
                stream.divide([begin + int(row) for row in set_back(stamps)])


def _rows_from(mapping: LogMapping, columns: tuple[MappedColumn, ...]) -> MappedColumn:
    """The column whose messages become the rows."""
    if not columns:
        raise InputError("log.columns: none of the columns is in the log; name at least one that is")
    if mapping.rows is None:
        return columns[0]
    chosen = next((column for column in columns if column.stream == mapping.rows), None)
    if chosen is None:
        have = ", ".join(dict.fromkeys(column.stream for column in columns))
        raise InputError(f"log.rows: no column comes from stream {mapping.rows}; columns come from {have}")
    return chosen


def _cut_episode(
    part: Episode,
    columns: tuple[MappedColumn, ...],
    rows_from: MappedColumn,
    events: tuple[tuple[str, str], ...],
    mapping: LogMapping,
    folder: Path,
) -> CutEpisode:
    merged = MergedEpisode(part.series(rows_from).t, folder)
    interruptions: dict[tuple[str, float, float], Interruption] = {}
    for column in columns:
        series = part.series(column)
        if column.source.optional and len(series.t) == 0:
            continue
        merged.add(column.name, series, held=column.held)
        for one in gaps(column, series, mapping):
            interruptions.setdefault((one.reason, one.begin, one.end), one)
    still = at_rest(merged)
    # The first of several reasons is told.
    found = [*stops(part, events), *interruptions.values(), *pauses(merged.t, still, mapping.longest_pause)]
    whole = f"episode {part.label}" if part.label else "the log"
    return CutEpisode(part, merged, tuple(cut(merged.t, found, whole)), still)


def _imported(
    source: str,
    spool: Spool,
    mapping: LogMapping,
    columns: tuple[MappedColumn, ...],
    clock: Clock,
    parts: list[CutEpisode],
    losses: tuple[str, ...],
    rows_from: str,
    watcher: Watcher,
) -> ImportedLog:
    recordings, pieces = _recordings(parts, mapping.shortest)
    episodes = [one.part for one in parts]
    streams = tuple(
        used_stream(stream, clock, episodes, mapping) if name in clock.of else unused_stream(stream)
        for name, stream in spool.streams.items()
    )
    offsets = _offsets(parts)
    summaries, traces = [], {}
    for number, column in enumerate(columns):
        watcher("checking", number / len(columns))
        summaries.append(_summary(column, parts))
        traces[column.name] = _trace(column.name, parts, offsets)
    preview = LogPreview(
        source=source,
        streams=streams,
        columns=tuple(summaries),
        pieces=pieces,
        shifts=_shifts(recordings),
        losses=losses,
        notes=(clock.note,) if clock.note else (),
        rows_from=rows_from,
        motion=_motion(parts),
        traces=traces,
        offsets=offsets,
    )
    return ImportedLog(preview, recordings)


def _recordings(parts: list[CutEpisode], shortest: float) -> tuple[tuple[ImportedRecording, ...], tuple[Piece, ...]]:
    """The recordings of all episodes, numbered, and all pieces, the short ones without a name."""
    total = sum(len(one.stretches) for one in parts)
    digits = max(2, len(str(total)))
    recordings: list[ImportedRecording] = []
    pieces = []
    for one in parts:
        t = one.merged.t
        for stretch in one.stretches:
            begin, end = float(t[stretch.first]), float(t[stretch.last - 1])
            named = f"r{len(recordings) + 1:0{digits}d}" if end - begin >= shortest else ""
            moving = 1.0 - float(np.mean(one.still[stretch.first : stretch.last]))
            rows = stretch.last - stretch.first
            piece = Piece(named, one.part.label, begin, end, rows, stretch.begins, stretch.ends, moving)
            pieces.append(piece)
            if named:
                recordings.append(ImportedRecording(piece, one.merged, stretch.first, stretch.last))
    return tuple(recordings), tuple(pieces)


def _summary(column: MappedColumn, parts: list[CutEpisode]) -> ColumnSummary:
    values, missing, frozen = [], 0, (0.0, 0.0)
    for one in parts:
        series = one.part.series(column)
        values.append(series.values)
        missing += series.missing
        if not column.held and column.name in one.merged.names:
            merged = one.merged
            constant = longest_constant(merged.t, merged.column(column.name), _should_move(column.name, merged))
            frozen = max(frozen, constant)
    return column_summary(column, np.concatenate(values) if values else np.zeros(0), missing, frozen)


def _should_move(name: str, merged: MergedEpisode) -> np.ndarray:
    """Whether a measurement should change around a row, since its command or its sister does, shape (rows,)."""
    moving = np.zeros(len(merged.t), dtype=bool)
    for witness in witnesses(name):
        if witness in merged.names:
            moving |= ~is_still(merged.t, merged.column(witness), measured=not is_command(witness))
    return moving


def _offsets(parts: list[CutEpisode]) -> dict[str, float]:
    offsets, end = {}, 0.0
    for one in parts:
        offsets[one.part.label] = end
        end += float(one.merged.t[-1]) + BETWEEN_EPISODES if len(one.merged.t) else 0.0
    return offsets


def _trace(name: str, parts: list[CutEpisode], offsets: dict[str, float]) -> Trace:
    shown = [one for one in parts if name in one.merged.names]
    if not shown:
        return Trace(np.zeros(0), np.zeros(0), np.zeros(0))
    t = np.concatenate([one.merged.t + offsets[one.part.label] for one in shown])
    return trace(t, np.concatenate([one.merged.column(name) for one in shown]))


def _motion(parts: list[CutEpisode]) -> tuple[Motion, ...]:
    """The times in which something moves."""
    found = []
    for one in parts:
        t = one.merged.t
        edges = np.flatnonzero(np.diff(np.concatenate([[False], ~one.still, [False]]).astype(int)))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            found.append(Motion(one.part.label, float(t[first]), float(t[last - 1])))
    return tuple(found)


def _shifts(recordings: tuple[ImportedRecording, ...]) -> tuple[ShiftEstimate, ...]:
    """From the recording with the most motion."""
    if not recordings:
        return ()
    best = max(recordings, key=lambda one: one.piece.moving * (one.piece.end - one.piece.begin))
    t = best.merged.t[best.first : best.last]
    return estimate_shifts(best.merged.names, t, lambda name: best.merged.column(name, best.first, best.last))
