"""What every format of logs has in common: it is read once, in chunks, and says what it could not read."""

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np

from wipx.core.errors import InputError

CHUNK_ROWS = 4096
NO_STAMP = np.iinfo(np.int64).min  # a message without that stamp
Wanted = Callable[[str], bool]


@dataclass(frozen=True)
class Chunk:
    """Consecutive messages of one stream (a topic, a CAN message, a table).

    Attributes:
        stream: Name of the stream.
        fields: Numbers by name of the field, each of shape (rows,), as logged; empty where the stream is not wanted.
        header: When the sender stamped the messages, shape (rows,) [ns]; `NO_STAMP` where it did not.
        receive: When the logger received them, shape (rows,) [ns]; `NO_STAMP` where that is not logged.
        kind: Type of the messages, for people.
        units: Units that the log itself gives, by field.
        episode: Label of the part of the log that the rows belong to; "" where it has no parts.
        done: Share of the log that has been read.
    """

    stream: str
    fields: Mapping[str, np.ndarray]
    header: np.ndarray
    receive: np.ndarray
    kind: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    episode: str = ""
    done: float = 0.0

    @property
    def rows(self) -> int:
        """Number of messages."""
        return len(self.header)


@dataclass(frozen=True)
class Loss:
    """Something that the log should hold and that could not be read.

    Attributes:
        where: File, and place in it where there is one place.
        what: What is lost, with its cause.
        count: How many of it; 0 where nobody can know.
    """

    where: str
    what: str
    count: int = 0

    def __str__(self) -> str:
        return f"{self.where}: {f'{self.count} ' if self.count else ''}{self.what}"


class LogFormat(ABC):
    """A format of logs; subclasses are frozen dataclasses of its settings."""

    @abstractmethod
    def reads(self, path: Path) -> bool:
        """Whether a file or folder looks like this format."""

    @abstractmethod
    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """The messages of a log in the order of the file, and what was lost.

        Args:
            path: File or folder.
            wanted: Whether the numbers of a stream are wanted; of others only the stamps are read.

        Raises:
            InputError: the log cannot be read at all, or a wanted stream cannot be decoded.
        """


class Rows:
    """Collects single messages of many streams into chunks.

    Attributes:
        done: Share of the log that has been read; the reader keeps it up to date.
        episode: Label of the part of the log that is being read.
    """

    def __init__(self) -> None:
        self.done = 0.0
        self.episode = ""
        self._open: dict[str, _OpenChunk] = {}

    def add(
        self,
        stream: str,
        names: Sequence[str],
        values: Sequence[float],
        *,
        header: int = NO_STAMP,
        receive: int = NO_STAMP,
        kind: str = "",
        units: Mapping[str, str] | None = None,
    ) -> Iterator[Chunk]:
        """Add one message; gives the chunk that it completes.

        Args:
            stream: Name of the stream.
            names: Its fields.
            values: Their values, as many.
            header: Stamp of the sender [ns].
            receive: Stamp of the logger [ns].
            kind: Type of the message.
            units: Of the fields, where the log gives them.
        """
        chunk = self._open.get(stream)
        if chunk is not None and (chunk.names != names or len(chunk.header) >= CHUNK_ROWS):
            yield chunk.closed(self)
            chunk = None
        if chunk is None:
            chunk = self._open[stream] = _OpenChunk(stream, names, kind, units or {})
        chunk.header.append(header)
        chunk.receive.append(receive)
        chunk.values.append(values)

    def rest(self) -> Iterator[Chunk]:
        """What has not filled a chunk."""
        for chunk in self._open.values():
            yield chunk.closed(self)
        self._open.clear()


@dataclass
class _OpenChunk:
    stream: str
    names: Sequence[str]
    kind: str
    units: Mapping[str, str]
    header: list[int] = field(default_factory=list)
    receive: list[int] = field(default_factory=list)
    values: list[Sequence[float]] = field(default_factory=list)

    def closed(self, rows: Rows) -> Chunk:
        table = np.array(self.values, dtype=float).reshape(len(self.values), len(self.names))
        return Chunk(
            stream=self.stream,
            fields={name: table[:, k] for k, name in enumerate(self.names)},
            header=np.array(self.header, dtype=np.int64),
            receive=np.array(self.receive, dtype=np.int64),
            kind=self.kind,
            units=self.units,
            episode=rows.episode,
            done=rows.done,
        )


def unstamped(rows: int) -> np.ndarray:
    """Stamps of messages that have none, shape (rows,)."""
    return np.full(rows, NO_STAMP, dtype=np.int64)


def nanoseconds(seconds: np.ndarray) -> np.ndarray:
    """Times in whole nanoseconds, shape as given; `NO_STAMP` where a time is not finite or beyond the range.

    Args:
        seconds: Times [s].
    """
    with np.errstate(invalid="ignore"):
        usable = np.abs(seconds) < 9.0e9  # int64 nanoseconds end at 9.2e9 s
    whole = np.floor(np.where(usable, seconds, 0.0))
    fraction = np.where(usable, seconds, 0.0) - whole
    stamps = whole.astype(np.int64) * 1_000_000_000 + np.rint(fraction * 1e9).astype(np.int64)
    return np.where(usable, stamps, NO_STAMP)


def package(name: str, what: str) -> ModuleType:
    """An optional package, imported.

    Args:
        name: Full name of the module.
        what: What it reads, for the message.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        missing = (error.name or name).partition(".")[0]
        raise InputError(f"{what}: needs the package {missing}; install it with: pip install 'wipx[import]'") from error


def open_binary(path: Path):
    """A file, opened for bytes.

    Raises:
        InputError: it cannot be opened.
    """
    try:
        return path.open("rb")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from error
