"""Cascaded PID: position asks for a pitch, pitch asks for a force; what balancing robots are usually built with."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wipx.control.balance_watch import check_carriage
from wipx.control.controller import Controller, PitchEstimator
from wipx.control.ekf import Ekf, FilterNoise
from wipx.control.filtered_loop import FilteredLoop
from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise
from wipx.control.sampled import check_stabilises
from wipx.core.errors import check_positive
from wipx.core.model import Model


@dataclass(frozen=True)
class PidGains:
    """theta_ref = p e_x + i integral(e_x) + d e_x', limited; u = -(P (theta - theta_ref) + D theta').

    Attributes:
        pitch: P and D [N/rad, N s/rad].
        position: p, i and d [rad/m, rad/(m s), rad s/m].
    """

    pitch: tuple[float, float]
    position: tuple[float, float, float]


@dataclass(frozen=True)
class Pid(Controller):
    """Gains by a rule, from bandwidths that do not depend on the robot: poles of the nominal closed loop are placed.

    Two poles, of the pitch, lie at -`pitch_bandwidth` times the rate sqrt(a) at which the body falls while the wheels
    are free, theta'' = a theta + b u. Three, of position and integral, lie at -`position_bandwidth` times the zero
    sqrt(m_b L g / (m_b L^2 + I_b)) in the right half plane, beyond which the wheels answer to the wrong side first.

    Attributes:
        pitch_bandwidth: Of the inner loop, over that rate.
        position_bandwidth: Of the outer loop, over that zero.
        lean: Largest pitch that position may ask for; the integral does not grow beyond it [rad].
        rate: Of the controller [Hz].
        limit: Largest command [N].
        noise: Standard deviations of `FilterNoise` that replace the usual ones in the estimate of `loop`, by name.
    """

    pitch_bandwidth: float = 1.0
    position_bandwidth: float = 0.25
    lean: float = 0.3
    rate: float = 650.0
    limit: float = 100.0
    noise: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positive(
            pitch_bandwidth=self.pitch_bandwidth,
            position_bandwidth=self.position_bandwidth,
            lean=self.lean,
            rate=self.rate,
            limit=self.limit,
        )
        FilterNoise.of(self.noise, "controller.noise")

    def gains(self, model: Model) -> PidGains:
        """By the rule, for a model's rigid body.

        Raises:
            InputError: the robot is no body on a carriage.
        """
        check_carriage(model)
        import control

        linear, p = linearise(model), model.parameters
        arm = p["body_mass"] * p["com_height"]
        zero = np.sqrt(arm * p["gravity"] / (arm * p["com_height"] + p["body_inertia"]))
        falls = np.sqrt(linear.a[3, 1])
        poles = np.repeat([-self.pitch_bandwidth * falls, -self.position_bandwidth * zero], [2, 3])
        a = np.zeros((5, 5))
        a[:4, :4], a[4, 0] = linear.a, 1.0
        x, P, v, D, total = np.ravel(control.acker(a, np.vstack([linear.b, [[0.0]]]), poles)).tolist()
        return PidGains((P, D), (-x / P, -total / P, -v / P))

    def law(self, model: Model) -> LinearLaw:
        """The same as gains on the state and on the integral of the position.

        Raises:
            InputError: as in `gains`.
        """
        gains = self.gains(model)
        (P, D), (p, i, d) = gains.pitch, gains.position
        return LinearLaw(np.array([[-P * p, P, -P * d, D]]), np.array([[-P * i]]), np.array([[1.0, 0.0, 0.0, 0.0]]))

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> "PidRegulator":
        """The gains for a model's rigid body, on a state estimated with the whole model.

        Raises:
            InputError: as in `gains`, or they do not stabilise the whole model.
        """
        check_stabilises(self.law(model), model, self.rate)
        return PidRegulator(Ekf(model, FilterNoise.of(self.noise, "controller.noise")), self.gains(model), self)


class PidRegulator(FilteredLoop):
    """The cascade, with a limited pitch reference.

    Attributes:
        gains: Of both loops.
        integral: Of the position's error [m s].
    """

    def __init__(self, estimator: Ekf, gains: PidGains, settings: Pid) -> None:
        super().__init__(estimator, settings.rate, settings.limit)
        self.gains = gains
        self._lean = settings.lean
        self._forget(0.0)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; see `Loop.reset`."""
        super().reset(t, measured)
        self._forget(t)

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit; see `FilteredLoop.wanted`."""
        (P, D), (p, i, d) = self.gains.pitch, self.gains.position
        error = state - reference
        most = self._lean / i
        self.integral = float(np.clip(self.integral + (t - self._t) * self._error, -most, most))
        self._t, self._error = t, float(error[0])
        lean = float(np.clip(p * error[0] + i * self.integral + d * error[2], -self._lean, self._lean))
        return np.array([-(P * (error[1] - lean) + D * error[3])])

    def _forget(self, t: float) -> None:
        self._t, self._error, self.integral = t, 0.0, 0.0
