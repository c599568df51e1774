"""MCAP files, read record by record, so that one without an end gives what it has.

Source: https://mcap.dev/spec. The package mcap parses the records, rosbags the messages.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from wipx.core.errors import InputError
from wipx.importing.formats.ros_messages import Decoder, Definition
from wipx.importing.log_format import Chunk, LogFormat, Loss, Wanted, open_binary, package

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # kind and length of a record
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, STATISTICS = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0B
LARGEST = 2**30  # bytes of a chunk
DAMAGED = (
    ValueError,
    KeyError,
    IndexError,
    struct.error,
    zlib.error,
    EOFError,
    RuntimeError,
    OverflowError,
    MemoryError,
)
LANGUAGES = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl"}


@dataclass(frozen=True)
class McapLog(LogFormat):
    """A .mcap file with messages of ROS 1, ROS 2 or in JSON.

    Attributes:
        definitions: Folder of .msg files of types that the file does not define.
    """

    definitions: str | None = None

    def reads(self, path: Path) -> bool:
        """Whether it ends in .mcap."""
        return path.is_file() and path.suffix == ".mcap"

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        decoder = Decoder(path, wanted, self.definitions)
        yield from read_mcap(path, decoder)
        yield from decoder.rest()


def read_mcap(path: Path, decoder: Decoder) -> Iterator[Chunk | Loss]:
    """The messages of a file, but for what the decoder still holds.

    Raises:
        InputError: it is no MCAP file, or a wanted topic cannot be decoded.
    """
    yield from _Mcap(path, decoder).read()


class _Mcap:
    def __init__(self, path: Path, decoder: Decoder) -> None:
        self._path = path
        self._decoder = decoder
        self._size = path.stat().st_size
        self._records = package("mcap.records", str(path))
        self._streams = package("mcap.stream_reader", str(path))
        self._data_stream = package("mcap.data_stream", str(path))
        self._errors = (*DAMAGED, package("mcap.exceptions", str(path)).McapError, *_compression_errors(str(path)))
        self._schemas: dict[int, Any] = {}
        self._channels: dict[int, tuple[str, Definition]] = {}
        self._read = 0
        self._counted: int | None = None
        self._ended = False

    def read(self) -> Iterator[Chunk | Loss]:
        with open_binary(self._path) as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise InputError(f"{self._path}: not an MCAP file; check the file")
            while not self._ended and (place := file.tell()) < self._size:
                head = file.read(HEAD.size)
                kind, length = HEAD.unpack(head) if len(head) == HEAD.size else (0, self._size)
                if file.tell() + length > self._size:
                    lost = f"the file ends inside a record; its last {self._size - place} bytes are not read"
                    yield Loss(f"{self._path} byte {place}", lost)
                    break
                self._decoder.rows.done = place / self._size
                yield from self._record(kind, length, file, place)
        if not self._ended:
            yield Loss(str(self._path), "the file was not closed; what the recorder had not written yet is missing")
        if self._counted is not None and self._counted > self._read:
            yield Loss(str(self._path), "messages that the file counts could not be read", self._counted - self._read)

    def _record(self, kind: int, length: int, file: BinaryIO, place: int) -> Iterator[Chunk | Loss]:
        if kind not in (FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, STATISTICS):
            file.seek(length, 1)
            return
        stream = self._data_stream.ReadDataStream(BytesIO(file.read(length)))
        try:
            if kind == CHUNK:
                chunk = self._records.Chunk.read(stream)
                self._check_size(chunk)
                records = self._streams.breakup_chunk(chunk, validate_crc=True)
            elif kind == MESSAGE:
                records = [self._records.Message.read(stream, length)]
            else:
                parsers = {FOOTER: "Footer", SCHEMA: "Schema", CHANNEL: "Channel", STATISTICS: "Statistics"}
                records = [vars(self._records)[parsers[kind]].read(stream)]
        except self._errors as error:
            lost = f"a damaged record of {length} bytes is left out ({type(error).__name__})"
            yield Loss(f"{self._path} byte {place}", lost)
            return
        for record in records:
            yield from self._content(record, place)

    def _check_size(self, chunk: Any) -> None:
        """Refuse a chunk that says that it is larger than any recorder makes it, before memory is taken for it."""
        size = chunk.uncompressed_size
        if chunk.compression == "zstd":
            size = max(size, package("zstandard", str(self._path)).get_frame_parameters(chunk.data).content_size)
        if size > LARGEST:
            raise ValueError("size")

    def _content(self, record: Any, place: int) -> Iterator[Chunk | Loss]:
        kinds = self._records
        if isinstance(record, kinds.Schema):
            self._schemas[record.id] = record
        elif isinstance(record, kinds.Channel):
            self._channels[record.id] = record.topic, self._definition(record)
        elif isinstance(record, kinds.Statistics):
            self._counted = record.message_count
        elif isinstance(record, kinds.Footer):
            self._ended = True
        elif isinstance(record, kinds.Message):
            if record.channel_id not in self._channels:
                yield Loss(f"{self._path} byte {place}", "message of a channel that is not described is left out", 1)
                return
            self._read += 1
            topic, definition = self._channels[record.channel_id]
            yield from self._decoder.message(topic, definition, record.log_time, record.data)

    def _definition(self, channel: Any) -> Definition:
        schema = self._schemas.get(channel.schema_id)
        if schema is None:
            return Definition("", channel.message_encoding)
        name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
        text = schema.data.decode("utf-8", "replace") if schema.encoding in LANGUAGES else ""
        return Definition(name, channel.message_encoding, text, LANGUAGES.get(schema.encoding, "msg"))


def _compression_errors(where: str) -> tuple[type[Exception], ...]:
    return (package("zstandard", where).ZstdError,)
