"""The MIT Mini Cheetah motor protocol: commands and replies as CAN frames, without a bus.

Sources: CubeMars, AK Series Actuator Driver Manual V1.0.8, pages 48 to 50; B. Katz, motor firmware (`CAN_com.cpp`).
The state of a reply is the motor's at the moment the command arrived, so its torque is not yet that of the command.
"""

from dataclasses import dataclass

from cantools.database import Database, Message
from cantools.database.can.signal import Signal
from cantools.database.conversion import BaseConversion

from wipx.core.errors import check_positive

ENTER = b"\xff" * 7 + b"\xfc"  # motor mode on
EXIT = b"\xff" * 7 + b"\xfd"  # motor mode off: no torque
ZERO = b"\xff" * 7 + b"\xfe"  # the present position becomes zero
SHORTEST_REPLY = 6  # bytes; newer firmware adds temperature and error
# As in TMotorCANControl (`mit_can.py`); replies of six bytes carry none.
ERRORS = {
    1: "over-temperature; let it cool",
    2: "over-current; check the wheels for a jam",
    3: "over-voltage; check the supply",
    4: "under-voltage; charge the battery or check the supply",
    5: "encoder fault; switch the motor off and on",
    6: "phase unbalance; check the motor's phases",
}


@dataclass(frozen=True)
class Ranges:
    """Ends of the numbers in a frame; they differ between firmwares, see docs/hardware.md.

    Attributes:
        position: +- [rad].
        velocity: +- [rad/s].
        torque: +- [N m].
        stiffness: From zero [N m/rad].
        damping: From zero [N m s/rad].
    """

    position: float = 12.5
    velocity: float = 76.0
    torque: float = 12.0
    stiffness: float = 500.0
    damping: float = 5.0

    def __post_init__(self) -> None:
        check_positive(
            position=self.position,
            velocity=self.velocity,
            torque=self.torque,
            stiffness=self.stiffness,
            damping=self.damping,
        )


@dataclass(frozen=True)
class MotorReply:
    """State of a motor as one frame shows it.

    Attributes:
        motor_id: Which motor.
        position: Of its output, within the range [rad].
        velocity: Of its output [rad/s].
        torque: Of its output, from the measured current [N m].
        temperature: As reported [degC]; None from firmware that sends six bytes.
        error: Key of `ERRORS`; 0 for none.
    """

    motor_id: int
    position: float
    velocity: float
    torque: float
    temperature: float | None = None
    error: int = 0


class MitProtocol:
    """Frames of one motor.

    Args:
        ranges: Of its firmware.
        motor_id: CAN id of its commands.
        master_id: CAN id of its replies.
    """

    def __init__(self, ranges: Ranges, motor_id: int, master_id: int) -> None:
        self.ranges = ranges
        self._command = _message(
            "MIT_COMMAND",
            motor_id,
            _symmetric("position", 7, 16, ranges.position, "rad"),
            _symmetric("velocity", 23, 12, ranges.velocity, "rad/s"),
            _signal("kp", 27, 12, ranges.stiffness / 4095.0, 0.0, "Nm/rad"),
            _signal("kd", 47, 12, ranges.damping / 4095.0, 0.0, "Nms/rad"),
            _symmetric("torque", 51, 12, ranges.torque, "Nm"),
        )
        self._reply = _message(
            "MIT_REPLY",
            master_id,
            _signal("motor_id", 7, 8, 1.0, 0.0, ""),
            _symmetric("position", 15, 16, ranges.position, "rad"),
            _symmetric("velocity", 31, 12, ranges.velocity, "rad/s"),
            _symmetric("torque", 35, 12, ranges.torque, "Nm"),
            _signal("temperature", 55, 8, 1.0, 0.0, "degC"),
            _signal("error", 63, 8, 1.0, 0.0, ""),
        )

    def dbc(self) -> str:
        """Both messages as a DBC file, for other CAN tools."""
        return Database([self._command, self._reply]).as_dbc_string()

    def command(
        self,
        *,
        torque: float = 0.0,
        position: float = 0.0,
        velocity: float = 0.0,
        stiffness: float = 0.0,
        damping: float = 0.0,
    ) -> bytes:
        """The frame of a command, 8 bytes; values beyond the range are limited to it.

        Args:
            torque: Feed-forward [N m].
            position: Where the stiffness pulls to [rad].
            velocity: What the damping pulls to [rad/s].
            stiffness: [N m/rad]; it stays one step below its end, where a frame could mean `ENTER`.
            damping: [N m s/rad].
        """
        ends = self.ranges
        return self._command.encode(
            {
                "position": _limited(position, -ends.position, ends.position),
                "velocity": _limited(velocity, -ends.velocity, ends.velocity),
                "kp": _limited(stiffness, 0.0, ends.stiffness * 4094.0 / 4095.0),
                "kd": _limited(damping, 0.0, ends.damping),
                "torque": _limited(torque, -ends.torque, ends.torque),
            },
            strict=False,
        )

    def torque_of(self, command: bytes) -> float:
        """The torque that a command's frame asks for, as the motor reads it: a multiple of the step [N m]."""
        return _numbers(self._command, command)["torque"]

    def reply(self, data: bytes) -> MotorReply | None:
        """The state in a reply; None where the frame is too short to be one."""
        if len(data) < SHORTEST_REPLY:
            return None
        state = _numbers(self._reply, data)
        return MotorReply(
            int(state["motor_id"]),
            state["position"],
            state["velocity"],
            state["torque"],
            state.get("temperature"),
            int(state.get("error", 0)),
        )


def _limited(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _numbers(message: Message, data: bytes) -> dict[str, float]:
    decoded = message.decode_simple(data, decode_choices=False, allow_truncated=True)
    return {name: float(value) for name, value in decoded.items() if isinstance(value, int | float)}


def _symmetric(name: str, start: int, bits: int, end: float, unit: str) -> Signal:
    return _signal(name, start, bits, 2.0 * end / (2**bits - 1), -end, unit)


def _signal(name: str, start: int, bits: int, scale: float, offset: float, unit: str) -> Signal:
    conversion = BaseConversion.factory(scale, offset)
    return Signal(name, start, bits, byte_order="big_endian", conversion=conversion, unit=unit)


def _message(name: str, frame_id: int, *signals: Signal) -> Message:
    return Message(frame_id, name, 8, list(signals), strict=True)
