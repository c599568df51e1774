"""NPZ and HDF5 files of trajectories, as scripts around MuJoCo and Isaac write them.

Arrays have time along their first axis. An HDF5 file may have a group for each episode (`data/demo_0`, ...).
"""

import re
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.importing.formats.columns import columns_of_array
from wipx.importing.formats.message_fields import LONGEST
from wipx.importing.log_format import CHUNK_ROWS, Chunk, LogFormat, Loss, Wanted, nanoseconds, package, unstamped

STREAM = "arrays"
HDF5 = (".h5", ".hdf5")
MOST_ROWS = 1000  # for each byte of the file: arrays of zeros are packed that much, and no more
DAMAGED = (
    OSError,
    ValueError,
    KeyError,
    RuntimeError,
    TypeError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    MemoryError,
)
Slice = Callable[[int, int], np.ndarray]


@dataclass(frozen=True)
class ArrayLog(LogFormat):
    """A .npz, .h5 or .hdf5 file; its one stream is "arrays", its fields `ARRAY` or `ARRAY[k]`.

    Attributes:
        time: Array of the time [s]; null where rows come at a fixed period.
        period: Time between rows where there is no array of it [s].
        episodes: Pattern of the HDF5 groups of which each is an episode, e.g. "data/*"; null where the file is one.
    """

    time: str | None = "time"
    period: float | None = None
    episodes: str | None = None

    def __post_init__(self) -> None:
        if (self.time is None) == (self.period is None):
            raise InputError("log.format: give either time=ARRAY or time=null and period=SECONDS")

    def reads(self, path: Path) -> bool:
        """Whether it ends in .npz, .h5 or .hdf5."""
        return path.is_file() and path.suffix.lower() in (".npz", *HDF5)

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        if path.suffix.lower() == ".npz":
            yield from self._npz(path)
        else:
            yield from self._hdf5(path)

    def _npz(self, path: Path) -> Iterator[Chunk | Loss]:
        arrays: dict[str, _Array] = {}
        try:
            with np.load(path, allow_pickle=False) as file:
                for name in file.files:
                    try:
                        array = file[name]
                    except DAMAGED as error:
                        yield _damaged(str(path), name, error)
                        continue
                    if isinstance(array, np.ndarray) and array.ndim:
                        arrays[name] = _Array(array.shape, lambda begin, end, a=array: a[begin:end])
        except DAMAGED as error:
            raise InputError(f"{path}: not a readable NPZ file ({error}); check the file") from error
        yield from self._episode(path, "", arrays, 0.0)

    def _hdf5(self, path: Path) -> Iterator[Chunk | Loss]:
        h5py = package("h5py", str(path))
        try:
            file = h5py.File(path, "r")
        except DAMAGED as error:
            raise InputError(f"{path}: not a readable HDF5 file ({error}); check the file") from error
        with file:
            groups = self._groups(path, file)
            for number, name in enumerate(groups):
                label, where = name.rpartition("/")[2], f"{path} {name}".strip()
                arrays: dict[str, _Array] = {}
                damaged: list[str] = []
                try:
                    group = file[name] if name else file
                    for member in _members(group):
                        try:
                            _collect(h5py, member, group[member], arrays)
                        except DAMAGED as error:
                            damaged.append(member)
                            yield _damaged(where, member, error)
                except DAMAGED as error:
                    yield _damaged(where, "its list of arrays", error)
                    continue
                if self.time not in damaged:
                    yield from self._episode(path, label, arrays, number / len(groups))

    def _groups(self, path: Path, file: Any) -> list[str]:
        """Names of the groups that are episodes, in order; "" is the file itself."""
        if self.episodes is None:
            return [""]
        pattern = self.episodes.strip("/")
        try:
            names = _members(file)
        except DAMAGED as error:
            raise InputError(f"{path}: the file's groups cannot be read ({error}); nothing of it can be had") from error
        found = [name for name in names if name.count("/") == pattern.count("/") and fnmatch(name, pattern)]
        if not found:
            more = f" and {len(names) - 8} more" if len(names) > 8 else ""
            listed = ", ".join(names[:8]) + more
            raise InputError(f"{path}: no group matches log.format.episodes={self.episodes}; it has {listed}")
        return sorted(found, key=_natural)

    def _episode(self, path: Path, label: str, arrays: "Mapping[str, _Array]", done: float) -> Iterator[Chunk | Loss]:
        """One trajectory in pieces; arrays of another length than the time are said to be left out."""
        where = f"{path} {label}".strip()
        # Images are no numbers of a robot.
        arrays = {name: array for name, array in arrays.items() if np.prod(array.shape[1:]) <= LONGEST}
        rows = self._rows(path, where, arrays)
        other = sorted(name for name, array in arrays.items() if array.shape[0] != rows)
        if other:
            yield Loss(where, f"arrays do not have the {rows} rows of the others: {', '.join(other[:5])}", len(other))
        for begin in range(0, rows, CHUNK_ROWS):
            end = min(begin + CHUNK_ROWS, rows)
            fields: dict[str, np.ndarray] = {}
            try:
                for name, array in arrays.items():
                    if array.shape[0] == rows:
                        fields |= columns_of_array(name, np.asarray(array.rows(begin, end)))
                if self.time is not None:
                    header = nanoseconds(np.asarray(arrays[self.time].rows(begin, end), dtype=float))
                else:
                    header = nanoseconds(np.arange(begin, end) * (self.period or 0.0))
            except DAMAGED as error:
                yield Loss(where, f"rows from {begin} on are damaged ({type(error).__name__})", rows - begin)
                return
            yield Chunk(STREAM, fields, header, unstamped(len(header)), "trajectory", episode=label, done=done)

    def _rows(self, path: Path, where: str, arrays: "Mapping[str, _Array]") -> int:
        lengths = [array.shape[0] for array in arrays.values()]
        if self.time is not None:
            if self.time not in arrays:
                raise unknown_name("array", self.time, arrays, f"{where}: log.format.time")
            if len(arrays[self.time].shape) != 1:
                raise InputError(
                    f"{where}: {self.time} has {arrays[self.time].shape}, expected one number for each row"
                )
        rows = arrays[self.time].shape[0] if self.time is not None else max(lengths, key=lengths.count, default=0)
        if rows > MOST_ROWS * max(path.stat().st_size, 1):
            raise InputError(f"{where}: {rows} rows cannot be in a file of this size; it is damaged")
        if rows == 0:
            raise InputError(f"{where}: the episode is empty; leave it out with log.format.episodes=PATTERN")
        return rows


@dataclass(frozen=True)
class _Array:
    shape: tuple[int, ...]
    rows: Slice


def _members(group: Any) -> list[str]:
    """Names of all groups and arrays below a group."""
    names: list[str] = []
    group.visit(names.append)
    return names


def _collect(h5py: Any, name: str, item: Any, into: dict[str, _Array]) -> None:
    if isinstance(item, h5py.Dataset) and item.shape and item.dtype.kind in "biuf":
        into[name] = _Array(item.shape, lambda begin, end: item[begin:end])


def _damaged(where: str, name: str, error: Exception) -> Loss:
    return Loss(where, f"array {name} is damaged ({type(error).__name__})", 1)


def _natural(name: str) -> list[Any]:
    """So that demo_2 comes before demo_10."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.split(r"(\d+)", name)]
