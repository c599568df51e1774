"""How noisy the sensors are, read off the recordings themselves."""

import numpy as np

from wipx.core.plant import Plant
from wipx.core.recording import Recording

BLOCK = 100  # rows in which the motion is compared with itself
QUIET = 0.3  # share of the blocks that is quiet; costs 7 % of the estimate on white noise


def sensor_noise(recordings: tuple[Recording, ...], plant: Plant) -> np.ndarray:
    """Standard deviation of each coordinate's noise, shape (joints,) [m or rad].

    Fourth differences of a smooth motion vanish; those of white noise have a variance of
    1 + 16 + 36 + 16 + 1 = 70 times the noise. The quieter blocks count, since
    fast motion leaves differences too. At least the deviation of a uniform quantisation step.
    """
    return np.array([_noise_of([r[column] for r in recordings]) for column in plant.coordinates])


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
