"""Decoding of ROS 1 and ROS 2 messages, and of the trajectories among them; where the bytes come from is elsewhere."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.importing.formats.message_fields import NameTwiceError, duration, fields_of, stamp_of
from wipx.importing.log_format import NO_STAMP, Chunk, Loss, Rows, Wanted, package

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"


class UndecodableError(ValueError):
    """The bytes of a message do not fit its type."""


@dataclass(frozen=True)
class Definition:
    """What the messages of a connection are.

    Attributes:
        kind: Type, e.g. "sensor_msgs/msg/JointState".
        encoding: Of the messages: "ros1", "cdr" or "json".
        text: Definition of the type; "" where the log has none.
        language: Of the definition: "msg" or "idl".
    """

    kind: str
    encoding: str
    text: str = ""
    language: str = "msg"


class Decoder:
    """Turns the messages of a log into chunks.

    Args:
        path: The log, for messages.
        wanted: Whether the numbers of a topic are wanted.
        definitions: Folder of .msg files of types that the log does not define; None for none.

    Attributes:
        rows: Takes the decoded messages.
    """

    def __init__(self, path: Path, wanted: Wanted, definitions: str | None = None) -> None:
        self.rows = Rows()
        self._path = path
        self._wanted = wanted
        self._folder = None if definitions is None else Path(definitions)
        self._types: dict[tuple[str, str], Any] = {}
        self._lost: dict[tuple[str, str], int] = {}
        self._trajectories: dict[str, _Trajectory] = {}

    def message(self, topic: str, definition: Definition, receive: int, data: bytes) -> Iterator[Chunk]:
        """Decode one message; gives the chunks that it completes.

        Args:
            topic: Where it was sent.
            definition: Of its type.
            receive: Stamp of the logger [ns].
            data: Its bytes.

        Raises:
            InputError: the type of a wanted topic is not defined, or a joint is named twice.
        """
        known = _within_range(receive)
        receive = NO_STAMP if known is None else known
        if not self._wanted(topic):
            yield from self.rows.add(topic, (), (), receive=receive, kind=definition.kind)
            return
        try:
            message = self._decoded(topic, definition, data)
            stamp = _within_range(stamp_of(message))
            if definition.kind == TRAJECTORY and definition.encoding != "json":
                trajectory = self._trajectories.setdefault(topic, _Trajectory(topic))
                yield from trajectory.replaced(message, stamp or receive, self.rows)
                return
            fields = fields_of(message)
        except NameTwiceError as error:
            raise InputError(
                f"{self._path}: topic {topic} names {error} twice in one message; "
                "record again with one name for each joint"
            ) from error
        except (ValueError, TypeError, OverflowError) as error:
            reason = f"messages of {topic} that do not fit {definition.kind} ({error})"
            self._lost[topic, reason] = self._lost.get((topic, reason), 0) + 1
            return
        header = NO_STAMP if stamp is None else stamp
        yield from self.rows.add(
            topic, tuple(fields), tuple(fields.values()), header=header, receive=receive, kind=definition.kind
        )

    def rest(self) -> Iterator[Chunk | Loss]:
        """What has not filled a chunk, and what could not be decoded."""
        for trajectory in self._trajectories.values():
            yield from trajectory.until(None, self.rows)
        yield from self.rows.rest()
        for (_, reason), count in self._lost.items():
            yield Loss(str(self._path), reason, count)

    def _decoded(self, topic: str, definition: Definition, data: bytes) -> object:
        if definition.encoding == "json":
            return _from_json(data)
        key = (topic, definition.kind)
        if key not in self._types:
            self._types[key] = self._store(topic, definition)
        store = self._types[key]
        decode = store.deserialize_ros1 if definition.encoding == "ros1" else store.deserialize_cdr
        try:
            return decode(data, definition.kind)
        except Exception as error:  # damaged bytes make the code that rosbags generates raise anything
            raise UndecodableError(type(error).__name__) from error

    def _store(self, topic: str, definition: Definition) -> Any:
        """The types that a message is made of.

        Raises:
            InputError: its type is not defined, or the encoding is not known.
        """
        if definition.encoding not in ("ros1", "cdr"):
            raise InputError(
                f"{self._path}: messages of topic {topic} are encoded as {definition.encoding or 'nothing'!r}, "
                "expected ros1, cdr or json; record them as ROS messages or leave the topic out"
            )
        typesys = package("rosbags.typesys", str(self._path))
        store = typesys.get_typestore(typesys.Stores.EMPTY if definition.text else typesys.Stores.LATEST)
        try:
            if definition.text:
                parse = typesys.get_types_from_idl if definition.language == "idl" else typesys.get_types_from_msg
                parsed = parse(definition.text, *(() if definition.language == "idl" else (definition.kind,)))
                store.register({name: kind for name, kind in parsed.items() if name not in store.types})
            else:
                self._register_folder(store, typesys)
            store.get_msgdef(definition.kind)
        except InputError:
            raise
        except Exception as error:  # the parser of definitions raises whatever it stumbles over
            missing = "cannot be read" if definition.text else "is not in the log"
            raise InputError(
                f"{self._path}: the definition of {definition.kind} (topic {topic}) {missing}; "
                "give a folder of .msg files with log.format.definitions=FOLDER"
            ) from error
        return store

    def _register_folder(self, store: Any, typesys: Any) -> None:
        """Add the types of PACKAGE/msg/TYPE.msg below the folder."""
        if self._folder is None:
            return
        files = sorted(self._folder.rglob("*.msg"))
        if not files:
            raise InputError(f"log.format.definitions {self._folder}: no .msg files; expected PACKAGE/msg/TYPE.msg")
        types: dict[str, Any] = {}
        for file in files:
            parent = file.parent.parent.name if file.parent.name == "msg" else file.parent.name
            try:
                types |= typesys.get_types_from_msg(file.read_text(encoding="utf-8"), f"{parent}/msg/{file.stem}")
            except Exception as error:  # as above
                raise InputError(f"{file}: not a message definition ({error}); correct it") from error
        store.register({name: kind for name, kind in types.items() if name not in store.types})


def _within_range(stamp: int | None) -> int | None:
    """A stamp [ns]; None where it is none that a clock shows."""
    return stamp if stamp is not None and abs(stamp) < 2**62 else None


def _from_json(data: bytes) -> object:
    try:
        content = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise UndecodableError(type(error).__name__) from error
    if not isinstance(content, dict):
        raise UndecodableError("no object")
    return content


@dataclass
class _Trajectory:
    """The points of a topic of JointTrajectory that are still to come; a new message replaces those after its start."""

    topic: str
    points: list[tuple[int, Mapping[str, float]]] = field(default_factory=list)

    def replaced(self, message: Any, start: int, rows: Rows) -> Iterator[Chunk]:
        points = []
        for point in message.points:
            numbers = fields_of(_NamedPoint(message.joint_names, point))
            points.append((start + duration(point.time_from_start), numbers))
        begin = points[0][0] if points else start
        yield from self.until(begin, rows)
        self.points = points

    def until(self, end: int | None, rows: Rows) -> Iterator[Chunk]:
        """Hand out the points before `end` [ns]."""
        for stamp, numbers in self.points:
            if end is None or stamp < end:
                yield from rows.add(self.topic, tuple(numbers), tuple(numbers.values()), header=stamp, kind=TRAJECTORY)


@dataclass
class _NamedPoint:
    """One point with the names of its joints, in the form of a message."""

    __msgtype__ = TRAJECTORY + "Point"

    def __init__(self, joint_names: list[str], point: Any) -> None:
        self.joint_names = list(joint_names)
        for name in ("positions", "velocities", "accelerations", "effort"):
            setattr(self, name, getattr(point, name))
