"""A motor, an IMU and the robot between them, as their lines show them: bytes and times in, bytes out.

For tests and first steps without hardware; the lines themselves are in `emulator`. The packing of bits is written a
second time here, in integers as a motor's firmware does it, so that the driver is checked against something it shares
no code with.
"""

import binascii
from dataclasses import dataclass
from math import ceil, cos, degrees, remainder, sin

import numpy as np

from wipx.core.load import BALANCE
from wipx.core.model import Model
from wipx.hardware.mit_protocol import ENTER, EXIT, ZERO, Ranges
from wipx.hardware.vn100 import BODY, HEADER, INTERNAL_RATE, text_message

STEP = 2e-4  # [s] of the integrator at most
BITS = {"position": 16, "velocity": 12, "torque": 12}


@dataclass(frozen=True)
class Surroundings:
    """What the robot's owner may not know.

    Attributes:
        friction: Coulomb friction of the wheel on its rail [N].
        damping: Viscous friction there [N s/m].
        pitch_damping: Viscous friction of the pitch joint [N m s/rad].
        angle_noise: Standard deviation of the IMU's angle [rad].
        rate_noise: Of its rate [rad/s].
    """

    friction: float = 0.0
    damping: float = 0.0
    pitch_damping: float = 0.0
    angle_noise: float = 0.0
    rate_noise: float = 0.0


class EmulatedRobot:
    """The equations of contract section 2 with friction, integrated up to the present whenever its state is read.

    The body is held until the motor is enabled, and caught when it is disabled.

    Args:
        model: A wip, loaded or not, without other effects.
        surroundings: Beyond it.
        pitch: At which it is held [rad].
        now: Time [s].
    """

    def __init__(self, model: Model, surroundings: Surroundings, pitch: float, now: float) -> None:
        self.held = True
        self.pitch = pitch
        self.force = 0.0  # of the motor on the rail [N]
        self._surroundings = surroundings
        self._now = now
        self._x, self._theta = 0.0, pitch
        self._x_dot = self._theta_dot = 0.0
        self.carry(model)

    def carry(self, model: Model) -> None:
        """Take other masses."""
        p = model.parameters
        self.radius = p["wheel_radius"]
        self._mass = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / self.radius**2
        self._inertia = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
        self._moment = p["body_mass"] * p["com_height"]
        self._gravity = p["gravity"]
        self._balance = model.effects.get(BALANCE, {}).get("theta_eq", 0.0)

    def hold(self) -> None:
        """Catch the body and bring it back to where it is held."""
        self.held, self.force = True, 0.0
        self._theta, self._x_dot, self._theta_dot = self.pitch, 0.0, 0.0

    def release(self) -> None:
        """Let go of the body."""
        if self.held:
            self.hold()
        self.held = False

    def state(self, now: float) -> tuple[float, float, float, float]:
        """x, theta [m, rad] and their rates at a time [s] that is not before the latest."""
        passed = now - self._now
        self._now = now
        if not self.held and passed > 0.0:
            steps = ceil(passed / STEP)
            for _ in range(steps):
                self._advance(passed / steps)
        return self._x, self._theta, self._x_dot, self._theta_dot

    def _advance(self, dt: float) -> None:
        """Semi-implicit Euler; dry friction is the impulse that stops the wheel, as far as friction can."""
        around, m, mass, inertia = self._surroundings, self._moment, self._mass, self._inertia
        tilt = self._theta - self._balance
        coupling = -m * cos(tilt)
        determinant = mass * inertia - coupling * coupling
        along = self.force - m * sin(tilt) * self._theta_dot**2 - around.damping * self._x_dot
        about = m * self._gravity * sin(tilt) - around.pitch_damping * self._theta_dot
        self._x_dot += dt * (inertia * along - coupling * about) / determinant
        self._theta_dot += dt * (mass * about - coupling * along) / determinant
        stopping = -self._x_dot * determinant / inertia
        impulse = min(max(stopping, -around.friction * dt), around.friction * dt)
        self._x_dot += impulse * inertia / determinant
        self._theta_dot -= impulse * coupling / determinant
        self._x += dt * self._x_dot
        self._theta += dt * self._theta_dot
        if abs(self._theta) > 1.5:  # it lies on the floor
            self._theta_dot = 0.0
            self._theta = min(max(self._theta, -1.5), 1.5)


