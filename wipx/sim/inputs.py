"""Inputs of rollouts: windows of time and command, side by side in one array."""

from dataclasses import dataclass, field, replace

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
        ramps: By how much the command changes along each row about its mean, shape (K, inputs, R); None
            where commands are held.
        spread: Half width by which single commands scatter about the mean of a row, shape (inputs,), or (1,) where it
            is the same for all: zero where every command is in the log. Thresholds of the actuator answer to them.
    """

    t: np.ndarray
    commands: np.ndarray
    first: np.ndarray
    last: np.ndarray
    ramps: np.ndarray | None = None
    spread: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def __post_init__(self) -> None:
        # The kernel is compiled anew for every layout in memory.
        object.__setattr__(self, "t", np.ascontiguousarray(self.t))

    @classmethod
    def of(
        cls,
        times: list[np.ndarray],
        commands: list[np.ndarray],
        first: list[int],
        periods: tuple[int, ...] | None = None,
        spread: np.ndarray | None = None,
    ) -> "Inputs":
        """Windows from one array of times (rows,) and commands (rows, inputs) each.

        Args:
            times: Times of each window's rows [s].
            commands: Commands of each window's rows; that of the last row is not used.
            first: Row from which each window is integrated.
            periods: Commands of the controller per row of each window, whose mean the log has; None for
                one. Their course is then taken for a straight line between the neighbouring rows.
            spread: How single commands scatter about that mean, shape (inputs,); None for not at all.
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
        ramps = None
        if periods is not None and max(periods) > 1:
            ramps = np.zeros_like(u)
            for r, (window_t, window_u) in enumerate(zip(times, commands, strict=True)):
                ramps[: len(window_t) - 1, :, r] = _ramps(window_t, window_u, periods[r])
        last = np.array([len(x) - 1 for x in times], dtype=np.int64)
        return cls(t, u, np.array(first, dtype=np.int64), last, ramps, np.zeros(1) if spread is None else spread)

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
        ramps = None if self.ramps is None else self.ramps[: rows - 1]
        last = np.minimum(self.last, last)
        return replace(self, t=self.t[:rows], commands=self.commands[: rows - 1], last=last, ramps=ramps)


def _ramps(t: np.ndarray, commands: np.ndarray, periods: int) -> np.ndarray:
    """Change of the command along each row, shape (rows - 1, inputs).

    A staircase of n equal steps over a row has the first moment of a ramp 1 - 1/n^2 as high.
    """
    interval = np.diff(t)
    held = commands[:-1]
    middle = t[:-1] + 0.5 * interval
    slopes = np.gradient(held, middle, axis=0) if len(held) > 1 else np.zeros_like(held)
    return (1.0 - 1.0 / periods**2) * slopes * interval[:, None]
