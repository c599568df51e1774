"""How noisy the sensors are, read off the recordings themselves."""

from dataclasses import dataclass

import numpy as np

from wipx.core.plant import Plant
from wipx.core.recording import Recording

BLOCK = 100  # rows in which the motion is compared with itself
QUIET = 0.3  # share of the blocks that is quiet; costs 7 % of the estimate on white noise


@dataclass(frozen=True)
class LastingNoise:
    """Noise of the sensors that lasts, a first-order autoregression.

    Attributes:
        deviations: Standard deviation by coordinate [m or rad].
        times: Correlation time by coordinate [s].
    """

    deviations: tuple[float, ...]
    times: tuple[float, ...]

    def drawn(self, t: np.ndarray, count: int) -> np.ndarray:
        """Courses of the noise at times (K + 1, R), shape (K + 1, R, joints, count); the same at every call."""
        drawn = np.random.default_rng(0).normal(size=(*t.shape, len(self.times), count))
        kept = np.exp(-np.diff(t, axis=0)[:, :, None] / np.array(self.times))[..., None]
        for k in range(len(kept)):
            drawn[k + 1] = kept[k] * drawn[k] + np.sqrt(1.0 - kept[k] ** 2) * drawn[k + 1]
        return drawn * np.array(self.deviations)[:, None]


def sensor_noise(recordings: tuple[Recording, ...], plant: Plant) -> np.ndarray:
    """Standard deviation of each coordinate's noise, shape (joints,) [m or rad].

    Fourth differences of a smooth motion vanish; those of white noise have a variance of
    1 + 16 + 36 + 16 + 1 = 70 times the noise. The quieter blocks count, since
    fast motion leaves differences too. At least the deviation of a uniform quantisation step.
    """
    return np.array([_noise_of([r[column] for r in recordings]) for column in plant.coordinates])


def low_passed(recordings: tuple[Recording, ...], plant: Plant, share: float) -> float | None:
    """Frequency above which no signal has any power to speak of [Hz]; None where one has noise of its own.

    Second differences of white noise have nine tenths of their power in the upper half of the band of frequencies;
    those of signals that a filter has smoothed have hardly any there.

    Args:
        recordings: Of one robot.
        plant: Says which columns are coordinates and commands.
        share: Of that power in the upper half, below which a signal counts as smoothed.
    """
    highest = 0.0
    for column in (*plant.coordinates, *plant.commands):
        for recording in recordings:
            bent = np.diff(recording[column], 2)
            power = np.abs(np.fft.rfft((bent - bent.mean()) * np.hanning(len(bent)))) ** 2
            below = np.cumsum(power) / max(float(power.sum()), 1e-300)
            if power.sum() > 0.0 and 1.0 - below[len(below) // 2] > share:
                return None
            top = int(np.searchsorted(below, 1.0 - share)) / max(len(below) - 1, 1)
            highest = max(highest, 0.5 * top * recording.rate if power.sum() > 0.0 else 0.0)
    return highest or None


def quantisation(series: list[np.ndarray]) -> float:
    """Smallest step between different values, if the sensor shows one; else 0."""
    values = np.unique(np.concatenate(series))
    steps = np.diff(values)
    steps = steps[steps > 1e-12 * max(1.0, np.abs(values).max())]
    return float(steps.min()) if len(steps) else 0.0


def _noise_of(series: list[np.ndarray]) -> float:
    deviations = []
    for values in series:
        fourth = np.diff(values, 4)
        blocks = [fourth[i : i + BLOCK] for i in range(0, max(len(fourth) - BLOCK, 0) + 1, BLOCK)]
        deviations += [1.4826 * np.median(np.abs(b)) / np.sqrt(70.0) for b in blocks if len(b)]
    white = float(np.quantile(deviations, QUIET)) if deviations else 0.0
    floor = quantisation(series) / np.sqrt(12.0)
    scale = float(np.std(np.concatenate(series)))
    return max(white, floor, 1e-6 * scale, 1e-9)