class EmulatedMotor:
    """A motor of the MIT Mini Cheetah protocol at the robot's wheel; it reads only the torque of a command.

    Args:
        robot: Which it drives.
        ranges: Of its firmware; the position wraps around at their ends.
        motor_id: CAN id of its commands.
        master_id: CAN id of its replies.
        angle: At the start [rad].
    """

    def __init__(self, robot: EmulatedRobot, ranges: Ranges, motor_id: int, master_id: int, angle: float) -> None:
        self._robot = robot
        self._ends = {"position": ranges.position, "velocity": ranges.velocity, "torque": ranges.torque}
        self._motor_id = motor_id
        self._master_id = master_id
        self._zero = -angle

    def frame(self, frame_id: int, data: bytes, now: float) -> tuple[int, bytes] | None:
        """The reply to a frame, as id and bytes; None where the frame is for somebody else."""
        if frame_id != self._motor_id or len(data) != 8:
            return None
        robot = self._robot
        x, _, x_dot, _ = robot.state(now)
        if data == ZERO:
            self._zero = x / robot.radius
        reply = self._reply(x / robot.radius - self._zero, x_dot / robot.radius, robot.force * robot.radius)
        if data == ENTER:
            robot.release()
        elif data == EXIT:
            robot.hold()
        elif data != ZERO and not robot.held:
            robot.force = self._number("torque", int.from_bytes(data, "big") & 0xFFF) / robot.radius
        return self._master_id, reply

    def _reply(self, position: float, velocity: float, torque: float) -> bytes:
        wrapped = remainder(position, 2.0 * self._ends["position"])
        bits = self._code("position", wrapped) << 24 | self._code("velocity", velocity) << 12
        bits |= self._code("torque", torque)
        return bytes([self._motor_id]) + bits.to_bytes(5, "big") + bytes([25, 0])  # 25 degC, no error

    def _code(self, name: str, value: float) -> int:
        """As the firmware packs it: limited, and truncated."""
        end, top = self._ends[name], (1 << BITS[name]) - 1
        return int((min(max(value, -end), end) + end) * top / (2.0 * end))

    def _number(self, name: str, code: int) -> float:
        end, top = self._ends[name], (1 << BITS[name]) - 1
        return code * 2.0 * end / top - end


class EmulatedImu:
    """A VN-100 on the robot's body, whose pitch is theta.

    Args:
        robot: Which carries it.
        surroundings: Its noise.
        rng: Draws it.
        now: Time of its start [s].
    """

    def __init__(self, robot: EmulatedRobot, surroundings: Surroundings, rng: np.random.Generator, now: float) -> None:
        self._robot = robot
        self._surroundings = surroundings
        self._rng = rng
        self._started = now
        self._pending = b""
        self._registers = {6: "14", 7: "40", 75: "0,4,01,0129"}  # as delivered: VNYMR at 40 Hz

    @property
    def period(self) -> float:
        """Between messages [s]; one second where none are sent."""
        mode, divisor = self._registers[75].split(",")[:2]
        if mode != "0":
            return int(divisor) / INTERNAL_RATE
        return 1.0 / int(self._registers[7]) if self._registers[6] == "14" else 1.0

    def message(self, now: float) -> bytes:
        """What it sends at a time [s]."""
        _, theta, _, theta_dot = self._robot.state(now)
        pitch = degrees(theta + self._surroundings.angle_noise * self._rng.standard_normal())
        rate = theta_dot + self._surroundings.rate_noise * self._rng.standard_normal()
        if not self._registers[75].startswith("0"):
            nanoseconds = int((now - self._started) * 1e9)
            body = HEADER[1:] + BODY.pack(nanoseconds, 0.0, pitch, 0.0, 0.0, rate, 0.0, 0.0, 0.0, -9.81)
            return HEADER[:1] + body + binascii.crc_hqx(body, 0).to_bytes(2, "big")
        if self._registers[6] == "14":
            angles, rates = f"+000.000,{pitch:+08.3f},+000.000", f"+00.000000,{rate:+010.6f},+00.000000"
            return text_message(f"VNYMR,{angles},+1.0000,+0.0000,+1.0000,+00.000,+00.000,-09.810,{rates}")
        return b""

    def receive(self, data: bytes) -> bytes:
        """The answers to what its line brings: reading and writing of the registers above."""
        *lines, self._pending = (self._pending + data).split(b"\n")
        return b"".join(self._answer(line) for line in lines)

    def _answer(self, line: bytes) -> bytes:
        content = line.decode("ascii", errors="replace").strip().lstrip("$").partition("*")[0]
        command, _, rest = content.partition(",")
        number, _, value = rest.partition(",")
        if command not in ("VNWRG", "VNRRG") or not number.isdigit() or int(number) not in self._registers:
            return text_message("VNERR,08")
        if command == "VNWRG":
            self._registers[int(number)] = value
        return text_message(f"{command},{number},{self._registers[int(number)]}")
