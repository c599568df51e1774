"""The quadratic cost that several controllers minimise, and the state estimate that their loops run on."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wipx.control.controller import Controller
from wipx.control.ekf import Ekf, FilterNoise
from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model


@dataclass(frozen=True)
class QuadraticCost(Controller):
    """A controller that minimises the integral of y'Qy + u'Ru with y = [coordinates, rates].

    Attributes:
        coordinates: Diagonal of Q for each coordinate; a plant with one joint uses the first.
        rates: Diagonal of Q for each rate.
        command: Diagonal of R.
        rate: Of the controller [Hz].
        limit: Largest command [N or N m].
        noise: Standard deviations of `FilterNoise` that replace the usual ones in the estimate of `loop`, by name.
    """

    coordinates: tuple[float, ...] = (20.0, 100.0)
    rates: tuple[float, ...] = (2.0, 5.0)
    command: float = 0.2
    rate: float = 650.0
    limit: float = 100.0
    noise: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positive(command=self.command, rate=self.rate, limit=self.limit)
        FilterNoise.of(self.noise, "controller.noise")

    def weights(self, model: Model) -> tuple[np.ndarray, np.ndarray]:
        """Q, shape (2 joints, 2 joints), and R, shape (inputs, inputs).

        Raises:
            InputError: there are too few weights for the plant.
        """
        joints = len(model.plant.joints)
        if min(len(self.coordinates), len(self.rates)) < joints:
            raise InputError(
                f"controller: weights for {joints} joints are needed, got {self.coordinates} and {self.rates}"
            )
        states = np.diag([*self.coordinates[:joints], *self.rates[:joints]])
        return states, self.command * np.eye(len(model.plant.commands))

    def estimator(self, model: Model) -> Ekf:
        """A state estimate by the whole model."""
        return Ekf(model, FilterNoise.of(self.noise, "controller.noise"))


def optimal_gains(a: np.ndarray, b: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Gains K of u = -K y that minimise the integral of y'Qy + u'Ru under y' = A y + B u.

    Raises:
        InputError: no gains stabilise it.
    """
    import control

    try:
        gains, _, poles = control.lqr(a, b, q, r)
    except np.linalg.LinAlgError as error:
        raise InputError(f"controller: no stabilising gains for these weights ({error})") from error
    if np.max(np.real(poles)) >= 0.0:
        raise InputError(f"controller: the closed loop is not stable, poles {np.round(poles, 3).tolist()}")
    return np.asarray(gains)
