"""State feedback on an estimated state: what runs at the robot's rate."""

import numpy as np

from wipx.control.ekf import Ekf
from wipx.sim.simulator import StateFeedback


class Regulator:
    """u = -K (y - y_ref), limited, with y by an extended Kalman filter; a `wipx.control.loop.Loop`.

    Attributes:
        estimator: Gives the state.
        feedback: Gains and limit; its rate filter is not used, the estimator gives rates.
        rate: Steps per second [Hz].
    """

    def __init__(self, estimator: Ekf, feedback: StateFeedback, rate: float) -> None:
        self.estimator = estimator
        self.feedback = feedback
        self.rate = rate

    @property
    def state(self) -> np.ndarray:
        """Estimated coordinates, then rates, shape (2 joints,) [m, rad, m/s, rad/s]."""
        return self.estimator.state

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; see `Loop.reset`."""
        self.estimator.reset(t, measured)

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands for a reading, shape (inputs,) [N or N m]; see `Loop.step`."""
        state = self.estimator.observe(t, measured)
        limit = self.feedback.limit
        commands = np.clip(-self.feedback.gains @ (state - reference), -limit, limit)
        self.estimator.send(t, commands)
        return commands
