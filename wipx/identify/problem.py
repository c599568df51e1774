"""What an optimizer minimises: prediction errors of windows, as a function of the unit cube."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from wipx.identify.parameter_space import ParameterSpace
from wipx.identify.prediction import Prediction, Predictor

SLOPE_STEP = 1e-4  # of the search interval
TOLERATED = 5.0  # times the median window's error; beyond it a window counts less
LARGEST_CALL = 4_000_000  # numbers of one batch of rollouts, about 32 MB


class Problem(Protocol):
    """A loss over the unit cube, and the residuals whose squares it is made of."""

    @property
    def space(self) -> ParameterSpace:
        """The numbers that vary."""
        ...

    @property
    def valleys(self) -> int:
        """From how many starts a local search should be tried, so that one finds the lowest minimum."""
        ...

    @property
    def differences(self) -> int:
        """Evaluations that `jacobian` takes for each number that varies."""
        ...

    @property
    def near(self) -> bool:
        """Whether the start is near the minimum."""
        ...

    @property
    def short(self) -> "Problem | None":
        """The same over windows so short that its loss has hardly more than one minimum; None where there are none."""
        ...

    def smoothed(self, level: float) -> "Problem":
        """The same problem with dry friction smoothed by `level`; 0 for the problem itself."""
        ...

    def losses(self, cube: np.ndarray) -> np.ndarray:
        """Losses (P,) at positions (P, D): mean squared residual, 1 = the noise."""
        ...

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        """Residuals (N,) at a position (D,), in standard deviations."""
        ...

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        """Their slopes (N, D), by differences over a `size` of each coordinate (D,)."""
        ...


@dataclass(frozen=True)
class WindowProblem:
    """Prediction errors of all windows, the states re-estimated for every candidate.

    Attributes:
        space: The numbers that vary.
        predictor: Windows and how to predict them; its `noise` weighs the signals.
        speeds: What each joint reaches, shape (joints,) [m/s or rad/s]; measures the smoothing.
        weights: How much each window counts, shape (R,); None for all alike.
        near: Whether the start is near the minimum.
        short: The same over shorter windows, from whose minimum a search begins; None for none.
    """

    space: ParameterSpace
    predictor: Predictor
    speeds: tuple[float, ...]
    weights: np.ndarray | None = None
    near: bool = False
    short: "WindowProblem | None" = None
    _last: list[tuple[np.ndarray, Prediction]] = field(default_factory=list, compare=False, repr=False)

    @property
    def valleys(self) -> int:
        """Few: a window is short, and begins where the candidate would have it begin."""
        return 1 if self.near or self.short else 2

    @property
    def differences(self) -> int:
        """Two: they are central."""
        return 2

    def smoothed(self, level: float) -> "WindowProblem":
        """The same problem with dry friction that builds up over a share `level` of the joints' speeds."""
        smoothing = tuple(level * speed for speed in self.speeds)
        simulator = self.predictor.simulator.smoothed(smoothing)
        return replace(self, predictor=replace(self.predictor, simulator=simulator), _last=[])

    def losses(self, cube: np.ndarray) -> np.ndarray:
        """Mean squared residual and priors of every candidate, shape (P,)."""
        cube = np.atleast_2d(cube)
        count = self._rows()
        return np.array([np.sum(part**2) / count for part in self._residuals_of(cube)])

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        """Residuals of the predicted rows, then of the priors, shape (N,)."""
        prediction = self._prediction_near(cube)
        flat = self._flat(self.predictor.residuals(prediction.coordinates, self.predictor.windows.predicted))
        return np.concatenate([flat[0], self.space.prior_residuals(cube)[0]])

    def _prediction_near(self, cube: np.ndarray) -> Prediction:
        """The prediction at a position (D,), its states estimated from those of the position before."""
        if self._last and np.array_equal(self._last[0][0], cube):
            return self._last[0][1]
        near = self._last[0][1].initial if self._last else None
        prediction = self.predictor.predict(self.space.batch(cube), near)
        self._last[:] = [(cube.copy(), prediction)]
        return prediction

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        """Slopes of `residuals` by central differences, shape (N, D); the state follows the parameters.

        Args:
            cube: Position, shape (D,).
            size: Finite-difference step of each coordinate; at least `SLOPE_STEP`. A sticking
                joint answers in jumps, which a larger step averages.
        """
        reach = np.maximum(np.broadcast_to(size, cube.shape), SLOPE_STEP)
        above, below = np.minimum(cube + reach, 1.0), np.maximum(cube - reach, 0.0)
        moved = np.concatenate([_replaced(cube, above), _replaced(cube, below)])
        base = self.space.batch(cube)
        prediction = self._prediction_near(cube)
        known, gain = self.predictor.state_gain(base, prediction.initial)
        rows = []
        for part in chunks(len(moved), self._chunk()):
            batch = self.space.batch(moved[part])
            state = np.repeat(prediction.initial, batch.size, axis=1)
            change = self.predictor.known_residuals(batch, state) - known
            state = state + self.predictor.correction(gain, change)
            rows.append(self._flat(self.predictor.predicted_residuals(batch, state)))
        flat = np.concatenate(rows)
        flat = np.concatenate([flat, self.space.prior_residuals(moved)], axis=1)
        dimension = len(cube)
        return ((flat[:dimension] - flat[dimension:]) / (above - below)[:, None]).T

    def by_window(self, rows: np.ndarray) -> list[np.ndarray]:
        """Indices of `residuals` that belong to each window; the priors are windows of their own.

        Args:
            rows: Any array of `residuals`' length, for its size.
        """
        windows = self.predictor.windows
        joints = windows.recorded.shape[1]
        window_of = np.broadcast_to(np.arange(windows.count), (len(windows.predicted), joints, windows.count))
        labels = window_of[self._mask()]
        groups = [np.flatnonzero(labels == r) for r in range(windows.count)]
        return groups + [np.array([i]) for i in range(len(labels), len(rows))]

    def scores(self, cube: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """What each window, and each prior, adds to half the slope of the loss at a position (D,), shape (pieces, D).

        Args:
            cube: Position.
            slopes: Of `residuals` there, shape (N, D).
        """
        residuals = self.residuals(cube)
        return np.array([slopes[rows].T @ residuals[rows] for rows in self.by_window(residuals)])

    def reweighted(self, cube: np.ndarray) -> "WindowProblem":
        """The same problem, each signal weighed by the error that it has at a position (D,)."""
        plain = replace(self, weights=None, _last=[])
        residuals = plain.residuals(cube)[: self._rows()]
        joints = self.predictor.windows.recorded.shape[1]
        joint_of = np.broadcast_to(np.arange(joints)[:, None], self._mask().shape)[self._mask()]
        # The median, since a few windows may have fallen over.
        sizes = np.array([np.median(np.abs(residuals[joint_of == j])) / 0.6745 for j in range(joints)])
        noise = self.predictor.noise * np.maximum(sizes, 1e-3)
        return replace(self, predictor=replace(self.predictor, noise=noise), _last=[])

    def tempered(self, cube: np.ndarray) -> "WindowProblem":
        """The same problem, in which windows that are far off at a position (D,) count less (Huber 1964).

        An unstable plant that is left alone falls to one side or the other; one such window
        would outweigh all others.
        """
        plain = replace(self, weights=None, _last=[])
        residuals = plain.residuals(cube)
        groups = plain.by_window(residuals)[: self.predictor.windows.count]
        sizes = np.array([np.sqrt(np.mean(residuals[g] ** 2)) for g in groups])
        limit = TOLERATED * max(float(np.median(sizes)), 1.0)
        return replace(self, weights=np.minimum(1.0, limit / np.maximum(sizes, 1e-300)), _last=[])

    def _rows(self) -> int:
        return int(self._mask().sum())

    def _mask(self) -> np.ndarray:
        predicted = self.predictor.windows.predicted
        joints = self.predictor.windows.recorded.shape[1]
        return np.broadcast_to(predicted[:, None, :], (len(predicted), joints, predicted.shape[1]))

    def _flat(self, residuals: np.ndarray) -> np.ndarray:
        """From (K + 1, joints, P, R) to (P, N)."""
        weighed = residuals if self.weights is None else residuals * self.weights
        return np.moveaxis(weighed, 2, 0)[:, self._mask()]

    def _chunk(self) -> int:
        windows = self.predictor.windows
        numbers = windows.recorded.size * (2 * windows.recorded.shape[1] + 1)
        return max(1, LARGEST_CALL // numbers)

    def _residuals_of(self, cube: np.ndarray):
        for part in chunks(len(cube), self._chunk()):
            prediction: Prediction = self.predictor.predict(self.space.batch(cube[part]))
            flat = self._flat(self.predictor.residuals(prediction.coordinates, self.predictor.windows.predicted))
            priors = self.space.prior_residuals(cube[part])
            for i in range(len(flat)):
                yield np.concatenate([flat[i], priors[i]])


def _replaced(cube: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Copies of a position (D,), in each of which one coordinate is replaced, shape (D, D)."""
    copies = np.repeat(cube[None], len(cube), axis=0)
    np.fill_diagonal(copies, values)
    return copies


def chunks(count: int, size: int) -> Iterator[slice]:
    """Slices of at most `size` that cover `count` items."""
    return (slice(i, min(i + size, count)) for i in range(0, count, size))
