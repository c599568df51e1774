"""ROS 1 bags, read from front to back, so that one without an index or an end gives what it has.

Source: http://wiki.ros.org/Bags/Format/2.0. The package rosbags decodes the messages.
"""

import bz2
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from wipx.core.errors import InputError
from wipx.importing.formats.ros_messages import Decoder, Definition
from wipx.importing.log_format import Chunk, LogFormat, Loss, Wanted, open_binary, package

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, BAG_HEADER, CHUNK, CONNECTION = 2, 3, 5, 7
LARGEST = 2**31  # bytes of a record; more is garbage
DAMAGED = (ValueError, KeyError, IndexError, struct.error, OSError, EOFError, RuntimeError, MemoryError)


@dataclass(frozen=True)
class Ros1Bag(LogFormat):
    """A .bag file.

    Attributes:
        definitions: Folder of .msg files of types that the bag does not define.
    """

    definitions: str | None = None

    def reads(self, path: Path) -> bool:
        """Whether it ends in .bag."""
        return path.is_file() and path.suffix == ".bag"

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        yield from _Bag(path, Decoder(path, wanted, self.definitions)).read()


class _Bag:
    def __init__(self, path: Path, decoder: Decoder) -> None:
        self._path = path
        self._decoder = decoder
        self._size = path.stat().st_size
        self._connections: dict[int, tuple[str, Definition]] = {}
        self._chunks: tuple[int, int | None] = 0, None  # read, and as the bag's header has it

    def read(self) -> Iterator[Chunk | Loss]:
        with open_binary(self._path) as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise InputError(f"{self._path}: not a bag of ROS 1 (version 2.0); check the file")
            while (place := file.tell()) < self._size:
                record = self._record(file)
                if record is None:
                    lost = f"the file ends inside a record; its last {self._size - place} bytes are not read"
                    yield Loss(f"{self._path} byte {place}", lost)
                    break
                self._decoder.rows.done = place / self._size
                yield from self._contents(record, place)
        yield from self._decoder.rest()
        read, expected = self._chunks
        if expected is None:
            yield Loss(str(self._path), "the bag was not closed; what the recorder had not written yet is missing")
        elif read < expected:
            yield Loss(str(self._path), "chunks of messages that the bag's header counts are missing", expected - read)

    def _record(self, file: BinaryIO) -> tuple[dict[str, bytes], bytes] | None:
        """Header and data of the next record; None where the file ends first."""
        head = _prefixed(file, self._size)
        data = _prefixed(file, self._size) if head is not None else None
        if head is None or data is None:
            return None
        try:
            return _header(head), data
        except DAMAGED:
            return {}, data

    def _contents(self, record: tuple[dict[str, bytes], bytes], place: int) -> Iterator[Chunk | Loss]:
        head, data = record
        try:
            kind = head["op"][0]
            if kind == BAG_HEADER:
                closed = struct.unpack("<Q", head["index_pos"])[0] > 0
                self._chunks = self._chunks[0], struct.unpack("<I", head["chunk_count"])[0] if closed else None
            elif kind == CHUNK:
                self._chunks = self._chunks[0] + 1, self._chunks[1]
                yield from self._records(_unpacked(head["compression"].decode(), data, str(self._path)))
            elif kind in (CONNECTION, MESSAGE):
                yield from self._single(kind, head, data)
        except DAMAGED as error:
            lost = f"a damaged record of {len(data)} bytes is left out ({type(error).__name__})"
            yield Loss(f"{self._path} byte {place}", lost)

    def _records(self, content: bytes) -> Iterator[Chunk]:
        """The messages of a chunk."""
        place = 0
        while place < len(content):
            head, place = _slice(content, place)
            data, place = _slice(content, place)
            fields = _header(head)
            yield from self._single(fields["op"][0], fields, data)

    def _single(self, kind: int, head: dict[str, bytes], data: bytes) -> Iterator[Chunk]:
        if kind == CONNECTION:
            said = _header(data)
            name = said["type"].decode().replace("/", "/msg/", 1)
            definition = Definition(name, "ros1", said["message_definition"].decode("utf-8", "replace"))
            self._connections[_number(head["conn"])] = head["topic"].decode(), definition
        elif kind == MESSAGE:
            topic, definition = self._connections[_number(head["conn"])]
            seconds, nanoseconds = struct.unpack("<II", head["time"])
            yield from self._decoder.message(topic, definition, seconds * 1_000_000_000 + nanoseconds, data)


def _prefixed(file: BinaryIO, size: int) -> bytes | None:
    """Bytes that follow their number; None where the file ends first."""
    prefix = file.read(4)
    if len(prefix) < 4:
        return None
    length = _number(prefix)
    return file.read(length) if length < LARGEST and file.tell() + length <= size else None


def _slice(content: bytes, place: int) -> tuple[bytes, int]:
    begin = place + 4
    end = begin + _number(content[place:begin])
    if end > len(content):
        raise ValueError("a record is longer than its chunk")
    return content[begin:end], end


def _header(data: bytes) -> dict[str, bytes]:
    """Fields NAME=VALUE of a record's header."""
    fields, place = {}, 0
    while place < len(data):
        entry, place = _slice(data, place)
        name, _, value = entry.partition(b"=")
        fields[name.decode("ascii")] = value
    return fields


def _number(data: bytes) -> int:
    return struct.unpack("<I", data)[0]


def _unpacked(compression: str, data: bytes, where: str) -> bytes:
    if compression == "none":
        return data
    if compression == "bz2":
        return bz2.decompress(data)
    if compression == "lz4":
        return package("lz4.frame", where).decompress(data)
    raise ValueError(f"unknown compression {compression}")
