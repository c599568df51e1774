"""What the motor's encoder and the IMU of an emulated robot show, and the steps of its CAN frames.

A motor knows the joint that it drives: position of 16 bits and velocity of 12 over the ranges of its firmware. The
other joints have an IMU: an angle whose error wanders about a bias, and a gyro.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model
from wipx.hardware.hidden import HiddenPhysics, lever_of
from wipx.hardware.mit_protocol import Ranges

POSITION_BITS, VELOCITY_BITS, TORQUE_BITS = 16, 12, 12


@dataclass(frozen=True)
class Steps:
    """Values that a field of a frame can have; zero lies between two of them.

    Attributes:
        end: The field reaches from -end to end.
        step: Between neighbours; 0 for a field without steps.
    """

    end: float
    step: float

    @classmethod
    def of(cls, end: float, bits: int, lever: float) -> "Steps":
        """Of a field of `bits` up to `end`, in the units of a joint behind a `lever`."""
        return cls(end * lever, 2.0 * end * lever / (2**bits - 1))

    def nearest(self, values: np.ndarray) -> np.ndarray:
        """The values that the field shows, beyond its ends too, where a position is unwrapped."""
        if self.step == 0.0:
            return values
        return np.round((values + self.end) / self.step) * self.step - self.end

    def limited(self, values: np.ndarray) -> np.ndarray:
        """The values that the field shows, limited to its ends."""
        return self.nearest(np.clip(values, -self.end, self.end))


NO_STEPS = Steps(np.inf, 0.0)


@dataclass(frozen=True)
class Motor:
    """The fields of one drive's frames, in the units of its joint.

    Attributes:
        joint: Index of the coordinate that it drives.
        lever: What a radian of it moves the joint by [m or 1].
        position: [m or rad].
        velocity: [m/s or rad/s].
        force: [N or N m].
    """

    joint: int
    lever: float
    position: Steps
    velocity: Steps
    force: Steps

    @classmethod
    def of(cls, model: Model, site: str, *, in_steps: bool) -> "Motor":
        """The drive of a joint."""
        joint, lever, ranges = model.plant.joints.index(site), lever_of(model, site), Ranges()
        if not in_steps:
            return cls(joint, lever, NO_STEPS, NO_STEPS, NO_STEPS)
        return cls(
            joint,
            lever,
            Steps.of(ranges.position, POSITION_BITS, lever),
            Steps.of(ranges.velocity, VELOCITY_BITS, lever),
            Steps.of(ranges.torque, TORQUE_BITS, 1.0 / lever),
        )


class Sensors:
    """Readings during one trial; noise is drawn when the trial begins.

    Args:
        hidden: The robot.
        motors: Its drives.
        t: Times of the readings, shape (K,) [s].
        rng: Draws the noise.
    """

    def __init__(self, hidden: HiddenPhysics, motors: tuple[Motor, ...], t: np.ndarray, rng: np.random.Generator):
        joints = len(hidden.model.plant.joints)
        self._joints = joints
        self._motors = motors
        self._noise = rng.normal(size=(len(t), 2 * joints))
        driven = {motor.joint: motor for motor in motors}
        for j in range(joints):
            if j in driven:
                self._noise[:, j] *= hidden.encoder_noise * driven[j].lever
                self._noise[:, joints + j] *= hidden.velocity_noise * driven[j].lever
            else:
                self._noise[:, j] *= hidden.angle_noise
                self._noise[:, j] += hidden.angle_bias + hidden.angle_wander * wander(t, hidden.wander_time, rng)
                self._noise[:, joints + j] *= hidden.gyro_noise

    def show(self, k: int, true: np.ndarray) -> np.ndarray:
        """Coordinates and rates as reading `k` shows them, shape (2 joints,).

        Args:
            k: Number of the reading.
            true: Coordinates, then rates, shape (2 joints,).
        """
        shown = true + self._noise[k]
        for motor in self._motors:
            rate = self._joints + motor.joint
            shown[motor.joint] = motor.position.nearest(shown[motor.joint])
            shown[rate] = motor.velocity.limited(shown[rate])
        return shown


def wander(t: np.ndarray, correlation_time: float, rng: np.random.Generator) -> np.ndarray:
    """A stationary process of first order with standard deviation 1 at times `t` (K,)."""
    kept = np.exp(-np.diff(t) / correlation_time)
    path = rng.normal(size=len(t))
    for k, share in enumerate(kept):
        path[k + 1] = share * path[k] + np.sqrt(1.0 - share**2) * path[k + 1]
    return path
