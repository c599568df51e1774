"""Equilibrium pitch by a disturbance observer: an extended Kalman filter whose state has the pitch of balance in it.

The balance is a state that wanders slowly, the mass of the load one that does not change (augmented state: Simon 2006,
Optimal State Estimation, ch. 13). A robot that falls faster than its body, its friction and its own commands explain is
off its balance: what an observer of the generalised momentum attributes to an external torque (De Luca and Mattone
2003), the filter attributes to the balance. Commands are not part of a window; they follow from the filter's state
and the known gains.

Where on the body the load sits the filter does not know, so its estimate is biased. A straight line that is fitted
to the training part corrects it, and the noise that the filter reckons with is chosen there too.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from wipx.core.errors import InputError
from wipx.learn.conformal import half_width
from wipx.learn.estimator import COVERAGE, PitchEstimate, Watcher, Workshop, check_windows
from wipx.learn.loaded_body import LoadedBody
from wipx.learn.observed import Parts, Viewing
from wipx.learn.training_set import TrainingSet

REACH = 1e-5  # [m, rad, m/s, rad/s, rad, kg] of central differences
REST = (1e-4, 1e-4)  # [m/s, rad/s]; standard deviation of the rates of a robot at rest
RATIO = 10.0**0.5  # between standard deviations of the noise that are tried
DIVERGED = 1.0  # [rad]; a balance that is further away is not believed


@dataclass(frozen=True)
class ObserverNoise:
    """Standard deviations that the filter reckons with.

    Attributes:
        sensor: Of every sample [m, rad].
        push: Unknown accelerations, as white noise [m/s^2 sqrt(s), rad/s^2 sqrt(s)].
        wander: Of the balance [rad/sqrt(s)].
    """

    sensor: float = 5e-3
    push: float = 3e-3
    wander: float = 1e-3

    def neighbours(self) -> list["ObserverNoise"]:
        """Each standard deviation smaller or larger by `RATIO`."""
        return [
            replace(self, **{name: getattr(self, name) * factor})
            for name in ("sensor", "push", "wander")
            for factor in (1.0 / RATIO, RATIO)
        ]


@dataclass(frozen=True)
class BalanceFilter:
    """The filter, before its estimate is corrected.

    Attributes:
        body: What it predicts with.
        viewing: Of the windows.
        guess: Balance and mass of the load before anything is seen, shape (2,) [rad, kg].
        uncertainty: Their standard deviations, shape (2,).
        noise: Of sensors and process.
    """

    body: LoadedBody
    viewing: Viewing
    guess: np.ndarray
    uncertainty: np.ndarray
    noise: ObserverNoise

    def balance(self, windows: np.ndarray) -> np.ndarray:
        """Pitch of balance after the last sample that counts, shape (N,) [rad]."""
        moving = self.viewing.moving(windows)
        states = np.tile([*np.zeros(4), *self.guess], (len(windows), 1))
        covariance = np.tile(np.diag([*self.viewing.release, *REST, *self.uncertainty]) ** 2, (len(windows), 1, 1))
        with np.errstate(over="ignore", invalid="ignore"):  # of a window that no robot shows, the filter may diverge
            for k in range(self.viewing.length):
                going = moving[:, k]  # the balance of a robot that was stopped is that of its last sample
                if not going.any():
                    break
                state, uncertainty = states[going], covariance[going]
                if k:
                    state, uncertainty = self._predicted(state, uncertainty)
                states[going], covariance[going] = self._corrected(state, uncertainty, windows[going, k])
        return np.clip(np.nan_to_num(states[:, 4], nan=self.guess[0]), -DIVERGED, DIVERGED)

    def _predicted(self, states: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """State (N, 6) and covariance (N, 6, 6) one sample later."""
        period, size = self.viewing.period, states.shape[1]
        moves = REACH * np.concatenate([np.zeros((1, size)), np.eye(size), -np.eye(size)])
        later = self.body.moved(np.moveaxis(states[:, None] + moves, 2, 0), period)
        slopes = np.moveaxis(later[:, :, 1 : size + 1] - later[:, :, size + 1 :], 0, 1) / (2.0 * REACH)
        added = np.diag([0.0, 0.0, self.noise.push, self.noise.push, self.noise.wander, 0.0]) ** 2 * period
        return later[:, :, 0].T, slopes @ covariance @ slopes.swapaxes(1, 2) + added

    def _corrected(self, states, covariance, shown) -> tuple[np.ndarray, np.ndarray]:
        """State and covariance after position and pitch (N, 2) were shown."""
        innovation = covariance[:, :2, :2] + self.noise.sensor**2 * np.eye(2)
        gains = np.linalg.solve(innovation, covariance[:, :2]).swapaxes(1, 2)
        new = states + np.einsum("nij,nj->ni", gains, shown - states[:, :2])
        narrowed = covariance - gains @ covariance[:, :2]
        return new, 0.5 * (narrowed + narrowed.swapaxes(1, 2))


@dataclass(frozen=True)
class Line:
    """pitch = offset + slope * balance.

    Attributes:
        offset: [rad].
        slope: [1].
    """

    offset: float
    slope: float

    @classmethod
    def through(cls, balance: np.ndarray, pitch: np.ndarray) -> "Line":
        """The line of least squares; level where all balances (N,) are the same."""
        variance = np.var(balance)
        slope = float(np.mean((balance - balance.mean()) * (pitch - pitch.mean())) / variance) if variance else 0.0
        return cls(float(pitch.mean() - slope * balance.mean()), slope)

    def at(self, balance: np.ndarray) -> np.ndarray:
        """Corrected pitches, shape (N,) [rad]."""
        return self.offset + self.slope * balance


@dataclass(frozen=True)
class MomentumObserver:
    """Follows every window with one filter.

    Attributes:
        windows: Of the training part on which the noise is chosen, at most.
        rounds: Of the search for them, at most; each tries every standard deviation smaller and larger.
    """

    windows: int = 200
    rounds: int = 8

    def __post_init__(self) -> None:
        if self.windows < 1 or self.rounds < 0:
            raise InputError(
                f"estimator: windows={self.windows} and rounds={self.rounds}, expected 1 or more and 0 or more"
            )

    def prepare(self, workshop: Workshop, watcher: Watcher) -> "ObserverEstimator":
        """Choose noise and line on the training part, calibrate on the whole validation part.

        Args:
            workshop: Robots, model and controller; nothing is written to its folder.
            watcher: Told the stage and the share that is done.

        Raises:
            InputError: the model cannot carry a load, the training set has no robots to learn from or too few to
                calibrate the interval, or values that are not finite.
        """
        viewing, parts = Viewing.of(workshop.training), Parts.of(workshop.training)
        train, validation = parts.train, parts.validation
        body = LoadedBody.of(workshop.model, train.loads, workshop.feedback[0])
        guess = np.array([train.pitch.mean(), train.loads[:, 0].mean()])
        uncertainty = np.array([train.pitch.std(), train.loads[:, 0].std()])
        chosen = self._chosen(BalanceFilter(body, viewing, guess, uncertainty, ObserverNoise()), train, watcher)
        line = Line.through(chosen.balance(train.windows.astype(float)), train.pitch)
        estimator = ObserverEstimator(chosen, line, 0.0)
        errors = estimator.estimate(validation.windows).pitch - validation.pitch
        watcher("calibrating the interval", 1.0)
        return replace(estimator, half_width=half_width(errors, COVERAGE))

    def _chosen(self, first: BalanceFilter, train: TrainingSet, watcher: Watcher) -> BalanceFilter:
        """The noise with the least error of corrected estimates, by a search along each."""
        windows, pitch = train.windows[: self.windows].astype(float), train.pitch[: self.windows]

        def error(noise: ObserverNoise) -> float:
            balance = replace(first, noise=noise).balance(windows)
            return float(np.mean((Line.through(balance, pitch).at(balance) - pitch) ** 2))

        errors = {first.noise: error(first.noise)}
        best = first.noise
        for number in range(self.rounds):
            watcher("choosing the noise", number / self.rounds)
            errors |= {noise: error(noise) for noise in best.neighbours() if noise not in errors}
            before, best = best, min(errors, key=errors.__getitem__)
            if best == before:
                break
        return replace(first, noise=best)


@dataclass(frozen=True)
class ObserverEstimator:
    """Ready to follow.

    Attributes:
        filter: Follows a window.
        line: Corrects its balance.
        half_width: Of the 90 % interval [rad].
    """

    filter: BalanceFilter = field(repr=False)
    line: Line
    half_width: float

    @property
    def length(self) -> int:
        """Samples of a window."""
        return self.filter.viewing.length

    @property
    def period(self) -> float:
        """Time between them [s]."""
        return self.filter.viewing.period

    def estimate(self, windows: np.ndarray) -> PitchEstimate:
        """See `Estimator.estimate`."""
        check_windows(windows, self.length, self.period)
        pitch = self.line.at(self.filter.balance(windows.astype(float)))
        return PitchEstimate(pitch, pitch - self.half_width, pitch + self.half_width)
