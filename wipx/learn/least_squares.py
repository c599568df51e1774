"""Equilibrium pitch by least squares: the load whose simulated fall resembles the window best.

The load on the completed model and the place of the release are fitted to one window by a few Levenberg-Marquardt steps
(Nocedal and Wright 2006, Numerical Optimization, ch. 10). The loop is closed in the simulation, since commands are not
part of a window. What a window does not tell is left to a Gaussian prior, the loads of the training set;
nothing else is learned from these.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from wipx.core.errors import InputError
from wipx.identify.problem import chunks
from wipx.learn.conformal import half_width
from wipx.learn.estimator import COVERAGE, PitchEstimate, Watcher, Workshop, check_windows
from wipx.learn.fall import PITCH, START, Bank, Fall, Prior
from wipx.learn.observed import Parts, Viewing

REACH = np.array([2e-4, 4e-3, 1e-3, 2e-4, 1e-4])  # of differences [rad, kg, m, m, rad]; less than what a fit leaves
FINEST = 1e-5  # [m, rad]; least noise that is believed: a weight needs some
STARTS = 64  # loads of the training set among which a fit begins at the nearest: one block of the simulator
AT_ONCE = 4096  # rollouts in one call
SETTLED = 1e-5  # [rad] of pitch in a step, below which a fit has ended
DAMPING, STIFFEST = 1e-3, 1e4  # of a step, relative to the curvature: at first, and where a fit ends


@dataclass(frozen=True)
class LeastSquares:
    """Fits a load to every window.

    Attributes:
        steps: Of Levenberg-Marquardt, at most, with equal weights; as many again with each signal's own.
    """

    steps: int = 12

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise InputError(f"estimator.steps is {self.steps}, expected 1 or more")

    def prepare(self, workshop: Workshop, watcher: Watcher) -> "LeastSquaresEstimator":
        """Read the prior off the training part, simulate the starts, calibrate on the whole validation part.

        Args:
            workshop: Robots, model, engine and controller; nothing is written to its folder.
            watcher: Told the stage and the share that is done.

        Raises:
            InputError: the model cannot carry a load, the training set has no robots to learn from or too few to
                calibrate the interval, or values that are not finite.
        """
        viewing, parts = Viewing.of(workshop.training), Parts.of(workshop.training)
        train, validation = parts.train, parts.validation
        feedback, rate = workshop.feedback
        fall = Fall(workshop.model, workshop.simulator, feedback, rate, viewing)
        starts = fall.numbers(train.loads[:STARTS])
        scale = np.sqrt(np.mean(train.windows.astype(float) ** 2, axis=(0, 1)))
        bank = Bank(starts, fall.seen(starts), scale)
        estimator = LeastSquaresEstimator(fall, Prior.of(train.loads, viewing.release), bank, self.steps, 0.0)
        watcher("calibrating the interval", 0.0)
        errors = estimator.estimate(validation.windows).pitch - validation.pitch
        watcher("calibrating the interval", 1.0)
        return replace(estimator, half_width=half_width(errors, COVERAGE))


@dataclass(frozen=True)
class Linearised:
    """Fits about N sets of numbers.

    Attributes:
        numbers: Shape (N, 5).
        errors: Simulated minus seen, zero where a sample does not count, shape (N, L, 2) [m, rad].
        slopes: By the numbers, shape (N, L, 2, 5).
        distances: From the prior's mean, in standard deviations, shape (N, 5).
        distance_slopes: Shape (N, 5, 5), the numbers last.
    """

    numbers: np.ndarray
    errors: np.ndarray
    slopes: np.ndarray
    distances: np.ndarray
    distance_slopes: np.ndarray

    def some(self, which: np.ndarray) -> "Linearised":
        """Some of them."""
        return Linearised(
            self.numbers[which],
            self.errors[which],
            self.slopes[which],
            self.distances[which],
            self.distance_slopes[which],
        )

    def loss(self, noise: np.ndarray) -> np.ndarray:
        """Squares of all that is off, in units of the noise (N, 2) and of the prior, shape (N,)."""
        return np.sum((self.errors / noise[:, None]) ** 2, axis=(1, 2)) + np.sum(self.distances**2, axis=1)

    def stepped(self, noise: np.ndarray, damping: np.ndarray, prior: Prior) -> np.ndarray:
        """Numbers at the damped minimum, shape (N, 5); one at a bound that would pass it stays there."""
        slopes, errors = self.slopes / noise[:, None, :, None], self.errors / noise[:, None]
        gradient = np.einsum("nlsd,nls->nd", slopes, errors)
        gradient += np.einsum("npd,np->nd", self.distance_slopes, self.distances)
        curvature = np.einsum("nlsd,nlse->nde", slopes, slopes)
        curvature += np.einsum("npd,npe->nde", self.distance_slopes, self.distance_slopes)
        diagonal = np.einsum("ndd->nd", curvature)[:, None] * np.eye(len(REACH))
        free = np.where(gradient > 0.0, self.numbers > prior.low, self.numbers < prior.high)
        damped = curvature + damping[:, None, None] * diagonal
        held = np.where(free[:, :, None] & free[:, None], damped, diagonal)
        step = np.linalg.solve(held, (gradient * free)[:, :, None])[:, :, 0]
        return np.clip(self.numbers - step, prior.low, prior.high)


@dataclass(frozen=True)
class LeastSquaresEstimator:
    """Ready to fit.

    Attributes:
        fall: Simulates candidates.
        prior: On what is fitted.
        bank: Where fits begin.
        steps: As in `LeastSquares`.
        half_width: Of the 90 % interval [rad].
    """

    fall: Fall = field(repr=False)
    prior: Prior = field(repr=False)
    bank: Bank = field(repr=False)
    steps: int
    half_width: float

    @property
    def length(self) -> int:
        """Samples of a window."""
        return self.fall.viewing.length

    @property
    def period(self) -> float:
        """Time between them [s]."""
        return self.fall.viewing.period

    def estimate(self, windows: np.ndarray) -> PitchEstimate:
        """See `Estimator.estimate`."""
        pitch = self.fitted(windows)[:, PITCH]
        return PitchEstimate(pitch, pitch - self.half_width, pitch + self.half_width)

    def fitted(self, windows: np.ndarray) -> np.ndarray:
        """The numbers of `wipx.learn.fall` that fit each window, shape (N, 5); arguments as of `estimate`."""
        check_windows(windows, self.length, self.period)
        windows = windows.astype(float)
        moving = self.fall.viewing.moving(windows)
        numbers = self.bank.nearest(windows, moving)
        for part in chunks(len(windows), AT_ONCE // (1 + len(REACH))):
            # Begun with weights of its own, a poor fit would trust the one signal that happens to fit, and stay there.
            for equal in (True, False):
                numbers[part] = self._fit(windows[part], moving[part], numbers[part], equal_weights=equal)
        return numbers

    def _fit(self, windows: np.ndarray, moving: np.ndarray, numbers: np.ndarray, *, equal_weights: bool) -> np.ndarray:
        """Levenberg-Marquardt for all windows side by side; those that have settled leave the batch."""
        numbers = numbers.copy()
        going = np.arange(len(windows))
        now = self._linearised(numbers, windows, moving)
        damping = np.full(len(windows), DAMPING)
        for _ in range(self.steps):
            noise = _noise(now.errors, moving[going], equal_weights=equal_weights)
            tried = self._linearised(now.stepped(noise, damping, self.prior), windows[going], moving[going])
            better = tried.loss(noise) <= now.loss(noise)
            moved = np.abs(tried.numbers[:, PITCH] - now.numbers[:, PITCH])
            now = _chosen(better, tried, now)
            numbers[going] = now.numbers
            damping *= np.where(better, 0.1, 10.0)
            unsettled = (moved > SETTLED) & (damping < STIFFEST)
            if not unsettled.any():
                break
            going, damping, now = going[unsettled], damping[unsettled], now.some(unsettled)
        return numbers

    def _linearised(self, numbers: np.ndarray, windows: np.ndarray, moving: np.ndarray) -> Linearised:
        """One call of the simulator: every set of numbers, and each of its numbers moved by its reach."""
        count, moved = len(numbers), 1 + len(REACH)
        around = (numbers[:, None] + np.vstack([np.zeros(len(REACH)), np.diag(REACH)])).reshape(-1, len(REACH))
        seen = self.fall.seen(around).reshape(count, moved, *windows.shape[1:])
        distances = self.prior.distances(self.fall.loads(around), around[:, START]).reshape(count, moved, -1)
        counted = moving[:, :, None]
        return Linearised(
            numbers,
            (seen[:, 0] - windows) * counted,
            np.moveaxis((seen[:, 1:] - seen[:, :1]) * counted[:, None], 1, 3) / REACH,
            distances[:, 0],
            np.moveaxis(distances[:, 1:] - distances[:, :1], 1, 2) / REACH,
        )


def _chosen(first: np.ndarray, one: Linearised, other: Linearised) -> Linearised:
    """Of each pair the first where `first` (N,) says so."""
    both = zip(vars(one).values(), vars(other).values(), strict=True)
    return Linearised(*(np.where(first.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in both))


def _noise(errors: np.ndarray, moving: np.ndarray, *, equal_weights: bool) -> np.ndarray:
    """Standard deviation of what a fit leaves, shape (N, 2) [m, rad]: it weighs the signals, and the prior.

    With equal weights a millimetre counts as much as a milliradian, as in the paper's Eq. 6 and 7.
    """
    freedom = np.maximum(moving.sum(axis=1) - 0.5 * len(REACH), 1.0)
    variance = np.sum(errors**2, axis=1) / freedom[:, None]
    if equal_weights:
        variance = np.repeat(variance.mean(axis=1, keepdims=True), 2, axis=1)
    return np.maximum(np.sqrt(variance), FINEST)
