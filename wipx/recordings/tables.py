"""Tables: CSV and Parquet files as columns of numbers, and where each error is.

Only columns that are asked for are turned into numbers and checked; a log may hold text
beside them. What the columns mean is in `wipx.recordings.signals`.
"""

import csv
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wipx.core.errors import InputError, unknown_name

if TYPE_CHECKING:
    import pyarrow as pa


class Table(ABC):
    """A file of rows, opened; rows are counted from 0.

    Attributes:
        path: The file.
        names: Its columns.
        rows: Number of rows.
    """

    def __init__(self, path: Path, names: Sequence[str], rows: int) -> None:
        self.path = path
        self.names = tuple(names)
        self.rows = rows

    @abstractmethod
    def place(self, row: int) -> str:
        """File and row as a person finds them, e.g. "r3.csv line 812"."""

    @abstractmethod
    def _cells(self, column: str, begin: int, end: int) -> Sequence[object]:
        """Raw content of rows begin <= k < end of a column."""

    def column(self, name: str, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Rows begin <= k < end of a column as finite numbers, shape (end - begin,).

        Raises:
            InputError: there is no such column, or a cell is empty, text or not finite.
        """
        if name not in self.names:
            raise unknown_name("column", name, self.names, str(self.path))
        if self.names.count(name) > 1:
            raise InputError(f"{self.path}: two columns are named {name}; rename one of them")
        cells = self._cells(name, begin, self.rows if end is None else end)
        try:
            values = np.array(cells, dtype=float)
        except (TypeError, ValueError):
            values = np.array([_number(cell) for cell in cells])
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            cell = cells[int(bad[0])]
            found = "empty" if cell is None or not str(cell).strip() else repr(str(cell))
            raise InputError(
                f"{self.place(begin + int(bad[0]))}: {name} is {found}, expected a finite number; "
                "correct or drop the row"
            )
        return values


class CsvTable(Table):
    """A comma-separated text file with one header line."""

    def __init__(self, path: Path) -> None:
        lines, rows = _read_csv(path)
        if not rows:
            raise InputError(f"{path}: the file is empty, expected a header line and rows")
        header = [name.strip() for name in rows[0]]
        if len(header) == 1 and any(mark in header[0] for mark in ";\t"):
            raise InputError(f"{path}: the header has no comma ({header[0]!r}); separate the cells by commas")
        if len(rows) == 1:
            raise InputError(f"{path}: there is a header line but no row; drop the file or record again")
        for line, row in zip(lines, rows, strict=True):
            if len(row) != len(header):
                raise InputError(
                    f"{path} line {line}: {len(row)} cells, the header has {len(header)}; correct or drop the row"
                )
        super().__init__(path, header, len(rows) - 1)
        self._lines = lines[1:]
        self._rows = rows[1:]

    def place(self, row: int) -> str:
        """File and line; the header is line 1."""
        return f"{self.path} line {self._lines[row]}"

    def _cells(self, column: str, begin: int, end: int) -> Sequence[object]:
        position = self.names.index(column)
        return [row[position] for row in self._rows[begin:end]]


class ParquetTable(Table):
    """A Parquet file."""

    def __init__(self, path: Path) -> None:
        content = _read_parquet(path)
        if content.num_rows == 0:
            raise InputError(f"{path}: there are columns but no row; drop the file or record again")
        super().__init__(path, [name.strip() for name in content.column_names], content.num_rows)
        self._content = content

    def place(self, row: int) -> str:
        """File and row, counted from 1."""
        return f"{self.path} row {row + 1}"

    def _cells(self, column: str, begin: int, end: int) -> Sequence[object]:
        values = self._content.column(self.names.index(column)).slice(begin, end - begin)
        if str(values.type).startswith(("timestamp", "date", "time", "duration")):
            raise InputError(f"{self.path}: {column} is of type {values.type}, expected numbers; store seconds")
        return values.to_pylist() if values.null_count else values.to_numpy()


def open_table(path: Path) -> Table:
    """The table in a file; Parquet by the suffix `.parquet`, else CSV.

    Raises:
        InputError: the file cannot be read, or has no rows.
    """
    return ParquetTable(path) if path.suffix == ".parquet" else CsvTable(path)


def check_increasing(t: np.ndarray, table: Table) -> None:
    """Refuse time that does not increase from row to row.

    Args:
        t: Time of the first rows of the table, shape (rows,) [s].
        table: Where it comes from, for the message.

    Raises:
        InputError: the message names the first row that is at fault.
    """
    steps = np.diff(t)
    bad = np.flatnonzero(steps <= 0.0)
    if not len(bad):
        return
    row = int(bad[0]) + 1
    if steps[row - 1] == 0.0:
        raise InputError(f"{table.place(row)}: t repeats {t[row]:.10g} s; drop the row")
    raise InputError(f"{table.place(row)}: t decreases ({t[row]:.10g} after {t[row - 1]:.10g} s); sort or drop the row")


def _number(cell: object) -> float:
    """The number in a cell; NaN where there is none."""
    try:
        return float(str(cell))
    except ValueError:
        return float("nan")


def _read_csv(path: Path) -> tuple[list[int], list[list[str]]]:
    """Line numbers and cells of all rows that are not blank, header included."""
    lines: list[int] = []
    rows: list[list[str]] = []
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:  # -sig: a byte-order mark is dropped
            reader = csv.reader(stream)
            for row in reader:
                if row and (len(row) > 1 or row[0].strip()):
                    lines.append(reader.line_num)
                    rows.append(row)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text ({error.reason} at byte {error.start}); export it as CSV") from error
    except csv.Error as error:
        raise InputError(f"{path}: not comma-separated text ({error}); export it as CSV") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from error
    return lines, rows


def _read_parquet(path: Path) -> "pa.Table":
    import pyarrow as pa
    from pyarrow import parquet

    try:
        return parquet.read_table(path)
    except (pa.ArrowException, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: not a readable Parquet file ({reason}); write it again") from error
