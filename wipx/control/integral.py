"""Linear quadratic regulator with integral action: what is usually done against a load nobody knows.

Young and Willems 1972, An approach to the linear multivariable servomechanism problem, Int. J. Control 15(5).
"""

from dataclasses import dataclass

import numpy as np

from wipx.control.controller import PitchEstimator
from wipx.control.cost import QuadraticCost, optimal_gains
from wipx.control.ekf import Ekf
from wipx.control.filtered_loop import FilteredLoop
from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise
from wipx.control.sampled import check_stabilises
from wipx.core.errors import check_positive
from wipx.core.model import Model


@dataclass(frozen=True)
class Lqi(QuadraticCost):
    """u = -(K e + H m), m the integral of the driven coordinates' errors, weighed in the cost like the states.

    Attributes:
        integral: Diagonal of Q for each integral.
        integral_limit: Largest share of an integral in the command [N or N m]; it does not grow beyond that, or it
            would wind up while the robot cannot follow.
    """

    integral: float = 20.0
    integral_limit: float = 50.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive(integral=self.integral, integral_limit=self.integral_limit)

    def law(self, model: Model) -> LinearLaw:
        """The gains for a model's rigid body and the integrals.

        Raises:
            InputError: the weights do not fit the plant or give no stabilising gains.
        """
        linear, (q, r) = linearise(model), self.weights(model)
        states, driven = len(linear.a), [model.plant.joints.index(site) for site in model.plant.actuated]
        intake = np.eye(states)[driven]
        count = len(driven)
        a = np.block([[linear.a, np.zeros((states, count))], [intake, np.zeros((count, count))]])
        b = np.vstack([linear.b, np.zeros((count, linear.b.shape[1]))])
        weights = np.zeros((states + count, states + count))
        weights[:states, :states], weights[states:, states:] = q, self.integral * np.eye(count)
        gains = optimal_gains(a, b, weights, r)
        return LinearLaw(gains[:, :states], gains[:, states:], intake)

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> "IntegralRegulator":
        """The gains for a model's rigid body, on a state estimated with the whole model.

        Raises:
            InputError: as in `law`, or the gains do not stabilise the whole model.
        """
        law = self.law(model)
        check_stabilises(law, model, self.rate)
        return IntegralRegulator(self.estimator(model), law, self.rate, self.limit, self.integral_limit)


class IntegralRegulator(FilteredLoop):
    """A linear law with memory, which is bounded.

    Attributes:
        law: The gains.
        memory: Integrals, shape (memories,) [m s or rad s].
    """

    def __init__(self, estimator: Ekf, law: LinearLaw, rate: float, limit: float, integral_limit: float) -> None:
        super().__init__(estimator, rate, limit)
        self.law = law
        self._most = integral_limit / np.abs(law.memory_gains).max(axis=0)
        self._forget(0.0)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; see `Loop.reset`."""
        super().reset(t, measured)
        self._forget(t)

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit; see `FilteredLoop.wanted`."""
        grown = self.memory + (t - self._t) * (self.law.intake @ self._error)
        self.memory = np.clip(grown, -self._most, self._most)
        self._t, self._error = t, state - reference
        return -(self.law.gains @ self._error + self.law.memory_gains @ self.memory)

    def _forget(self, t: float) -> None:
        self.memory = np.zeros(len(self.law.intake))
        self._t, self._error = t, np.zeros(self.law.gains.shape[1])
