"""CAN logs as streams: every message of a DBC, or every motor of the MIT protocol.

The frames come from `can_files`, the meaning of their bytes from cantools; the DBC of a motor of the MIT protocol is
made by `wipx.hardware.mit_protocol`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from wipx.core.errors import InputError
from wipx.hardware.mit_protocol import ENTER, EXIT, SHORTEST_REPLY, ZERO, MitProtocol, Ranges
from wipx.importing.formats.can_files import SUFFIXES, frames
from wipx.importing.log_format import Chunk, LogFormat, Loss, Rows, Wanted, nanoseconds

MODES = {ENTER: 0.0, EXIT: 1.0}


@dataclass(frozen=True)
class MitMotor:
    """A motor of the MIT protocol on the bus.

    Attributes:
        id: CAN id of its commands, and its number in its replies.
        master_id: CAN id of its replies.
    """

    id: int
    master_id: int = 0


@dataclass(frozen=True)
class CanLog(LogFormat):
    """A .blf, .asc, .log or .trc file.

    Attributes:
        dbc: File that describes the messages; each is a stream of its name.
        motors: Motors of the MIT protocol by name: the streams NAME/command, NAME/reply and NAME/mode (`off` is 1 when
            the motor is switched off). Null for none.
        ranges: Of the motors' firmware.
    """

    dbc: str | None = None
    motors: dict[str, MitMotor] | None = None
    ranges: Ranges = field(default_factory=Ranges)

    def reads(self, path: Path) -> bool:
        """Whether it ends in .blf, .asc, .log or .trc."""
        return path.is_file() and path.suffix.lower() in SUFFIXES

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        bus = _Bus(path, self._meanings(), wanted)
        for item in frames(path):
            if isinstance(item, Loss):
                yield item
            else:
                frame, bus.rows.done = item
                yield from bus.decoded(frame)
        yield from bus.rest()
        bus.check_match(self.dbc or "log.format.motors")

    def _meanings(self) -> "dict[tuple[int, bool], list[_Meaning]]":
        """What decodes the frames of an id, by id and whether it is an extended one."""
        meanings: dict[tuple[int, bool], list[_Meaning]] = {}
        for message in () if self.dbc is None else _messages(Path(self.dbc)):
            key = message.frame_id, message.is_extended_frame
            meanings.setdefault(key, []).append(_DbcMessage(message))
        for name, motor in (self.motors or {}).items():
            protocol = MitProtocol(self.ranges, motor.id, motor.master_id)
            command, reply = _text_messages(protocol.dbc())
            meanings.setdefault((motor.id, False), []).append(_MitCommand(name, command))
            meanings.setdefault((motor.master_id, False), []).append(_MitReply(name, motor.id, reply))
        return meanings


class _Bus:
    """The frames of a log, decoded."""

    def __init__(self, path: Path, meanings: "Mapping[tuple[int, bool], list[_Meaning]]", wanted: Wanted) -> None:
        self.rows = Rows()
        self._path = path
        self._meanings = meanings
        self._wanted = wanted
        self._seen: set[int] = set()
        self._decoded: set[str] = set()
        self._failed: dict[str, int] = {}
        self._without_data = {"error frames (faults of the bus)": 0, "remote frames (requests without data)": 0}

    def decoded(self, frame: Any) -> Iterator[Chunk]:
        """The chunks that a frame completes."""
        if frame.is_error_frame or frame.is_remote_frame:
            error, remote = self._without_data
            self._without_data[error if frame.is_error_frame else remote] += 1
            return
        identifier, data = frame.arbitration_id, bytes(frame.data)
        stamp = int(nanoseconds(np.array(frame.timestamp)))
        self._seen.add(identifier)
        meant = [(one, one.decode(data)) for one in self._meanings.get((identifier, bool(frame.is_extended_id)), ())]
        for meaning, decoded in meant:
            if decoded is not None:
                yield from self._added(meaning, *decoded, stamp)
        if all(decoded is None for _, decoded in meant):
            yield from self.rows.add(f"0x{identifier:X}", (), (), receive=stamp, kind="frames without description")

    def rest(self) -> Iterator[Chunk | Loss]:
        """What has not filled a chunk, and what could not be decoded."""
        yield from self.rows.rest()
        for stream, count in self._failed.items():
            yield Loss(str(self._path), f"frames of {stream} do not have the form that the DBC says", count)
        for kind, count in self._without_data.items():
            if count:
                yield Loss(str(self._path), kind, count)

    def check_match(self, what: str) -> None:
        """Refuse a description of another bus or of another device.

        Args:
            what: File or setting that describes the messages.
        """
        described = {identifier for identifier, _ in self._meanings}
        if described and not described & self._seen:
            raise InputError(
                f"{what} does not match {self._path}: it describes the ids {_hexadecimal(described)}, "
                f"the log has {_hexadecimal(self._seen)}; give the description of this bus"
            )
        if self._failed and not self._decoded:
            raise InputError(
                f"{what} does not match {self._path}: no frame of {', '.join(sorted(self._failed))} has the form that "
                "it says (length, multiplexer); give the description of this device"
            )

    def _added(
        self, meaning: "_Meaning", stream: str, values: Mapping[str, float] | None, stamp: int
    ) -> Iterator[Chunk]:
        if values is None:
            self._failed[stream] = self._failed.get(stream, 0) + 1
            kind = "frames that do not fit their description"
            yield from self.rows.add(f"{stream} (not decoded)", (), (), receive=stamp, kind=kind)
            return
        self._decoded.add(stream)
        shown = values if self._wanted(stream) else {}
        names, numbers = tuple(shown), tuple(shown.values())
        yield from self.rows.add(stream, names, numbers, receive=stamp, kind="CAN message", units=meaning.units)


class _Meaning(Protocol):
    units: Mapping[str, str]

    def decode(self, data: bytes) -> tuple[str, dict[str, float] | None] | None:
        """Stream and numbers of a frame; no numbers where it has the wrong form; None where it is not meant."""
        ...


class _DbcMessage(_Meaning):
    def __init__(self, message: Any) -> None:
        self._message = message
        self.units = _units(message)

    def decode(self, data: bytes) -> tuple[str, dict[str, float] | None] | None:
        if len(data) < self._message.length:
            return self._message.name, None
        return self._message.name, _decoded(self._message, data, truncated=False)


class _MitCommand(_Meaning):
    def __init__(self, name: str, message: Any) -> None:
        self._name = name
        self._message = message
        self.units = _units(message)

    def decode(self, data: bytes) -> tuple[str, dict[str, float] | None] | None:
        if data in MODES:
            return f"{self._name}/mode", {"off": MODES[data]}
        if data == ZERO:
            return None
        complete = len(data) == self._message.length
        values = _decoded(self._message, data, truncated=False) if complete else None
        return f"{self._name}/command", values


class _MitReply(_Meaning):
    def __init__(self, name: str, number: int, message: Any) -> None:
        self._name = name
        self._number = number
        self._message = message
        self.units = _units(message)

    def decode(self, data: bytes) -> tuple[str, dict[str, float] | None] | None:
        if not data or data[0] != self._number:
            return None
        if len(data) < SHORTEST_REPLY:
            return f"{self._name}/reply", None
        return f"{self._name}/reply", _decoded(self._message, data, truncated=True)


def _decoded(message: Any, data: bytes, *, truncated: bool) -> dict[str, float] | None:
    from cantools.database import DecodeError

    try:
        values = message.decode(data, decode_choices=False, allow_truncated=truncated, decode_containers=False)
    except (DecodeError, ValueError, KeyError, NotImplementedError):
        return None
    return {name: float(value) for name, value in values.items() if isinstance(value, int | float)}


def _messages(path: Path) -> list[Any]:
    import cantools

    try:
        database = cantools.database.load_file(str(path), strict=False)
    except OSError as error:
        raise InputError(f"log.format.dbc {path}: cannot be read ({error.strerror}); check the path") from error
    except Exception as error:  # every parser of cantools has errors of its own
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"log.format.dbc {path}: not a DBC file ({reason}); check the file") from error
    return list(getattr(database, "messages", ()))


def _text_messages(text: str) -> tuple[Any, Any]:
    import cantools

    database = cantools.database.load_string(text, "dbc")
    messages = {message.name: message for message in getattr(database, "messages", ())}
    return messages["MIT_COMMAND"], messages["MIT_REPLY"]


def _units(message: Any) -> dict[str, str]:
    return {signal.name: signal.unit for signal in message.signals if signal.unit}


def _hexadecimal(identifiers: object) -> str:
    listed = sorted(identifiers)  # pyright: ignore[reportArgumentType]
    more = f" and {len(listed) - 8} more" if len(listed) > 8 else ""
    return ", ".join(f"0x{number:X}" for number in listed[:8]) + more
