"""Extended Kalman filter: the state of a robot from its motor encoder, its IMU and its own commands.

Simon 2006, Optimal State Estimation, ch. 13. It predicts with a completed model over uneven steps, through the
command delay that the model knows, and corrects with whatever sensors had something new.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from wipx.control.motion import correct, propagate
from wipx.core.errors import check_positive, unknown_name
from wipx.core.model import Model, ModelBatch
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients, joint_index

EASE_SLIDING = 0.01  # [m/s] over which dry friction builds up; a joint that sticks shows less, a robot that rolls more
EASE_TURNING = 0.05  # [rad/s]


@dataclass(frozen=True)
class FilterNoise:
    """Standard deviations that the filter reckons with.

    Attributes:
        position: Of a coordinate x [m]; an encoder of 24 um steps has 7 um.
        angle: Of an angle [rad]; more than an IMU's white noise, since its error wanders for some 10 ms.
        velocity: Of x_dot [m/s]; 12 bits over +-76 rad/s of a wheel of 6 cm are steps of 2.3 mm/s.
        angular_rate: Of a gyro [rad/s].
        force: Unknown forces on sliding joints, as white noise [N sqrt(s)]; a friction of 2 N that changes after 0.1 s.
        torque: Unknown torques on turning joints [N m sqrt(s)].
    """

    position: float = 2e-5
    angle: float = 2e-3
    velocity: float = 1.5e-3
    angular_rate: float = 4e-3
    force: float = 1.0
    torque: float = 0.05

    def __post_init__(self) -> None:
        check_positive(**{f"noise.{item.name}": getattr(self, item.name) for item in fields(self)})

    @classmethod
    def of(cls, deviations: Mapping[str, float], where: str) -> "FilterNoise":
        """The usual standard deviations, some of them replaced.

        Raises:
            InputError: there is no such noise; `where` names the key that holds them.
        """
        known = [item.name for item in fields(cls)]
        for name in deviations:
            if name not in known:
                raise unknown_name("noise", name, known, where)
        return cls(**dict(deviations))


class Ekf:
    """State estimate of one robot; `reset`, then `observe` and `send` in turn.

    Attributes:
        model: What it predicts with.
        noise: What it reckons with.
    """

    def __init__(self, model: Model, noise: FilterNoise | None = None) -> None:
        self.model = model
        self.noise = noise or FilterNoise()
        known = coefficients(ModelBatch(model))
        joints = [joint_index(model.plant, site) for site in model.plant.joints]
        self._body, self._blocks = (np.ascontiguousarray(known[..., 0]) for known in (known.body, known.joints))
        self._double = model.plant.kind == "double_pendulum"
        self._states = np.array([*joints, *(2 + j for j in joints)])
        self._driven = np.array([joint_index(model.plant, site) for site in model.plant.actuated])
        self._delay = float(self._blocks[self._driven[0], R.DELAY])
        self._ease, self._density, self._variance = np.ones(2), np.zeros(2), np.ones(4)
        for site, j in zip(model.plant.joints, joints, strict=True):
            turning = model.plant.is_angular(site)
            self._ease[j] = EASE_TURNING if turning else EASE_SLIDING
            self._density[j] = (self.noise.torque if turning else self.noise.force) ** 2
            self._variance[j] = (self.noise.angle if turning else self.noise.position) ** 2
            self._variance[2 + j] = (self.noise.angular_rate if turning else self.noise.velocity) ** 2
        self._scale, self._offset = np.ones(4), np.zeros(4)
        self._scale[:2] += self._blocks[:, R.SCALE]
        self._offset[:2] = self._blocks[:, R.BIAS]
        rest = np.zeros(len(self._states))
        self.reset(0.0, rest)
        self.observe(1e-3, rest)  # loads the compiled code now, not in the first step of a running robot
        self.reset(0.0, rest)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; the robot is at rest where its sensors show it.

        Args:
            t: Time [s].
            measured: Coordinates and rates as the sensors show them, shape (2 joints,); NaN is taken for zero.
        """
        n = len(self._states) // 2
        at = self._states[:n]
        self._t = t
        self._y = np.zeros(4)
        self._y[at] = (np.nan_to_num(measured[:n]) - self._offset[at]) / self._scale[at]
        self._covariance = np.zeros((4, 4))
        self._covariance[self._states, self._states] = self._variance[self._states]
        self._innovations = self._variances = np.full(4, np.nan)
        self._sent: deque[tuple[float, np.ndarray]] = deque([(-np.inf, np.zeros(2))])

    def observe(self, t: float, measured: np.ndarray) -> np.ndarray:
        """Predict to a time and correct by what the sensors show then.

        Args:
            t: Time, not before the last one [s].
            measured: Coordinates and rates as the sensors show them, shape (2 joints,); NaN where nothing was new.

        Returns:
            The estimate, as `state`.
        """
        if t > self._t:
            self._y, self._covariance = propagate(
                self._y,
                self._covariance,
                self._arrived(self._t, t),
                t - self._t,
                self._body,
                self._blocks,
                self._double,
                self._ease,
                self._density,
            )
            self._t = t
        channels = np.full(4, np.nan)
        channels[self._states] = measured
        self._y, self._covariance, self._innovations, self._variances = correct(
            self._y, self._covariance, channels, self._scale, self._offset, self._variance
        )
        return self.state

    def send(self, t: float, commands: np.ndarray) -> None:
        """Tell what was commanded at a time, and is held until the next command.

        Args:
            t: Time, not before the last one [s].
            commands: Shape (inputs,) [N or N m].
        """
        held = np.zeros(2)
        held[self._driven] = commands
        self._sent.append((t, held))
        while len(self._sent) > 2 and self._sent[1][0] + self._delay <= self._t:
            self._sent.popleft()

    @property
    def state(self) -> np.ndarray:
        """Estimated coordinates, then rates, shape (2 joints,) [m, rad, m/s, rad/s]."""
        return self._y[self._states]

    @property
    def covariance(self) -> np.ndarray:
        """Of the estimate, shape (2 joints, 2 joints)."""
        return self._covariance[np.ix_(self._states, self._states)]

    @property
    def innovations(self) -> np.ndarray:
        """Of the last reading, in standard deviations and each given the channels before it, shape (2 joints,).

        NaN where a channel had nothing new; of a consistent filter they are independent and standard normal.
        """
        return (self._innovations / np.sqrt(self._variances))[self._states]

    @property
    def nis(self) -> float:
        """Normalised innovation squared of the last reading: chi-square with as many degrees as it had channels."""
        return float(np.nansum(self.innovations**2))

    def _arrived(self, begin: float, end: float) -> np.ndarray:
        """Mean of the delayed commands over an interval, shape (2,) [N or N m]."""
        total, until = np.zeros(2), end
        for sent, commands in reversed(self._sent):
            since = max(begin, sent + self._delay)
            if since < until:
                total += (until - since) * commands
                until = since
            if until <= begin:
                break
        return total / (end - begin)
