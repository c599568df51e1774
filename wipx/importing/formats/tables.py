"""CSV and Parquet files whose columns have any names; a folder of them is one episode for each file."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.importing.formats.columns import columns_of_batch
from wipx.importing.log_format import CHUNK_ROWS, Chunk, LogFormat, Loss, Wanted, nanoseconds, unstamped
from wipx.recordings.units import UNITS

STREAM = "table"
SUFFIXES = (".csv", ".txt", ".tsv", ".parquet")


@dataclass(frozen=True)
class TableLog(LogFormat):
    """A .csv, .txt, .tsv or .parquet file, or a folder of them; its one stream is "table".

    Attributes:
        time: Column of the time; null where rows come at a fixed period.
        time_unit: Unit of the time; dates and times as in ISO 8601 need none.
        period: Time between rows, where there is no column of it [s].
        receive: Column of the time at which the logger received the row, in the same unit; null for none.
        episode: Column whose value changes where a new episode begins; null for none.
    """

    time: str | None = "t"
    time_unit: str = "s"
    period: float | None = None
    receive: str | None = None
    episode: str | None = None

    def __post_init__(self) -> None:
        if self.time_unit not in UNITS or UNITS[self.time_unit].si != "s":
            raise unknown_name("unit", self.time_unit, [u for u in UNITS if UNITS[u].si == "s"], "log.format.time_unit")
        if (self.time is None) == (self.period is None):
            raise InputError("log.format: give either time=COLUMN or time=null and period=SECONDS")

    def reads(self, path: Path) -> bool:
        """Whether it is or holds a table."""
        return bool(_files(path))

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        files = _files(path)
        if not files:
            raise InputError(f"{path}: no table; expected files ending in {', '.join(SUFFIXES)}")
        for number, file in enumerate(files):
            row = 0
            blocks = _parquet_blocks(file) if file.suffix == ".parquet" else _text_blocks(file)
            for item in blocks:
                if isinstance(item, Loss):
                    yield item
                    continue
                for chunk in self._chunks(file, item, row, file.stem if len(files) > 1 else "", number / len(files)):
                    row += chunk.rows
                    yield chunk
            if row == 0:
                raise InputError(f"{file}: there is no row with a time; drop the file or record again")

    def _chunks(self, file: Path, columns: dict[str, np.ndarray], row: int, label: str, done: float) -> Iterator[Chunk]:
        for setting, name in (("time", self.time), ("receive", self.receive), ("episode", self.episode)):
            if name is not None and name not in columns:
                raise unknown_name("column", name, columns, f"{file}: log.format.{setting}")
        header = self._stamps(columns, row)
        receive = unstamped(len(header)) if self.receive is None else self._of_clock(columns[self.receive])
        labels = [label] * len(header) if self.episode is None else _labels(label, columns[self.episode])
        begins = [k for k in range(len(labels)) if k == 0 or labels[k] != labels[k - 1]]
        for begin, end in zip(begins, [*begins[1:], len(labels)], strict=True):
            part = slice(begin, end)
            fields = {name: values[part] for name, values in columns.items()}
            yield Chunk(STREAM, fields, header[part], receive[part], "rows", episode=labels[begin], done=done)

    def _stamps(self, columns: dict[str, np.ndarray], row: int) -> np.ndarray:
        if self.time is not None:
            return self._of_clock(columns[self.time])
        assert self.period is not None
        rows = len(next(iter(columns.values()), ()))
        return nanoseconds((row + np.arange(rows)) * self.period)

    def _of_clock(self, values: np.ndarray) -> np.ndarray:
        return nanoseconds(values * UNITS[self.time_unit].factor)


def _labels(label: str, numbers: np.ndarray) -> list[str]:
    return [f"{label}/{n:g}".strip("/") for n in numbers]


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path] if path.suffix.lower() in SUFFIXES else []
    return sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES) if path.is_dir() else []


def _parquet_blocks(file: Path) -> Iterator[dict[str, np.ndarray] | Loss]:
    import pyarrow as pa
    from pyarrow import parquet

    read = 0
    try:
        for batch in parquet.ParquetFile(file).iter_batches(batch_size=CHUNK_ROWS):
            yield columns_of_batch(batch, {})
            read += batch.num_rows
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).splitlines()[0][:120]
        if read == 0:
            raise InputError(f"{file}: not a readable Parquet file ({reason}); write it again") from error
        yield Loss(str(file), f"the file is damaged after {read} rows ({reason}); the rest is not read")


def _text_blocks(file: Path) -> Iterator[dict[str, np.ndarray] | Loss]:
    cells = 0
    try:
        with file.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
            reader = csv.reader((line.replace("\0", "?") for line in stream), delimiter=_delimiter(file))
            header = _header(file, next(reader, []))
            for item in _blocks(file, reader, len(header)):
                if isinstance(item, Loss):
                    yield item
                    continue
                columns, bad = _columns(header, item)
                cells += bad
                yield columns
    except csv.Error as error:
        yield Loss(str(file), f"the file is damaged ({error}); the rest is not read")
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror}); check the path and its permissions") from error
    if cells:
        yield Loss(str(file), "cells that are no numbers, in columns of numbers", cells)


def _header(file: Path, cells: Sequence[str]) -> list[str]:
    header = [name.strip() for name in cells]
    if not header:
        raise InputError(f"{file}: the file is empty, expected a header line and rows")
    twice = next((name for name in header if name and header.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{file}: two columns are named {twice}; rename one of them")
    return header


def _blocks(file: Path, reader: Iterator[list[str]], width: int) -> Iterator[list[list[str]] | Loss]:
    """The rows of a file in blocks; rows of another width are counted."""
    block: list[list[str]] = []
    ragged = 0
    for row in reader:
        if len(row) == width:
            block.append(row)
        elif row:
            ragged += 1
        if len(block) == CHUNK_ROWS:
            yield block
            block = []
    if block:
        yield block
    if ragged:
        yield Loss(str(file), "rows do not have as many cells as the header and are left out", ragged)


def _delimiter(file: Path) -> str:
    with file.open(encoding="utf-8-sig", errors="replace") as stream:
        header = stream.readline()
    return max(",;\t", key=header.count)


def _columns(header: Sequence[str], block: list[list[str]]) -> tuple[dict[str, np.ndarray], int]:
    """Numbers of a block of rows by column, and how many cells beside numbers hold something else."""
    columns, bad = {}, 0
    for k, name in enumerate(header):
        cells = [row[k] for row in block]
        try:
            values = np.array(cells, dtype=float)
        except ValueError:
            values = np.array([_number(cell) for cell in cells])
            strange = sum(1 for cell, value in zip(cells, values, strict=True) if value != value and cell.strip())
            strange -= sum(1 for cell in cells if cell.strip().lower() == "nan")
            bad += strange if np.isfinite(values).any() else 0
        columns[name] = values
    return columns, bad


def _number(cell: str) -> float:
    """A number, a truth value, or the seconds since 1970 of a date and time; NaN for anything else."""
    text = cell.strip()
    if text.lower() in ("true", "false"):
        return float(text.lower() == "true")
    try:
        return float(text)
    except ValueError:
        pass
    if len(text) < 10 or text[4:5] != "-":
        return float("nan")
    try:
        return float((np.datetime64(text.rstrip("Z"), "ns") - np.datetime64(0, "ns")) / np.timedelta64(1, "s"))
    except ValueError:
        return float("nan")
