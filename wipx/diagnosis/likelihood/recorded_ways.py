"""Ways by recorded rates: what a rate of its own sensor tells of the scale of a coordinate's sensor.

The integral of the rate is the way of the coordinate, whatever moves it. A rate that is recorded late adds its lateness
times the change of the rate, and one with an offset a constant: both are taken out.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.results import NINETY_FIVE
from wipx.identify.sensors import scales_of
from wipx.identify.windows import Windows


@dataclass(frozen=True)
class Ways:
    """Ways of W joints in each of N windows, those whose recorded rates contradict the coordinates.

    Attributes:
        joints: Their indices, shape (W,).
        way: Integral of each rate from the window's start to its end, shape (N, W) [m or rad].
        change: By how much the rate changes meanwhile, shape (N, W) [m/s or rad/s].
    """

    joints: np.ndarray
    way: np.ndarray
    change: np.ndarray

    @classmethod
    def of(
        cls,
        recordings: tuple[Recording, ...],
        plant: Plant,
        windows: Windows,
        start: np.ndarray,
        end: np.ndarray,
        doubt: float,
    ) -> "Ways":
        """Ways between two rows of each window.

        Args:
            recordings: R of them.
            plant: Names their rates.
            windows: N of them.
            start: First row of each window's way, shape (N,).
            end: Last row, shape (N,).
            doubt: Relative standard deviation of a rate's scale; what contradicts it less tells nothing.
        """
        rows = windows.row + start, windows.row + end
        found = [
            (j, *_between(recordings, windows.recording, plant.rates[j], rows)) for j in _with_rate(recordings, plant)
        ]
        at = [windows.recorded[row, :, np.arange(windows.count)] for row in (start, end)]
        kept = [(j, way, change) for j, way, change in found if _contradicts(way, change, (at[1] - at[0])[:, j], doubt)]
        columns = [np.array([each[i] for each in kept]).reshape(len(kept), windows.count).T for i in (1, 2)]
        return cls(np.array([j for j, _, _ in kept], dtype=np.int64), *columns)

    def errors(self, batch: ModelBatch, recorded: np.ndarray) -> np.ndarray:
        """Ways of the coordinates, by the scale of their sensors, less those of the rates, shape (P, N, W).

        The eccentricity of an encoder is left out: over a short way it would do for any scale.

        Args:
            batch: The models.
            recorded: Coordinates at the start and at the end of every window, shape (N, 2, joints).
        """
        shown = (recorded[:, 1] - recorded[:, 0])[:, self.joints]
        errors = shown / scales_of(batch)[self.joints].T[:, None] - self.way
        for i, change in enumerate(self.change.T):
            known = np.column_stack([change, np.ones(len(change))])
            errors[:, :, i] -= errors[:, :, i] @ np.linalg.pinv(known).T @ known.T
        return errors


def _with_rate(recordings: tuple[Recording, ...], plant: Plant) -> list[int]:
    return [j for j, name in enumerate(plant.rates) if all(name in recording for recording in recordings)]


def _between(
    recordings: tuple[Recording, ...], recording: np.ndarray, name: str, rows: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Integral of a rate between two rows of each window, and its change, shape (N,) each."""
    way, change = np.zeros(len(recording)), np.zeros(len(recording))
    for r, one in enumerate(recordings):
        rate, here = one[name], recording == r
        passed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(one.t))])
        first, last = (row[here] for row in rows)
        way[here], change[here] = passed[last] - passed[first], rate[last] - rate[first]
    return way, change


def _contradicts(way: np.ndarray, change: np.ndarray, shown: np.ndarray, doubt: float) -> bool:
    """Whether a coordinate does not move as far as its rate says, with 95 % confidence.

    One that does may be what the rate was taken from. Windows overlap, each with the next.
    """
    known = np.column_stack([way, change, np.ones(len(way))])
    if len(way) <= 2 * known.shape[1] or np.ptp(way) == 0.0:
        return False
    numbers, *_ = np.linalg.lstsq(known, shown, rcond=None)
    left = shown - known @ numbers
    variance = 2.0 * float(left @ left) / (len(way) - known.shape[1]) * np.linalg.pinv(known.T @ known)[0, 0]
    return bool(abs(numbers[0] - 1.0) > NINETY_FIVE * np.sqrt(variance + doubt**2))
