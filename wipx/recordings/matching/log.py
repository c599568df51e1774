"""Logs as they are found: numeric columns with any names, and which of them is the time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.errors import InputError
from wipx.recordings.matching.names import words_of
from wipx.recordings.tables import Table, open_table
from wipx.recordings.units import factor_to_si

TIME = {"t", "time", "timestamp", "stamp", "secs", "seconds", "clock", "elapsed"}
RATES = (5.0, 20000.0)  # [Hz] that logs of moving robots have
TIME_UNITS = ("s", "ms", "us", "ns")
FEWEST = 50  # rows


@dataclass(frozen=True, eq=False)
class Log:
    """A log with its time in seconds.

    Attributes:
        path: The file.
        columns: Numeric columns but the time, as logged, shape (rows,) each.
        time: Name of the time's column.
        unit: Its unit.
        begin: First time, in that unit.
        t: Time from the first row on, shape (rows,) [s].
        skipped: Columns that hold something else than numbers in every row.
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    time: str
    unit: str
    begin: float
    t: np.ndarray
    skipped: tuple[str, ...]

    @property
    def rate(self) -> float:
        """Rows per second [Hz]."""
        return 1.0 / float(np.median(np.diff(self.t)))


def read_log(path: Path) -> Log:
    """A CSV or Parquet file of one run.

    Raises:
        InputError: the file cannot be read, is too short, or has no column of time.
    """
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(f"{path}: expected a .csv or .parquet file; task=import reads other formats")
    table = open_table(path)
    if table.rows < FEWEST:
        raise InputError(f"{path}: {table.rows} rows, expected {FEWEST} or more; leave the file out")
    numbers, skipped = _numeric(table)
    name = _time_column(numbers, path)
    t = numbers.pop(name)
    unit = _time_unit(name, t, path)
    return Log(path, numbers, name, unit, float(t[0]), factor_to_si(unit) * (t - t[0]), skipped)


def same_columns(logs: Sequence[Log]) -> tuple[str, ...]:
    """Columns that all logs have, in the order of the first.

    Raises:
        InputError: the logs measure time differently.
    """
    first = logs[0]
    for log in logs[1:]:
        if (log.time, log.unit) != (first.time, first.unit):
            raise InputError(
                f"{log.path}: time is {log.time} in {log.unit}, in {first.path} {first.time} in {first.unit}; "
                "set up logs of different kinds one by one"
            )
    return tuple(name for name in first.columns if all(name in log.columns for log in logs))


def _numeric(table: Table) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    numbers, skipped = {}, []
    for name in dict.fromkeys(table.names):
        try:
            numbers[name] = table.column(name)
        except InputError:
            skipped.append(name)
    return numbers, tuple(skipped)


def _time_column(numbers: Mapping[str, np.ndarray], path: Path) -> str:
    rising = [name for name, values in numbers.items() if np.all(np.diff(values) > 0.0)]
    named = [name for name in numbers if TIME & set(words_of(name))]
    for name in named:
        if name in rising:
            return name
    if named:
        values = numbers[named[0]]
        row = int(np.flatnonzero(np.diff(values) <= 0.0)[0]) + 1
        raise InputError(
            f"{path} row {row + 1}: {named[0]} does not increase ({values[row]:.10g} after {values[row - 1]:.10g}); "
            "sort or drop the row"
        )
    if len(rising) == 1 and not np.all(np.diff(numbers[rising[0]]) == 1.0):
        return rising[0]
    have = ", ".join(numbers)
    raise InputError(f"{path}: no column of time among {have}; name one t (seconds from row to row increasing)")


def _time_unit(name: str, t: np.ndarray, path: Path) -> str:
    words = words_of(name)
    if len(words) > 1 and words[-1] in TIME_UNITS:
        return words[-1]
    step = float(np.median(np.diff(t)))
    for unit in TIME_UNITS:
        if RATES[0] <= 1.0 / (step * factor_to_si(unit)) <= RATES[1]:
            return unit
    raise InputError(
        f"{path}: {name} increases by {step:g} from row to row, which is no usual rate in s, ms, us or ns; "
        f"convert it to seconds ({RATES[0]:g} to {RATES[1]:g} rows a second)"
    )
