"""Linear quadratic regulator on the linearised plant: the paper's baseline controller."""

from dataclasses import dataclass

from wipx.control.controller import PitchEstimator
from wipx.control.cost import QuadraticCost, optimal_gains
from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise
from wipx.control.regulator import Regulator
from wipx.control.sampled import check_stabilises
from wipx.core.model import Model
from wipx.sim.simulator import StateFeedback


@dataclass(frozen=True)
class LqrDesign(QuadraticCost):
    """u = -K (y - y_ref), K minimising the cost."""

    def feedback(self, model: Model) -> StateFeedback:
        """The gains for a model's rigid body.

        Raises:
            InputError: the weights do not fit the plant or give no stabilising gains.
        """
        linear = linearise(model)
        gains = optimal_gains(linear.a, linear.b, *self.weights(model))
        return StateFeedback(gains, limit=self.limit)

    def law(self, model: Model) -> LinearLaw:
        """The same gains as a linear law.

        Raises:
            InputError: as in `feedback`.
        """
        return LinearLaw.of(self.feedback(model).gains)


@dataclass(frozen=True)
class Lqr(LqrDesign):
    """Holds the reference that it is given."""

    def state_feedback(self, model: Model) -> StateFeedback:
        """It is one; see `feedback`."""
        return self.feedback(model)

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> Regulator:
        """The gains for a model's rigid body, on a state estimated with the whole model.

        Raises:
            InputError: as in `feedback`, or the gains do not stabilise the whole model.
        """
        check_stabilises(self.law(model), model, self.rate)
        return Regulator(self.estimator(model), self.feedback(model), self.rate)
