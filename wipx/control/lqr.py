"""Linear quadratic regulator on the linearised plant: the paper's baseline controller."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wipx.control.ekf import Ekf, FilterNoise
from wipx.control.linearise import linearise
from wipx.control.regulator import Regulator
from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model
from wipx.sim.simulator import StateFeedback


@dataclass(frozen=True)
class Lqr:
    """u = -K (y - y_ref), K minimising the integral of y'Qy + u'Ru.

    Attributes:
        coordinates: Diagonal of Q for each coordinate; a plant with one joint uses the first.
        rates: Diagonal of Q for each rate.
        command: Diagonal of R.
        rate: Of the controller [Hz].
        rate_filter: Time constant of the low-pass on differenced coordinates [s]; None where the
            rates are measured.
        limit: Largest command [N or N m].
        noise: Levels of `FilterNoise` that replace the usual ones in the state estimate of `loop`, by name.
    """

    coordinates: tuple[float, ...] = (20.0, 100.0)
    rates: tuple[float, ...] = (2.0, 5.0)
    command: float = 0.2
    rate: float = 650.0
    rate_filter: float | None = 0.005
    limit: float = 100.0
    noise: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positive(command=self.command, rate=self.rate, limit=self.limit)
        FilterNoise.of(self.noise, "controller.noise")

    def feedback(self, model: Model) -> StateFeedback:
        """The gains for a model's rigid body.

        Raises:
            InputError: the weights do not fit the plant or give no stabilising gains.
        """
        import control

        joints = len(model.plant.joints)
        if min(len(self.coordinates), len(self.rates)) < joints:
            raise InputError(
                f"controller: weights for {joints} joints are needed, got {self.coordinates} and {self.rates}"
            )
        linear = linearise(model)
        weights = np.diag([*self.coordinates[:joints], *self.rates[:joints]])
        try:
            gains, _, poles = control.lqr(linear.a, linear.b, weights, self.command * np.eye(linear.b.shape[1]))
        except np.linalg.LinAlgError as error:
            raise InputError(f"controller: no stabilising gains for these weights ({error})") from error
        if np.max(np.real(poles)) >= 0.0:
            raise InputError(f"controller: the closed loop is not stable, poles {np.round(poles, 3).tolist()}")
        return StateFeedback(np.asarray(gains), self.rate_filter, self.limit)

    def loop(self, model: Model) -> Regulator:
        """The gains for a model's rigid body, on a state estimated with the whole model.

        Raises:
            InputError: as in `feedback`.
        """
        estimator = Ekf(model, FilterNoise.of(self.noise, "controller.noise"))
        return Regulator(estimator, self.feedback(model), self.rate)
