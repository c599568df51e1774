"""A robot that is released with a load nobody has weighed: five numbers in, position and pitch out.

The numbers are pitch of balance, mass and height of the load, position and pitch at the release. Pitch stands in for
the load's side: a window tells it best, and where it is a number of its own the others hardly change it, so that the
valley of a fit is straight.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.identify.closed_loop import FELL_OVER, Sampling
from wipx.learn.loads import carrying, equilibria
from wipx.learn.observed import Viewing
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator, StateFeedback

PITCH, MASS, HEIGHT, START = 0, 1, 2, slice(3, 5)  # of the numbers [rad, kg, m, (m, rad)]
NARROWEST = np.array([0.02, 5e-3, 5e-3])  # of the prior on a load whose range is a single value [kg, m, m]


@dataclass(frozen=True)
class Fall:
    """A robot under its controller, released with one load after the other.

    Attributes:
        model: The robot without load.
        simulator: The engine.
        feedback: The controller.
        rate: Of the controller [Hz].
        viewing: When the robot is looked at.
    """

    model: Model
    simulator: Simulator
    feedback: StateFeedback
    rate: float
    viewing: Viewing

    def seen(self, numbers: np.ndarray) -> np.ndarray:
        """Position and pitch at the samples, without noise and on an endless rail, shape (P, L, 2) [m, rad].

        Args:
            numbers: Shape (P, 5).
        """
        rows = Sampling(np.arange(self.viewing.length) * self.viewing.period, self.rate).rows
        inputs = Inputs.regular(rows[-1] / self.rate, self.rate, len(self.model.plant.commands))
        robots = carrying(ModelBatch(self.model), self.loads(numbers))
        initial = np.zeros((4, len(numbers), 1))
        initial[:2, :, 0] = numbers[:, START].T
        references = np.zeros((len(inputs.t) - 1, 4, 1))
        run = self.simulator.close_loop(robots, inputs, initial, self.feedback, references)
        seen = np.moveaxis(run.coordinates[rows, :, :, 0], 2, 0)
        return np.clip(np.nan_to_num(seen, nan=FELL_OVER), -FELL_OVER, FELL_OVER)

    def loads(self, numbers: np.ndarray) -> np.ndarray:
        """Mass, height and side of each load, shape (P, 3) [kg, m, m]; `Load` says how side moves the balance."""
        body = self.model.parameters
        mass, height = numbers[:, MASS], numbers[:, HEIGHT]
        up = body["body_mass"] * body["com_height"] + mass * height
        return np.column_stack([mass, height, up * np.tan(numbers[:, PITCH]) / mass])

    def numbers(self, loads: np.ndarray) -> np.ndarray:
        """Of releases upright at x = 0 with loads (P, 3), shape (P, 5)."""
        pitch = equilibria(carrying(ModelBatch(self.model), loads))
        return np.column_stack([pitch, loads[:, :2], np.zeros((len(loads), 2))])


@dataclass(frozen=True)
class Prior:
    """What is known of load and release before a window is seen.

    Attributes:
        mean: Of mass, height, side, and position and pitch at the release, shape (5,) [kg, m, m, m, rad].
        whitening: Turns a distance from it into independent standard deviations, shape (5, 5).
        low: Least numbers that a fit may take, shape (5,): no mass or height below those of the training set.
        high: Largest, shape (5,).
    """

    mean: np.ndarray
    whitening: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, loads: np.ndarray, release: tuple[float, float]) -> "Prior":
        """The normal distribution that resembles loads (N, 3) [kg, m, m], and the releases of a `Viewing`."""
        covariance = np.zeros((5, 5))
        covariance[:3, :3] = np.cov(loads.T) + np.diag(NARROWEST**2)
        covariance[3:, 3:] = np.diag(np.square(release))
        mean = np.concatenate([loads.mean(axis=0), np.zeros(2)])
        high = np.full(5, np.inf)
        low = -high
        low[[MASS, HEIGHT]], high[[MASS, HEIGHT]] = loads[:, :2].min(axis=0), loads[:, :2].max(axis=0)
        return cls(mean, np.linalg.inv(np.linalg.cholesky(covariance)), low, high)

    def distances(self, loads: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """From the mean, in independent standard deviations, shape (P, 5)."""
        return (np.column_stack([loads, starts]) - self.mean) @ self.whitening.T


@dataclass(frozen=True)
class Bank:
    """Falls that are simulated once, so that a fit begins near its end.

    Attributes:
        numbers: Of each, shape (B, 5).
        seen: What is seen of it, shape (B, L, 2) [m, rad].
        scale: Size of each signal, by which distances are measured, shape (2,) [m, rad].
    """

    numbers: np.ndarray
    seen: np.ndarray
    scale: np.ndarray

    def nearest(self, windows: np.ndarray, moving: np.ndarray) -> np.ndarray:
        """Numbers of the fall nearest to each window, over the samples that count, shape (N, 5)."""
        chosen = np.empty(len(windows), dtype=int)
        for n, (window, counted) in enumerate(zip(windows, moving, strict=True)):
            distances = (self.seen[:, counted] - window[counted]) / self.scale
            chosen[n] = np.argmin(np.sum(distances**2, axis=(1, 2)))
        return self.numbers[chosen]
