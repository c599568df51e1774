"""What was read of a log, on disk: one file for each field, so that a log may be larger than the memory.

A field is loaded whole when it is asked for; nothing else is kept in memory.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wipx.importing.log_format import Chunk


@dataclass
class StoredStream:
    """The messages of one stream.

    Attributes:
        name: Name of the stream.
        kind: Type of its messages.
        rows: Number of messages.
        units: Units that the log gives, by field.
        fields: All fields that messages had, in their order, also those that were not kept; a set without values.
        episodes: Label and first row of each part of the log, in order.
    """

    name: str
    kind: str
    folder: Path
    rows: int = 0
    units: dict[str, str] = field(default_factory=dict)
    fields: dict[str, None] = field(default_factory=dict)
    episodes: list[tuple[str, int]] = field(default_factory=list)
    _files: dict[str, Path] = field(default_factory=dict)

    def header(self, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Stamps of the sender of rows begin <= k < end, shape (end - begin,) [ns]; `NO_STAMP` where there is none."""
        return _load(self.folder / "header", np.dtype(np.int64), begin, self.rows if end is None else end)

    def receive(self, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Stamps of the logger of rows begin <= k < end, shape (end - begin,) [ns]; `NO_STAMP` where there is none."""
        return _load(self.folder / "receive", np.dtype(np.int64), begin, self.rows if end is None else end)

    def values(self, name: str, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Rows begin <= k < end of a kept field, shape (end - begin,), as logged; NaN where a message lacks it."""
        return _load(self._files[name], np.dtype(np.float64), begin, self.rows if end is None else end)

    def kept(self) -> tuple[str, ...]:
        """Fields that were kept."""
        return tuple(self._files)

    def part(self, label: str) -> tuple[int, int]:
        """First row of an episode and the row behind its last; (0, 0) where the stream has nothing of it."""
        begins = [*(begin for _, begin in self.episodes), self.rows]
        found = [k for k, (name, _) in enumerate(self.episodes) if name == label]
        return (begins[found[0]], begins[found[-1] + 1]) if found else (0, 0)

    def divide(self, rows: Sequence[int]) -> None:
        """Let a new episode begin at each of these rows: LABEL/2, LABEL/3, ..."""
        divided: list[tuple[str, int]] = []
        for (label, begin), end in zip(self.episodes, [*(b for _, b in self.episodes[1:]), self.rows], strict=True):
            inside = [row for row in rows if begin < row < end]
            names = [label, *(f"{label}/{k + 2}".strip("/") for k in range(len(inside)))] if inside else [label]
            divided += zip([f"{label}/1".strip("/"), *names[1:]] if inside else names, [begin, *inside], strict=True)
        self.episodes = divided

    def add(self, chunk: Chunk, keeps: Callable[[str], bool]) -> None:
        """Append the rows of a chunk, and its fields that `keeps` says."""
        if not self.episodes or self.episodes[-1][0] != chunk.episode:
            self.episodes.append((chunk.episode, self.rows))
        self.units.update(chunk.units)
        new = [name for name in chunk.fields if name not in self.fields]
        self.fields |= dict.fromkeys(new)
        for name in new:
            if keeps(name):
                self._files[name] = self.folder / str(len(self._files))
                _append(self._files[name], np.full(self.rows, np.nan))
        for name, path in self._files.items():
            values = chunk.fields.get(name)
            _append(path, np.full(chunk.rows, np.nan) if values is None else np.asarray(values, dtype=np.float64))
        _append(self.folder / "header", chunk.header)
        _append(self.folder / "receive", chunk.receive)
        self.rows += chunk.rows


class Spool:
    """The streams of a log.

    Args:
        folder: Takes the files; it exists and is empty.
        keeps: Whether a field of a stream is kept.
    """

    def __init__(self, folder: Path, keeps: Callable[[str, str], bool]) -> None:
        self._folder = folder
        self._keeps = keeps
        self._streams: dict[str, StoredStream] = {}

    @property
    def streams(self) -> Mapping[str, StoredStream]:
        """The streams by name, in the order in which they came."""
        return self._streams

    def add(self, chunk: Chunk) -> None:
        """Append a chunk to its stream."""
        stream = self._streams.get(chunk.stream)
        if stream is None:
            folder = self._folder / str(len(self._streams))
            folder.mkdir()
            stream = self._streams[chunk.stream] = StoredStream(chunk.stream, chunk.kind, folder)
        stream.add(chunk, lambda name: self._keeps(chunk.stream, name))

    def episodes(self) -> tuple[str, ...]:
        """Labels of all parts of the log, in order."""
        labels: dict[str, None] = {}
        for stream in self._streams.values():
            labels.update(dict.fromkeys(label for label, _ in stream.episodes))
        return tuple(labels)


def _load(path: Path, kind: np.dtype, begin: int, end: int) -> np.ndarray:
    return np.fromfile(path, dtype=kind, count=end - begin, offset=begin * kind.itemsize)


def _append(path: Path, values: np.ndarray) -> None:
    with path.open("ab") as file:
        values.tofile(file)
