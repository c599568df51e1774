"""A bus and a port without wires, around the emulated devices: what was sent can be looked at, and lines can be cut."""

import time

import can
import numpy as np

from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.hardware.can_motor import CanMotor, MotorSettings
from wipx.hardware.devices import Devices, Drivetrain
from wipx.hardware.emulated_devices import EmulatedImu, EmulatedMotor, EmulatedRobot, Surroundings
from wipx.hardware.emulator import PARAMETERS
from wipx.hardware.imu import Imu, ImuSettings
from wipx.hardware.mit_protocol import Ranges

QUIET = Surroundings()
WIP = Model(plant_of("wip"), plant_of("wip").complete(PARAMETERS, "test"), {})


class FakeClock:
    """Time that passes only where somebody looks at it or sleeps, so that a busy machine changes nothing."""

    def __init__(self) -> None:
        self._now = 1000.0

    def perf_counter(self) -> float:
        self._now += 2e-6  # about what a few lines of Python take
        return self._now

    def sleep(self, seconds: float) -> None:
        self._now += seconds


class FakeBus:
    """Hands frames to a motor and records them; `silent` drops replies, `stalled` keeps them back, `broken` raises."""

    def __init__(self, motor: EmulatedMotor) -> None:
        self.sent: list[bytes] = []
        self.waiting: list[can.Message] = []
        self.silent = False
        self.stalled = False
        self._late: list[can.Message] = []
        self.broken: Exception | None = None
        self._motor = motor

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.sent.append(bytes(msg.data))
        if self.broken:
            raise self.broken
        reply = self._motor.frame(msg.arbitration_id, bytes(msg.data), time.perf_counter())
        if reply and not self.silent:
            self._late.append(can.Message(arbitration_id=reply[0], data=reply[1], is_extended_id=False))
        if not self.stalled:
            self.waiting += self._late
            self._late = []

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self.waiting:
            return self.waiting.pop(0)
        time.sleep(timeout or 0.0)
        return None

    def shutdown(self) -> None:
        return


class FakePort:
    """Shows one message of an IMU whenever it is read, until it falls silent."""

    def __init__(self, imu: EmulatedImu) -> None:
        self.silent = False
        self._imu = imu
        imu.receive(b"$VNWRG,75,1,2,01,0129*XX\r\n")

    def read(self, size: int) -> bytes:
        return b"" if self.silent else self._imu.message(time.perf_counter())

    def reset_input_buffer(self) -> None:
        return

    def close(self) -> None:
        return


class Bench:
    """An emulated robot on fake lines, held at a pitch."""

    def __init__(self, pitch: float = 0.0, settings: MotorSettings | None = None, angle: float = 12.4) -> None:
        now = time.perf_counter()
        settings = settings or MotorSettings(reply_within=0.002)
        self.robot = EmulatedRobot(WIP, QUIET, pitch, now)
        self.bus = FakeBus(EmulatedMotor(self.robot, Ranges(), settings.id, settings.master_id, angle))
        self.port = FakePort(EmulatedImu(self.robot, QUIET, np.random.default_rng(0), now))
        self.motor = CanMotor(self.bus, settings, Ranges())
        self.imu = Imu(self.port, ImuSettings("nowhere"))
        drivetrain = Drivetrain(PARAMETERS["wheel_radius"], settings.direction, settings.on_body)
        self.devices = Devices(self.motor, self.imu, drivetrain)
        self.imu.read()


# Of `wipx.control.lqr.Lqr` for this robot.
BALANCING = np.array([-10.0, 176.4, -15.3, 27.7])


class Feedback:
    """u = -K y on the latest of every sensor, or a constant force."""

    def __init__(self, gains: np.ndarray, *, push: float = 0.0, rate: float = 200.0) -> None:
        self.rate = rate
        self.state = np.zeros(4)
        self.steps = 0
        self._gains = gains
        self._push = push

    def reset(self, t: float, measured: np.ndarray) -> None:
        self.state = measured.copy()

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        self.steps += 1
        self.state = np.where(np.isnan(measured), self.state, measured)
        return np.array([self._push - self._gains @ (self.state - reference)])
