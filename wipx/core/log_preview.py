"""What a log holds and which recordings it would give: the result of `task=import`."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class StampDifference:
    """Receive stamps against header stamps of one stream.

    Attributes:
        median: Of receive minus header [s].
        low: 5 % of the messages are below it [s].
        high: 5 % of the messages are above it [s].
        drift: By which the receive clock runs faster [s/s].
    """

    median: float
    low: float
    high: float
    drift: float


@dataclass(frozen=True)
class StreamSummary:
    """One stream of a log.

    Attributes:
        name: Name of the stream.
        kind: Type of its messages.
        rows: Number of messages.
        fields: Fields that its messages have; empty where it was not decoded.
        clock: Which stamps count, "header" or "receive"; "" where the stream is not used.
        rate: Messages per second, from the median step [Hz]; NaN where it is not known.
        jitter: Standard deviation of the steps, gaps aside [s].
        gaps: Steps that are longer than a gap may be.
        longest_step: [s].
        duplicates: Messages with the stamp of another one; only the first counts.
        out_of_order: Messages that came after a later one.
        unstamped: Messages without the stamp that counts; they are left out.
        difference: Receive against header stamps; None where there is one of them only.
    """

    name: str
    kind: str
    rows: int
    fields: tuple[str, ...] = ()
    clock: str = ""
    rate: float = float("nan")
    jitter: float = float("nan")
    gaps: int = 0
    longest_step: float = float("nan")
    duplicates: int = 0
    out_of_order: int = 0
    unstamped: int = 0
    difference: StampDifference | None = None


@dataclass(frozen=True)
class ColumnSummary:
    """One column of the recordings, as the log has it.

    Attributes:
        name: Of the column.
        stream: Of the log.
        field: Of the stream.
        unit: SI unit; "" where neither mapping nor log says it.
        held: Whether the value lasts until the next message.
        samples: Values that there are.
        missing: Messages without a finite value.
        low: Smallest value [SI].
        high: Largest value [SI].
        resolution: Step of which all changes are multiples [SI]; 0 where there is none.
        at_low: Share of the values at the smallest, if the signal stays there again and again, else 0.
        at_high: Share of the values at the largest, likewise.
        frozen: Longest time in which the value is constant while its command, rate or position changes [s].
        frozen_at: Beginning of it, since the log's beginning [s].
    """

    name: str
    stream: str
    field: str
    unit: str
    held: bool
    samples: int
    missing: int
    low: float
    high: float
    resolution: float
    at_low: float
    at_high: float
    frozen: float
    frozen_at: float


@dataclass(frozen=True)
class ShiftEstimate:
    """By how much a measurement comes after its command; the recordings keep it.

    Attributes:
        command: Column of the command.
        measurement: Column that it was compared with.
        how: What of the measurement follows the command, e.g. "acceleration".
        shift: Positive where the measurement comes later [s].
        correlation: At that shift, between 0 and 1.
    """

    command: str
    measurement: str
    how: str
    shift: float
    correlation: float


@dataclass(frozen=True)
class Piece:
    """A stretch of the log that becomes a recording, or that is too short for one.

    Attributes:
        name: Of the recording; "" where it is left out.
        episode: Label of the part of the log; "" where it has no parts.
        begin: Since the beginning of the episode [s].
        end: Likewise [s].
        rows: Number of rows.
        begins: Why it begins there.
        ends: Why it ends there.
        moving: Share of its time in which something moves.
    """

    name: str
    episode: str
    begin: float
    end: float
    rows: int
    begins: str
    ends: str
    moving: float


@dataclass(frozen=True)
class Motion:
    """A time in which positions or commands change.

    Attributes:
        episode: Label of the part of the log; "" where it has no parts.
        begin: Since the beginning of the episode [s].
        end: Likewise [s].
    """

    episode: str
    begin: float
    end: float


@dataclass(frozen=True)
class Trace:
    """A column over time, thinned out for a picture.

    Attributes:
        t: Since the log's beginning, episodes one after the other, shape (points,) [s].
        low: Smallest value around each time, shape (points,) [SI].
        high: Largest value around each time, shape (points,) [SI].
    """

    t: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class LogPreview:
    """A log, and what becomes of it.

    Attributes:
        source: File or folder.
        streams: All streams of the log.
        columns: Columns of the recordings, positions first as mapped.
        pieces: Stretches of the log, in order.
        motion: When something moves, in order.
        shifts: Estimated shifts between commands and measurements.
        losses: What could not be read, one line each.
        notes: What else one should know, one line each.
        rows_from: Stream whose messages are the rows.
        traces: For the picture, by column.
        offsets: Beginning of each episode in the picture, by label [s].
    """

    source: str
    streams: tuple[StreamSummary, ...]
    columns: tuple[ColumnSummary, ...] = ()
    pieces: tuple[Piece, ...] = ()
    motion: tuple[Motion, ...] = ()
    shifts: tuple[ShiftEstimate, ...] = ()
    losses: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    rows_from: str = ""
    traces: Mapping[str, Trace] = field(default_factory=dict)
    offsets: Mapping[str, float] = field(default_factory=dict)

    @property
    def recordings(self) -> tuple[Piece, ...]:
        """The pieces that become recordings."""
        return tuple(piece for piece in self.pieces if piece.name)
