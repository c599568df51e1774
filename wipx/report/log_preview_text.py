"""What a log holds and what becomes of it, as plain text for a terminal."""

from math import isfinite

from wipx.core.log_preview import ColumnSummary, LogPreview, Piece, ShiftEstimate, StreamSummary
from wipx.report.numbers import MISSING, significant
from wipx.report.tables import aligned

LONG_FREEZE = 0.5  # [s]
MOST_FIELDS = 12
MOST_PIECES = 40
MOST_SPANS = 8
STREAM_HEAD = ("stream", "messages", "rate [Hz]", "jitter [ms]", "longest step [s]", "gaps", "stamps", "type")
COLUMN_HEAD = ("column", "unit", "from", "lowest", "highest", "resolution", "remarks")
PIECE_HEAD = ("recording", "from [s]", "to [s]", "rows", "moving", "begins after", "ends with")


def preview_text(preview: LogPreview) -> str:
    """All of it, tables first, then what one should know."""
    streams = sorted(preview.streams, key=lambda stream: not stream.clock)
    lines = [preview.source, "", *aligned(STREAM_HEAD, [_stream(one) for one in streams], numbers=(1, 2, 3, 4, 5))]
    if not preview.columns:
        lines += ["", *(f"{one.name}: {_fields(one)}" for one in streams if one.fields)]
    else:
        lines += ["", *aligned(COLUMN_HEAD, [_column(one) for one in preview.columns], numbers=(3, 4, 5))]
        lines += ["", f"Rows are the messages of {preview.rows_from}.", *_pieces(preview.pieces)]
        lines += ["", _motion(preview)]
    remarks = [*map(_difference, streams), *map(_disorder, streams), *map(shift_sentence, preview.shifts)]
    remarks += [f"lost: {loss}" for loss in preview.losses] + [f"note: {note}" for note in preview.notes]
    return "\n".join([*lines, "", *filter(None, remarks)]).rstrip()


def shift_sentence(shift: ShiftEstimate) -> str:
    """An estimated shift in words."""
    return (
        f"shift: {shift.measurement} follows {shift.command} by {1e3 * shift.shift:.1f} ms (by its {shift.how}, "
        f"correlation {shift.correlation:.2f}); the recordings keep it"
    )


def column_remarks(column: ColumnSummary) -> list[str]:
    """What is odd about a column."""
    remarks = []
    if column.at_low:
        remarks.append(f"at its lowest in {column.at_low:.1%} of the values: saturated?")
    if column.at_high:
        remarks.append(f"at its highest in {column.at_high:.1%} of the values: saturated?")
    if column.samples and column.low == column.high:
        remarks.append("never changes")
    elif column.frozen > LONG_FREEZE:
        remarks.append(
            f"frozen for {column.frozen:.2g} s from {column.frozen_at:.4g} s on, while its command or motion changes"
        )
    if column.missing:
        remarks.append(f"{column.missing} messages without a value")
    return remarks


def _stream(stream: StreamSummary) -> tuple[str, ...]:
    return (
        stream.name,
        str(stream.rows),
        significant(stream.rate),
        significant(1e3 * stream.jitter),
        significant(stream.longest_step),
        str(stream.gaps) if stream.clock else MISSING,
        stream.clock or "not used",
        stream.kind or MISSING,
    )


def _fields(stream: StreamSummary) -> str:
    more = f" and {len(stream.fields) - MOST_FIELDS} more" if len(stream.fields) > MOST_FIELDS else ""
    return ", ".join(stream.fields[:MOST_FIELDS]) + more


def _column(column: ColumnSummary) -> tuple[str, ...]:
    return (
        column.name,
        column.unit or "as logged",
        f"{column.stream} {column.field}",
        significant(column.low),
        significant(column.high),
        significant(column.resolution) if column.resolution else MISSING,
        "; ".join([*(("held",) if column.held else ()), *column_remarks(column)]),
    )


def _pieces(pieces: tuple[Piece, ...]) -> list[str]:
    shown = [piece for piece in pieces if piece.name]
    rows = [
        (p.name, f"{p.begin:.3f}", f"{p.end:.3f}", str(p.rows), f"{p.moving:.0%}", p.begins, p.ends)
        for p in shown[:MOST_PIECES]
    ]
    lines = aligned(PIECE_HEAD, rows, numbers=(1, 2, 3, 4)) if rows else ["No part of the log makes a recording."]
    if len(shown) > MOST_PIECES:
        lines.append(f"and {len(shown) - MOST_PIECES} more")
    short = [piece for piece in pieces if not piece.name]
    if short:
        seconds = sum(piece.end - piece.begin for piece in short)
        lines.append(f"{len(short)} pieces are too short for a recording, {seconds:.2f} s together (log.shortest).")
    return lines


def _motion(preview: LogPreview) -> str:
    spans = [f"{f'{one.episode}: ' if one.episode else ''}{one.begin:.2f} to {one.end:.2f}" for one in preview.motion]
    if not spans:
        return "motion: none"
    more = f" and {len(spans) - MOST_SPANS} more" if len(spans) > MOST_SPANS else ""
    seconds = sum(one.end - one.begin for one in preview.motion)
    return f"motion: {seconds:.2f} s in all: {', '.join(spans[:MOST_SPANS])} s{more}"


def _difference(stream: StreamSummary) -> str:
    one = stream.difference
    if one is None or not stream.clock:
        return ""
    return (
        f"stamps: {stream.name} is received {_milliseconds(one.median)} after its header stamp (5 to 95 %: "
        f"{_milliseconds(one.low)} to {_milliseconds(one.high)}), drift {1e6 * one.drift:.1f} ppm; "
        f"{stream.clock} stamps count"
    )


def _disorder(stream: StreamSummary) -> str:
    counts = {
        "with the stamp of another one": stream.duplicates,
        "without a stamp": stream.unstamped,
    }
    said = [f"{count} messages {what} are left out" for what, count in counts.items() if count]
    if stream.out_of_order:
        said.append(f"{stream.out_of_order} messages came after a later one and are put in order")
    return f"order: {stream.name}: {'; '.join(said)}" if said else ""


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.4g} ms" if isfinite(seconds) else MISSING
