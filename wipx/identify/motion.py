"""Rates and accelerations from recorded coordinates, by derivatives of a Gaussian.

Everything that is compared with an acceleration passes the same filter: commands and friction too (parallel
filtering; Gautier, Janot, Vandanjon 2013, IEEE TCST 21(2)). What the filter takes away it then takes from both sides.
A local polynomial (Savitzky, Golay 1964) would filter accelerations and commands differently.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from wipx.core.plant import Plant
from wipx.core.recording import Recording

FINEST = 4e-3  # [s] of the grid; a finer one makes fits slower and no better, since the filter is much wider
SHORTEST = 1.5  # rows, of the Gaussian's deviation; a shorter one is not sampled finely enough
LONGEST = 0.05  # [s] likewise; slower filters wipe out what happens at a reversal
FINER = 1.15  # ratio of deviations that are tried one after the other
NOISE_SHARE = 0.02  # of a joint's acceleration that sensor noise may make up
RESTING = 3.0  # standard deviations of a rate that count as no motion
REACH = 6.0  # deviations at which the Gaussian ends; a shorter one leaks coordinates into accelerations


@dataclass(frozen=True)
class Motion:
    """One recording on an even grid of time, smoothed.

    Attributes:
        t: Time, shape (N,) [s].
        coordinates: Smoothed, shape (N, joints) [m, rad].
        rates: Shape (N, joints).
        accelerations: Shape (N, joints).
        width: Deviation of the Gaussian [rows].
        rest_speeds: What sensor noise feigns as speed, shape (joints,) [m/s or rad/s]; slower joints are at rest.
        edges: Times of the recording's own rows, shape (rows,) [s].
        impulse: Integral of the held commands up to those times, shape (rows, inputs).
    """

    t: np.ndarray
    coordinates: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    width: float
    rest_speeds: np.ndarray
    edges: np.ndarray
    impulse: np.ndarray

    @property
    def step(self) -> float:
        """Time between rows of the grid [s]."""
        return float(self.t[1] - self.t[0])

    def commands(self, delay: float = 0.0) -> np.ndarray:
        """Mean command around each row, as it was a `delay` [s] before, not filtered, shape (N, inputs)."""
        return _means(self.t - delay, self.edges, self.impulse, self.step)

    def filtered(self, values: np.ndarray) -> np.ndarray:
        """The same filter on a signal of the grid, shape (N, ...)."""
        return smooth(values, self.width)

    @property
    def kept(self) -> slice:
        """Rows that a fit uses: away from the ends, one for each deviation of the Gaussian."""
        edge = int(REACH * self.width)
        return slice(edge, max(len(self.t) - edge, edge + 1), max(1, int(self.width)))


def smooth(values: np.ndarray, width: float, order: int = 0) -> np.ndarray:
    """A derivative of the smoothed signal, per row to that power, shape (N, ...)."""
    return gaussian_filter1d(values, width, axis=0, order=order, mode="nearest", truncate=REACH)


def motions(
    recordings: tuple[Recording, ...], plant: Plant, noise: np.ndarray, *, wider: float = 1.0
) -> tuple[Motion, ...]:
    """Smooth recordings, all with the same filter.

    Args:
        recordings: What to smooth.
        plant: Says which columns are coordinates and commands.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        wider: Width of the filter over that of the narrowest one that suits the noise.
    """
    row = float(np.median(np.concatenate([np.diff(r.t) for r in recordings])))
    step = max(row, FINEST)
    noise = noise * np.sqrt(row / step)
    grids = [_grid(r, plant, step) for r in recordings]
    width = wider * _width([q for _, q in grids], step, noise)
    rest_speeds = RESTING * noise * _leak(width, 1) / step
    smoothed = []
    for recording, (t, q) in zip(recordings, grids, strict=True):
        derived = (smooth(q, width, order) / step**order for order in range(3))
        held = recording.stack(plant.commands)[:-1] * np.diff(recording.t)[:, None]
        impulse = np.concatenate([np.zeros((1, held.shape[1])), np.cumsum(held, axis=0)])
        coordinates, rates, accelerations = derived
        smoothed.append(Motion(t, coordinates, rates, accelerations, width, rest_speeds, recording.t, impulse))
    return tuple(smoothed)


def _grid(recording: Recording, plant: Plant, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Even times, and the mean of the coordinates over a step around each, shapes (N,) and (N, joints)."""
    t = recording.t[0] + np.arange(int(recording.duration / step) + 1) * step
    q = recording.stack(plant.coordinates)
    between = 0.5 * (q[1:] + q[:-1]) * np.diff(recording.t)[:, None]
    return t, _means(t, recording.t, np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(between, axis=0)]), step)


def _means(t: np.ndarray, edges: np.ndarray, integral: np.ndarray, step: float) -> np.ndarray:
    """Mean of a signal over a step around each time, shape (N, columns).

    Args:
        t: Times, shape (N,) [s].
        edges: Times at which the signal's integral is known, shape (rows,) [s].
        integral: The integral there, shape (rows, columns).
        step: Length of the mean [s].
    """
    late, early = np.clip([t + 0.5 * step, t - 0.5 * step], edges[0], edges[-1])
    ends = [np.column_stack([np.interp(side, edges, column) for column in integral.T]) for side in (late, early)]
    return (ends[0] - ends[1]) / np.maximum(late - early, 1e-9)[:, None]


def _width(coordinates: list[np.ndarray], step: float, noise: np.ndarray) -> float:
    """The narrowest Gaussian behind which noise is a small share of every joint's acceleration [rows]."""
    width = SHORTEST
    while FINER * width * step < LONGEST:
        accelerations = np.concatenate([smooth(q, width, order=2) for q in coordinates])
        if np.all(noise * _leak(width, 2) < NOISE_SHARE * np.std(accelerations, axis=0)):
            break
        width *= FINER
    return width


def _leak(width: float, order: int) -> float:
    """Standard deviation of a derivative of smoothed white noise of unit size."""
    impulse = np.zeros(2 * int(REACH * width) + 3)
    impulse[len(impulse) // 2] = 1.0
    return float(np.linalg.norm(smooth(impulse, width, order)))


def independent_rows(residual: np.ndarray) -> float:
    """Rows of white noise that tell as much as coloured ones, shape (rows, joints): N (1 - r)/(1 + r).

    A filter and unknown forces both leave neighbouring rows alike; a criterion that took them for independent would
    never find a model that is good enough.
    """
    centred = residual - residual.mean(axis=0)
    alike = np.sum(centred[1:] * centred[:-1], axis=0) / np.maximum(np.sum(centred**2, axis=0), 1e-300)
    colour = float(np.clip(np.max(alike), 0.0, 0.98))
    return len(residual) * (1.0 - colour) / (1.0 + colour)
