"""The window that an estimator of the balance sees: readings at even times from the release on, filled as they come."""

import numpy as np


class ReleaseWindow:
    """Linear interpolation of readings, one at a time, so that no step has to do it for all of them.

    Args:
        length: Samples.
        period: Time between them [s].
    """

    def __init__(self, length: int, period: float) -> None:
        self._length, self._period = length, period
        self.reset(0.0)

    def reset(self, t: float) -> None:
        """Forget the past; the robot is released at a time [s]."""
        self._times = (t + np.arange(self._length) * self._period).tolist()
        self._samples = np.full((self._length, 2), np.nan)
        self._filled = [0, 0]
        self._last: list[tuple[float, float] | None] = [None, None]

    def see(self, t: float, measured: np.ndarray) -> None:
        """Take note of x and theta at a time [s], NaN where a sensor had nothing new.

        The first reading of each counts from the release on.
        """
        for signal, value in enumerate(measured[:2].tolist()):
            if value == value:
                self._fill(signal, t, value)

    def samples(self) -> np.ndarray | None:
        """Samples of x and theta, shape (length, 2) [m, rad]; None where a sensor showed nothing yet.

        The last reading is held.
        """
        whole = self._samples.copy()
        for signal, (filled, last) in enumerate(zip(self._filled, self._last, strict=True)):
            if last is None:
                return None
            whole[filled:, signal] = last[1]
        return whole

    def _fill(self, signal: int, t: float, value: float) -> None:
        before, begun = self._last[signal] or (t, value)
        k = self._filled[signal]
        while k < self._length and self._times[k] <= t:
            share = (self._times[k] - before) / (t - before) if self._times[k] > before else 0.0
            self._samples[k, signal] = begun + share * (value - begun)
            k += 1
        self._filled[signal], self._last[signal] = k, (t, value)
