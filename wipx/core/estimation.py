"""What an experiment with an estimator of the equilibrium pitch leaves: the type that tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Judged:
    """Estimates beside the truth.

    Attributes:
        pitch: Equilibrium pitch of each robot, shape (N,) [rad].
        estimate: Its estimate, shape (N,).
        low: Lower end of its 90 % interval, shape (N,).
        high: Upper end.
    """

    pitch: np.ndarray
    estimate: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def mse(self) -> float:
        """Mean squared error [rad^2]."""
        return float(np.mean((self.estimate - self.pitch) ** 2))

    @property
    def rmse(self) -> float:
        """Root mean squared error [rad]."""
        return float(np.sqrt(self.mse))

    @property
    def coverage(self) -> float:
        """Share of the robots whose pitch lies in its interval."""
        return float(np.mean((self.low <= self.pitch) & (self.pitch <= self.high)))


@dataclass(frozen=True)
class EstimationResult:
    """One estimator of the equilibrium pitch, judged on simulated and recorded robots.

    Attributes:
        method: How its training simulation came about (paper, Sec. V-C).
        estimator: Its kind.
        length: Samples of its window.
        period: Time between them [s].
        seed: Of training set and training.
        target: Kind of robot that was recorded: emulated or real hardware.
        simulated: On simulated robots of the test part, which no training saw.
        recorded: On recorded trials, which no adaptation saw.
        latency: Median time of one estimate of one window, one thread [s].
        seconds: Of training or calibration [s].
        card: Where the training set came from.
    """

    method: str
    estimator: str
    length: int
    period: float
    seed: int
    target: str
    simulated: Judged
    recorded: Judged
    latency: float
    seconds: float
    card: Mapping[str, object]
