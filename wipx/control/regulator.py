"""State feedback on an estimated state: what runs at the robot's rate."""

import numpy as np

from wipx.control.ekf import Ekf
from wipx.control.filtered_loop import FilteredLoop
from wipx.sim.simulator import StateFeedback


class Regulator(FilteredLoop):
    """u = -K (y - y_ref), limited, with y by an extended Kalman filter.

    Attributes:
        feedback: Gains and limit; its rate filter is not used, the estimator gives rates.
    """

    def __init__(self, estimator: Ekf, feedback: StateFeedback, rate: float) -> None:
        super().__init__(estimator, rate, feedback.limit)
        self.feedback = feedback

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit; see `FilteredLoop.wanted`."""
        return -self.feedback.gains @ (state - reference)
