"""The mapping: which fields of a log become which columns of a recording (contract sections 1 and 6).

One mapping serves all formats. A `*` stands for any text in the stream or the field, and for the same text in the
column: `"*_dot": {stream: /joint_states, field: velocity.*}` gives a column for every joint.
"""

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from wipx.core.errors import InputError, unknown_name
from wipx.importing.log_format import LogFormat
from wipx.importing.spool import Spool, StoredStream
from wipx.recordings.units import UNITS, factor_to_si

COMMAND = re.compile(r"u(\d+|_.+)?$")
REFERENCE = re.compile(r".+_ref$")
# How DBC files and sensors write what has another name in `UNITS`.
UNIT_ALIASES = {
    "Nm": "N m",
    "N.m": "N m",
    "N*m": "N m",
    "°": "deg",
    "°/s": "deg/s",
    "degree": "deg",
    "RPM": "rpm",
    "-": "1",
}


@dataclass(frozen=True)
class Source:
    """A field of a stream, or the first that the log has of several.

    Attributes:
        stream: Name of the stream, or several; may hold a `*`.
        field: Path of the field, or several; may hold a `*`.
        where: Rows of the stream that count: value by field.
        optional: Whether a log may lack it.
    """

    stream: str | list[str]
    field: str | list[str]
    where: dict[str, float] = dataclasses.field(default_factory=dict)
    optional: bool = False

    @property
    def patterns(self) -> list[tuple[str, str]]:
        """Stream and field, in the order of preference."""
        streams = [self.stream] if isinstance(self.stream, str) else self.stream
        fields = [self.field] if isinstance(self.field, str) else self.field
        return [(stream, name) for stream in streams for name in fields]

    def needs(self, stream: str, name: str) -> bool:
        """Whether a field of a stream may be a part of it."""
        return any(
            _matches(pattern, stream) is not None and (_matches(part, name) is not None or name in self.where)
            for pattern, part in self.patterns
        )


@dataclass(frozen=True)
class ColumnSource(Source):
    """Where a column comes from: value = scale * (field in SI) + offset.

    Attributes:
        unit: Unit of the log; null for what the log itself says, or SI where it says nothing.
        scale: Factor beside the unit's; a negative one turns the direction round.
        offset: Added last [SI].
        wraps: Range after which the logged value begins anew, e.g. 360 for an angle in degrees [unit of the log].
        between: What the value is between two messages: "held" or "linear"; null: commands and references are held.
    """

    unit: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    wraps: float | None = None
    between: Literal["held", "linear"] | None = None

    def __post_init__(self) -> None:
        if self.unit is not None and self.unit not in UNITS:
            raise unknown_name("unit", self.unit, UNITS, "log.columns")
        if self.scale == 0.0:
            raise InputError("log.columns: scale is 0, which erases the column; give a factor")
        if self.wraps is not None and self.wraps <= 0.0:
            raise InputError(f"log.columns: wraps is {self.wraps:g}, expected the range of the value, e.g. 360")


@dataclass(frozen=True)
class LogMapping:
    """A log and what becomes of it.

    Attributes:
        path: File or folder.
        format: Of the log, with its settings.
        columns: Where the columns of the recordings come from, by column.
        rename: Names of joints in the recordings, by their name in the log (what `*` stands for).
        clock: Stamps that count: "header" of the sender, "receive" of the logger; "auto": header where all streams can
            have it on one clock.
        rows: Stream whose messages become the rows; null: that of the first column.
        stops: Fields that are not zero while the robot is stopped (e-stop, motor error, motor off).
        longest_gap: Between two messages of a stream; a longer one ends a recording [s]; null: ten usual ones, at least
            0.1 s.
        longest_pause: Without motion; a longer one ends a recording [s].
        shortest: Recordings that are shorter are left out [s].
    """

    format: LogFormat
    path: str | None = None
    columns: dict[str, ColumnSource] = dataclasses.field(default_factory=dict)
    rename: dict[str, str] = dataclasses.field(default_factory=dict)
    clock: Literal["auto", "header", "receive"] = "auto"
    rows: str | None = None
    stops: list[Source] = dataclasses.field(default_factory=list)
    longest_gap: float | None = None
    longest_pause: float = 2.0
    shortest: float = 1.0

    def __post_init__(self) -> None:
        for name in ("longest_gap", "longest_pause", "shortest"):
            value = vars(self)[name]
            if value is not None and not value > 0.0:
                raise InputError(f"log.{name} is {value:g}, expected seconds above 0")

    @property
    def sources(self) -> list[Source]:
        """Everything that is read of the log."""
        return [*self.columns.values(), *self.stops]

    def wants(self, stream: str) -> bool:
        """Whether a stream is decoded; all are where nothing is mapped, since one wants to see what there is."""
        patterns = [pattern for source in self.sources for pattern, _ in source.patterns]
        return not patterns or any(_matches(pattern, stream) is not None for pattern in patterns)

    def keeps(self, stream: str, name: str) -> bool:
        """Whether a field is kept."""
        return any(source.needs(stream, name) for source in self.sources)


@dataclass(frozen=True)
class MappedColumn:
    """A column of the recordings and the one field that it comes from.

    Attributes:
        name: Of the column.
        stream: Of the log.
        field: Of the stream.
        source: The entry of the mapping.
        unit: Of the log; "" where neither the mapping nor the log has one: SI.
    """

    name: str
    stream: str
    field: str
    source: ColumnSource
    unit: str

    @property
    def si_unit(self) -> str:
        """Unit of the column; "" where it is not known."""
        return UNITS[self.unit].si if self.unit else ""

    @property
    def factor(self) -> float:
        """SI units per logged unit."""
        return factor_to_si(self.unit) if self.unit else 1.0

    @property
    def held(self) -> bool:
        """Whether the value lasts until the next message."""
        if self.source.between is not None:
            return self.source.between == "held"
        return is_command(self.name) or bool(REFERENCE.fullmatch(self.name))


