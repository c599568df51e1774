"""Recordings: named columns over time, immutable, in SI; the same type from files, simulators and robots."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from wipx.core.errors import InputError


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples of one run.

    `u` (or `u1`, `u2`) of row k acts from t[k] until t[k + 1]; coordinates and rates are as the
    sensors show them at t[k]. Time steps may be uneven.

    Attributes:
        name: File name, or a label.
        columns: Arrays of shape (rows,) by column name of contract section 1, `t` among them [SI].
        source: File or origin, for messages.
        periods: Commands of the controller per row: 1 where `u` is the command that was held, more where it
            is their mean because the log is slower than the loop.
    """

    name: str
    columns: Mapping[str, np.ndarray]
    source: str = ""
    periods: int = 1

    def __post_init__(self) -> None:
        frozen = {}
        for name, values in self.columns.items():
            array = np.array(values, dtype=float)
            array.setflags(write=False)
            frozen[name] = array
        lengths = {len(array) for array in frozen.values()}
        if "t" not in frozen or len(lengths) != 1:
            raise ValueError(
                f"{self.name}: columns must share one length and hold t, got {sorted(frozen)} of {lengths}"
            )
        object.__setattr__(self, "columns", MappingProxyType(frozen))

    def __reduce__(self):
        return Recording, (self.name, dict(self.columns), self.source, self.periods)

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]

    def __contains__(self, column: str) -> bool:
        return column in self.columns

    def __len__(self) -> int:
        return len(self.t)

    @property
    def t(self) -> np.ndarray:
        """Time, strictly increasing, shape (rows,) [s]."""
        return self.columns["t"]

    @property
    def duration(self) -> float:
        """From the first row to the last [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def rate(self) -> float:
        """Rows per second, by the median time step [Hz]."""
        return 1.0 / float(np.median(np.diff(self.t)))

    @property
    def missing(self) -> np.ndarray:
        """Rows that the log lacks between each row and the next, shape (rows - 1,)."""
        return np.maximum(np.rint(np.diff(self.t) * self.rate) - 1.0, 0.0)

    def stack(self, columns: tuple[str, ...]) -> np.ndarray:
        """Columns side by side, shape (rows, len(columns))."""
        return np.column_stack([self.columns[name] for name in columns])

    def rows(self, first: int, last: int) -> "Recording":
        """Rows first <= k < last; times are kept."""
        return Recording(self.name, {n: a[first:last] for n, a in self.columns.items()}, self.source, self.periods)

    def between(self, begin: float, end: float) -> "Recording":
        """Rows with begin <= t < end [s]; times are kept."""
        first, last = np.searchsorted(self.t, (begin, end), side="left")
        return self.rows(int(first), int(last))


@dataclass(frozen=True)
class RecordingSplit:
    """Recordings to fit a model to, and others to judge it by.

    Attributes:
        fit: Recordings that an identification may use.
        held_out: Recordings (or later parts of recordings) that it never sees.
        rule: How they were divided, for the report.
    """

    fit: tuple[Recording, ...]
    held_out: tuple[Recording, ...]
    rule: str

    def __post_init__(self) -> None:
        if not self.fit:
            raise InputError("recordings: none left to fit; leave at least one out of the held-out part")
