"""Frames of CAN logs (.blf, .asc, .log, .trc), also of damaged ones.

The package python-can reads the files, but ends at the first damage. Text is therefore handed to it line by line, and a
BLF file container by container, so that what is damaged is counted and the rest is read.
"""

import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.importing.log_format import Loss, open_binary

SUFFIXES = (".blf", ".asc", ".log", ".trc")
DAMAGED = (ValueError, IndexError, KeyError, OverflowError, struct.error, zlib.error, NotImplementedError, TypeError)
NO_FRAME = re.compile(r"\s*(;|//|(begin|end)\s+triggerblock|$)", re.IGNORECASE)  # comments and blank lines
BLF_OBJECT = struct.Struct("<4sHHLL")  # signature, size and version of the header, size of the object, its type
BLF_CONTAINER = 10
BLF_CONTAINER_HEAD = struct.Struct("<H6xL4x")  # compression, size uncompressed
BLF_HEADER_LENGTH = 144
ZLIB = 2


def frames(path: Path) -> Iterator[tuple[Any, float] | Loss]:
    """The frames of a log (`can.Message`), each with the share of the file that has been read, and what was lost.

    Raises:
        InputError: the file is none of these formats.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: not a CAN log; expected a file ending in {', '.join(SUFFIXES)}")
    yield from _binary_frames(path) if path.suffix.lower() == ".blf" else _text_frames(path)


class _Lines:
    """A text file that a reader can go on with after a line that it could not read.

    Attributes:
        delivered: Lines that were handed out, blank ones and comments aside.
        size: Characters that were handed out.
    """

    def __init__(self, file: Any) -> None:
        self._file = file
        self._header: list[str] = []
        self._again: list[str] = []
        self._in_header = True
        self.delivered = 0
        self.size = 0

    def __iter__(self) -> "_Lines":
        return self

    def __next__(self) -> str:
        if self._again:
            return self._again.pop(0)
        line = next(self._file)
        self.size += len(line)
        if self._in_header:
            self._header.append(line)
        elif not NO_FRAME.match(line):
            self.delivered += 1
        return line

    def read(self) -> str:
        """The next line; readers of python-can only iterate, but look whether this is a file."""
        return next(self, "")

    def close(self) -> None:
        """Nothing: who opened the file closes it."""

    def first_frame(self) -> None:
        """The header ended one line before the latest."""
        if self._in_header:
            self._in_header = False
            self.delivered += 1
            self._header = self._header[:-1]

    def go_on(self) -> None:
        """Hand out the header again, then what comes after the latest line."""
        self._again = [] if self._in_header else list(self._header)


def _text_frames(path: Path) -> Iterator[tuple[Any, float] | Loss]:
    import can

    readers = {".asc": can.ASCReader, ".log": can.CanutilsLogReader, ".trc": can.TRCReader}
    options: dict[str, Any] = {"relative_timestamp": False} if path.suffix.lower() == ".asc" else {}
    size = max(path.stat().st_size, 1)
    damaged, read = 0, 0
    first_reason = ""
    try:
        file = path.open(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from error
    with file:
        lines = _Lines(file)
        while True:
            before = lines.size
            try:
                for frame in readers[path.suffix.lower()](lines, **options):
                    lines.first_frame()
                    read += 1
                    yield frame, min(lines.size / size, 1.0)
                break
            except DAMAGED as error:
                if lines.size == before:
                    raise InputError(f"{path}: the header cannot be read ({error}); check the file") from error
                damaged += 1
                first_reason = first_reason or f"{type(error).__name__}: {error}"
                lines.go_on()
    if read == 0:
        raise InputError(f"{path}: there is no CAN frame in the file; check the file and its suffix")
    if damaged:
        yield Loss(str(path), f"damaged lines are left out, the first for {first_reason}", damaged)
    other = lines.delivered - read - damaged
    if other > 0:
        yield Loss(str(path), "lines are no frames (events of the logger, or damage)", other)


class _WholeContainers:
    """A BLF file without the objects that are damaged; what it leaves out is in `losses`.

    Attributes:
        losses: What was left out.
        done: Share of the file that has been read.
    """

    def __init__(self, path: Path, file: Any) -> None:
        self._path = path
        self._file = file
        self._size = path.stat().st_size
        self._pending = bytearray(file.read(BLF_HEADER_LENGTH))
        self.losses: list[Loss] = []
        self.done = 0.0

    def read(self, length: int) -> bytes:
        """The next bytes of what is whole."""
        while len(self._pending) < length and self._extend():
            pass
        data = bytes(self._pending[:length])
        del self._pending[:length]
        return data

    def close(self) -> None:
        """Nothing: who opened the file closes it."""

    def _extend(self) -> bool:
        """Take in the next object; whether there was one."""
        place = self._file.tell()
        self.done = place / max(self._size, 1)
        head = self._file.read(BLF_OBJECT.size)
        if not head:
            return False
        if len(head) < BLF_OBJECT.size or not head.startswith(b"LOBJ"):
            return self._next_object(place)
        _, _, _, size, kind = BLF_OBJECT.unpack(head)
        length = size - BLF_OBJECT.size
        if length < 0 or place + size > self._size:
            return self._next_object(place)
        body = self._file.read(length)
        padding = self._file.read(size % 4)
        if kind == BLF_CONTAINER and not _is_whole(body):
            lost = f"a damaged container of {size} bytes is left out, with its frames"
            self.losses.append(Loss(f"{self._path} byte {place}", lost))
            return True
        self._pending += head + body + padding
        return True

    def _next_object(self, place: int) -> bool:
        """Search on after damage."""
        self._file.seek(place + 1)
        skipped = 1
        carry = b""
        while block := self._file.read(65536):
            found = (carry + block).find(b"LOBJ")
            if found >= 0:
                begin = self._file.tell() - len(carry) - len(block) + found
                self.losses.append(Loss(f"{self._path} byte {place}", f"{begin - place} damaged bytes are left out"))
                self._file.seek(begin)
                return True
            skipped += len(block)
            carry = block[-3:]
        lost = f"the file ends inside an object; its last {self._size - place} bytes are not read"
        self.losses.append(Loss(f"{self._path} byte {place}", lost))
        return False


def _is_whole(container: bytes) -> bool:
    if len(container) < BLF_CONTAINER_HEAD.size:
        return False
    method, size = BLF_CONTAINER_HEAD.unpack_from(container)
    if method != ZLIB:
        return True
    unpacker = zlib.decompressobj()
    try:
        return len(unpacker.decompress(container[BLF_CONTAINER_HEAD.size :], size + 1)) == size and unpacker.eof
    except zlib.error:
        return False


def _binary_frames(path: Path) -> Iterator[tuple[Any, float] | Loss]:
    import can
    from can.io.blf import BLFParseError

    read = 0
    with open_binary(path) as file:
        whole = _WholeContainers(path, file)
        try:
            reader = can.BLFReader(whole)  # pyright: ignore[reportArgumentType] - it only reads and closes
        except (*DAMAGED, BLFParseError) as error:
            raise InputError(f"{path}: not a BLF file ({error}); check the file") from error
        counted = reader.object_count
        while True:
            try:
                for frame in reader:
                    read += 1
                    yield frame, whole.done
                break
            except (*DAMAGED, BLFParseError) as error:
                reader._tail = b""  # what a container has left over after damage belongs to no frame
                whole.losses.append(Loss(str(path), f"frames after damage inside a container ({error})"))
    if read == 0:
        raise InputError(f"{path}: there is no CAN frame in the file; check the file")
    yield from whole.losses
    if counted > read:
        yield Loss(str(path), "objects that the file counts are no frames, or are damaged", counted - read)