def is_command(column: str) -> bool:
    """Whether a column is a command: u, u1, u_JOINT."""
    return bool(COMMAND.fullmatch(column)) and not column.endswith("_measured")


def is_position(column: str) -> bool:
    """Whether a column is a position: none of the others."""
    return not column.endswith(("_dot", "_measured", "_ref")) and not is_command(column)


def witnesses(column: str) -> tuple[str, ...]:
    """Columns that may show that a measurement should change: its command, its rate, its position."""
    if column.endswith("_measured"):
        return (column.removesuffix("_measured"),)
    position = column.removesuffix("_dot")
    command = f"u{position[5:]}" if position.startswith("theta") else "u"
    others = (position, f"{position}_dot", f"u_{position}", command)
    return tuple(other for other in others if other != column)


def mapped_columns(mapping: LogMapping, spool: Spool) -> tuple[MappedColumn, ...]:
    """The columns that the mapping finds in a log, in its order.

    Raises:
        InputError: a stream or field does not exist, a column comes from two fields, or a unit is not known.
    """
    columns: dict[str, MappedColumn] = {}
    for name, source in mapping.columns.items():
        for column in _found(name, source, mapping.rename, spool.streams):
            other = columns.get(column.name)
            if other is not None:
                raise InputError(
                    f"log.columns: {column.name} comes from {other.stream} {other.field} and from "
                    f"{column.stream} {column.field}; keep one, or rename one with log.rename"
                )
            columns[column.name] = column
    _check_renamed(mapping, spool)
    return tuple(columns.values())


def mapped_stops(mapping: LogMapping, spool: Spool) -> tuple[tuple[str, str], ...]:
    """Stream and field of every stop that the log has.

    Raises:
        InputError: one that is not optional does not exist.
    """
    return tuple((s, f) for source in mapping.stops for s, f, _ in _matching(source, spool.streams, "log.stops"))


def _found(
    name: str, source: ColumnSource, rename: Mapping[str, str], streams: Mapping[str, StoredStream]
) -> list[MappedColumn]:
    where = f"log.columns.{name}"
    found = []
    for stream, part, text in _matching(source, streams, where):
        if text is None and "*" in name:
            raise InputError(f"{where}: neither stream nor field has a *; write one, or name the column in full")
        if text is not None and "*" not in name:
            raise InputError(f"{where}: stream or field has a *, so the column needs one; write e.g. '*' or 'u_*'")
        column = name if text is None else name.replace("*", rename.get(text, text))
        found.append(MappedColumn(column, stream, part, source, _unit(source, streams[stream], part, where)))
    return found


def _matching(source: Source, streams: Mapping[str, StoredStream], where: str) -> list[tuple[str, str, str | None]]:
    """Stream, field and the text of `*` of all that the first matching pattern finds."""
    for pattern, part in source.patterns:
        found = []
        for stream in streams.values():
            of_stream = _matches(pattern, stream.name)
            if of_stream is None:
                continue
            for name in stream.fields:
                of_field = _matches(part, name)
                if of_field is None or (of_stream and of_field and of_stream != of_field):
                    continue
                found.append((stream.name, name, of_stream or of_field or None))
        if found:
            return found
    if source.optional:
        return []
    raise _nothing_found(source, streams, where)


def _nothing_found(source: Source, streams: Mapping[str, StoredStream], where: str) -> InputError:
    patterns = dict.fromkeys(pattern for pattern, _ in source.patterns)
    present = [s for s in streams.values() if any(_matches(pattern, s.name) is not None for pattern in patterns)]
    if not present:
        listed = ", ".join(f"{s.name} ({s.kind})" if s.kind else s.name for s in streams.values()) or "none"
        return InputError(f"{where}: no stream {' or '.join(patterns)} in the log; it has: {listed}")
    fields = dict.fromkeys(part for _, part in source.patterns)
    listed = list(present[0].fields)
    more = f" and {len(listed) - 30} more" if len(listed) > 30 else ""
    shown = ", ".join(listed[:30]) or "none"
    return InputError(f"{where}: no field {' or '.join(fields)} in {present[0].name}; it has: {shown}{more}")


def _unit(source: ColumnSource, stream: StoredStream, part: str, where: str) -> str:
    if source.unit is not None:
        return source.unit
    said = stream.units.get(part, "")
    unit = UNIT_ALIASES.get(said, said)
    if unit and unit not in UNITS:
        raise InputError(
            f"{where}: the log has {stream.name} {part} in {said}, which is not known; give unit and scale"
        )
    return unit


def _check_renamed(mapping: LogMapping, spool: Spool) -> None:
    """Refuse a name that stands for nothing."""
    texts = {
        text
        for name, source in mapping.columns.items()
        for _, _, text in _matching(source, spool.streams, name)
        if text is not None
    }
    for name in mapping.rename:
        if texts and name not in texts and not name.isdigit():
            raise unknown_name("name", name, texts, "log.rename")


def _matches(pattern: str, name: str) -> str | None:
    """What `*` stands for, "" where the pattern has none; None where it does not match."""
    if "*" not in pattern:
        return "" if pattern == name else None
    before, _, after = pattern.partition("*")
    inside = len(name) > len(before) + len(after)
    return name[len(before) : len(name) - len(after)] if inside and _around(name, before, after) else None


def _around(name: str, before: str, after: str) -> bool:
    return name.startswith(before) and name.endswith(after)
