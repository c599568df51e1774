"""Inputs of rollouts: windows of time and command, side by side in one array."""

from dataclasses import dataclass

import numpy as np

AFTER_THE_END = 1e9  # [s]; time of the padding rows, later than anything


@dataclass(frozen=True)
class Inputs:
    """R windows of rows, the shorter ones padded.

    Attributes:
        t: Time of each row, shape (K + 1, R) [s]; padding lies far in the future.
        commands: Command of each row, acting until the next, shape (K, inputs, R).
        first: Row from which each window is integrated, shape (R,); rows before it are only
            remembered, for transport delays.
        last: Last row of each window, shape (R,).
    """

    t: np.ndarray
    commands: np.ndarray
    first: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, times: list[np.ndarray], commands: list[np.ndarray], first: list[int]) -> "Inputs":
        """Windows from one array of times (rows,) and commands (rows, inputs) each.

        Args:
            times: Times of each window's rows [s].
            commands: Commands of each window's rows; that of the last row is not used.
            first: Row from which each window is integrated.
        """
        rows = max(len(t) for t in times)
        windows = len(times)
        t = np.full((rows, windows), AFTER_THE_END)
        u = np.zeros((rows - 1, commands[0].shape[1], windows))
        for r, (window_t, window_u) in enumerate(zip(times, commands, strict=True)):
            n = len(window_t)
            t[:n, r] = window_t
            u[: n - 1, :, r] = window_u[: n - 1]
            u[n - 1 :, :, r] = window_u[n - 2]
        return cls(t, u, np.array(first, dtype=np.int64), np.array([len(x) - 1 for x in times], dtype=np.int64))

    @classmethod
    def regular(cls, duration: float, rate: float, inputs: int, windows: int = 1) -> "Inputs":
        """Windows at a fixed `rate` [Hz] over a `duration` [s], without commands."""
        rows = round(duration * rate) + 1
        t = np.repeat((np.arange(rows) / rate)[:, None], windows, axis=1)
        zeros = np.zeros(windows, dtype=np.int64)
        return cls(t, np.zeros((rows - 1, inputs, windows)), zeros, zeros + rows - 1)

    @property
    def windows(self) -> int:
        """Number of windows R."""
        return self.t.shape[1]

    def substeps(self, step: float) -> np.ndarray:
        """Integration steps of at most `step` [s] from each row to the next, shape (K, R)."""
        k = np.arange(len(self.t) - 1)[:, None]
        inside = (k >= self.first) & (k < self.last)
        intervals = np.diff(self.t, axis=0)
        # A billionth of slack: 1.0000000001 ms is one step of 1 ms.
        counts = np.ceil(np.where(inside, intervals, 0.0) / step - 1e-9)
        return np.where(inside, np.maximum(counts, 1.0), 0.0).astype(np.int64)

    def until(self, last: np.ndarray) -> "Inputs":
        """The same windows cut after row `last` (R,) each."""
        rows = int(last.max()) + 1
        return Inputs(self.t[:rows], self.commands[: rows - 1], self.first, np.minimum(self.last, last))
