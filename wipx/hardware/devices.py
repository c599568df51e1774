"""Motor and IMU together, in the coordinates of a wheeled inverted pendulum.

Limits and the loop are in `run`, the operator in `robot`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import TypeVar

import numpy as np

from wipx.core.loop_quality import LoopQuality, Overrun
from wipx.core.recording import Recording
from wipx.hardware.can_motor import CanMotor
from wipx.hardware.imu import Imu, times
from wipx.hardware.mit_protocol import MotorReply

Numbers = TypeVar("Numbers", float, np.ndarray)


@dataclass(frozen=True)
class Drivetrain:
    """How the motor moves the robot.

    Attributes:
        wheel_radius: [m].
        direction: 1 where positive torque drives the robot to +x, else -1.
        on_body: Whether the motor's housing turns with the body: its angle is then x/r + theta, since positive theta
            turns the body against the rolling of the wheel to +x.
    """

    wheel_radius: float
    direction: int
    on_body: bool

    def torque(self, force: float) -> float:
        """Of the motor, for a force on the rail [N m]."""
        return self.direction * self.wheel_radius * force

    def force(self, torque: Numbers) -> Numbers:
        """On the rail, for a torque of the motor [N]."""
        return self.direction / self.wheel_radius * torque

    def travel(self, angle: Numbers, theta: Numbers) -> Numbers:
        """Of the wheel axis, for an angle of the motor and a pitch [m]; for their rates its speed [m/s]."""
        return self.wheel_radius * (self.direction * angle - (theta if self.on_body else 0.0 * theta))


@dataclass(frozen=True)
class Pushes:
    """Commands of a trial and what the motor answered; NaN where it did not.

    Attributes:
        sent_at: By the computer's clock, shape (N,) [s].
        force: As sent, shape (N,) [N].
        angle: Of the motor when the command arrived, unwrapped, shape (N,) [rad].
        velocity: Likewise [rad/s].
        torque: Likewise, so that of the command before, shape (N,) [N m].
    """

    sent_at: np.ndarray
    force: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    torque: np.ndarray


class Devices:
    """What the computer of a robot has: it can sense, push, and let go.

    Args:
        motor: Of the wheels.
        imu: On the body.
        drivetrain: Between motor and rail.
    """

    def __init__(self, motor: CanMotor, imu: Imu, drivetrain: Drivetrain) -> None:
        self.motor = motor
        self.imu = imu
        self.drivetrain = drivetrain
        self._reply: MotorReply | None = None
        self._origin = 0.0
        self._pushes: list[tuple[float, float, float, float, float]] = []

    def begin(self) -> np.ndarray:
        """Switch the motor on where the robot is; the IMU has been read.

        Returns:
            Coordinates and rates as the sensors show them, shape (4,); x is zero here.

        Raises:
            DeviceError: the motor does not answer, or the line of the IMU is lost.
        """
        self._pushes = []
        self._reply = self.motor.enter()
        self.imu.read()  # switching on has taken its time
        latest = self.imu.samples[-1]
        self._origin = self.drivetrain.travel(self.motor.angle, latest.theta)
        x_dot = self.drivetrain.travel(self._reply.velocity, latest.theta_dot)
        return np.array([0.0, latest.theta, x_dot, latest.theta_dot])

    def sense(self) -> np.ndarray:
        """Coordinates and rates as the sensors show them, NaN where they have nothing new, shape (4,).

        Raises:
            DeviceError: the line of the IMU is lost.
        """
        fresh = self.imu.read()
        latest = self.imu.samples[-1]
        measured = np.full(4, nan)
        if fresh is not None:
            measured[[1, 3]] = fresh.theta, fresh.theta_dot
        if self._reply is not None:
            measured[0] = self.drivetrain.travel(self.motor.angle, latest.theta) - self._origin
            measured[2] = self.drivetrain.travel(self._reply.velocity, latest.theta_dot)
        return measured

    def push(self, force: float) -> bool:
        """Ask for a force.

        Args:
            force: [N].

        Returns:
            Whether the motor answered.

        Raises:
            DeviceError: the bus is lost, or the motor reports an error.
        """
        command = self.motor.command(self.drivetrain.torque(force))
        sent = command.at, self.drivetrain.force(command.torque)
        self._pushes.append((*sent, nan, nan, nan))
        self._reply = reply = self.motor.reply()
        if reply is not None:
            self._pushes[-1] = (*sent, self.motor.angle, reply.velocity, reply.torque)
        return reply is not None

    def end(self) -> bool:
        """Switch the motor off; whether it has confirmed it."""
        return self.motor.exit()

    def recording(self, name: str, source: str) -> Recording | None:
        """What was sensed and sent since `begin`; None where that is too little.

        Every row stands at the time of a command. The motor's angle in its reply is of that very moment, and its torque
        there is what came of the command before; the pitch lies between messages of the IMU.

        Args:
            name: Of the recording.
            source: Origin, for messages.
        """
        pushes = self._sent()
        answered = np.isfinite(pushes.angle)
        if np.count_nonzero(answered) < 3:
            return None
        sent_at, motor = pushes.sent_at, self.drivetrain

        def at_commands(values: np.ndarray) -> np.ndarray:
            return np.interp(sent_at, sent_at[answered], values[answered])

        measured_at, samples = times(self.imu.samples), self.imu.samples
        theta = np.interp(sent_at, measured_at, [sample.theta for sample in samples])
        theta_dot = np.interp(sent_at, measured_at, [sample.theta_dot for sample in samples])
        columns = {
            "t": (sent_at - sent_at[0])[:-1],
            "x": (motor.travel(at_commands(pushes.angle), theta) - self._origin)[:-1],
            "theta": theta[:-1],
            "x_dot": motor.travel(at_commands(pushes.velocity), theta_dot)[:-1],
            "theta_dot": theta_dot[:-1],
            "u": pushes.force[:-1],
            "u_measured": motor.force(at_commands(pushes.torque))[1:],
        }
        return Recording(name, columns, source)

    def quality(self, rate: float, overruns: Sequence[tuple[float, int]]) -> LoopQuality | None:
        """How well the loop kept time since `begin`; None where it sent fewer than two commands.

        Args:
            rate: Of the loop [Hz].
            overruns: As of `Pace`.
        """
        pushes, samples = self._sent(), self.imu.samples
        sent_at, answered = pushes.sent_at, np.flatnonzero(np.isfinite(pushes.angle))
        if len(sent_at) < 2:
            return None
        newest = np.searchsorted([sample.read_at for sample in samples], sent_at, side="right") - 1
        before = np.searchsorted(answered, np.arange(1, len(sent_at))) - 1
        known = before >= 0
        return LoopQuality(
            period=1.0 / rate,
            period_errors=np.diff(sent_at) - 1.0 / rate,
            imu_ages=sent_at - times(samples)[newest],
            motor_ages=sent_at[1:][known] - sent_at[answered[before[known]]],
            overruns=tuple(
                Overrun(at - sent_at[0], int(np.searchsorted(sent_at, at)), skipped) for at, skipped in overruns
            ),
            lost_replies=tuple(sent_at[~np.isfinite(pushes.angle)] - sent_at[0]),
            damaged_messages=self.imu.damaged,
        )

    def _sent(self) -> Pushes:
        return Pushes(*np.array(self._pushes, dtype=float).reshape(-1, 5).T)
