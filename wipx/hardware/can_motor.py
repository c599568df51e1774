"""One motor of the MIT Mini Cheetah protocol on a CAN bus: a command out, the state back.

The bytes are in `mit_protocol`; what the numbers mean for a robot is in `devices`.
"""

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol

import can

from wipx.core.errors import InputError, check_positive
from wipx.hardware.mit_protocol import ENTER, ERRORS, EXIT, ZERO, MitProtocol, MotorReply, Ranges
from wipx.hardware.safety import DeviceError

BUS_LOST = (can.CanError, OSError)  # slcan raises the first; a broken socket the second
PATIENCE = 0.05  # [s] for the answer to a special command: it need not come within one step of the loop
ATTEMPTS = 5  # at a special command
ZERO_SILENCE = 1.6  # [s] that a motor may be silent after it was zeroed: 1 to 1.5 s in published drivers
# A reply does not say to which command it belongs. After one was missed, late ones are waited for and thrown away for
# some commands, or every reply from then on would be taken for that of the next command.
QUIET = 0.001  # [s] without a frame, after which none is on its way
SETTLING = 3  # commands
BACKLOG = 256  # frames at most that may have piled up
# Replies at the end of the range while the motor turns: so many in a row mean that it does not wrap around there.
STUCK_REPLIES = 5
TURNING = 1.0  # [rad/s]


class Bus(Protocol):
    """What is used of `can.BusABC`."""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame."""
        ...

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame; None where there is none within `timeout` [s]."""
        ...

    def shutdown(self) -> None:
        """Close it."""
        ...


@dataclass(frozen=True)
class MotorSettings:
    """How one motor is set up and built in.

    Attributes:
        id: CAN id of its commands.
        master_id: CAN id of its replies.
        direction: 1 where positive torque drives the robot to +x, else -1.
        on_body: Whether its housing turns with the body, so that its angle is x/r + theta.
        zero: Whether it is zeroed before every trial, against firmware that does not wrap around at the ends of
            the range.
        reply_within: How long a step of the loop waits for the reply [s].
    """

    id: int = 1
    master_id: int = 0
    direction: int = 1
    on_body: bool = False
    zero: bool = False
    reply_within: float = 0.004

    def __post_init__(self) -> None:
        check_positive(reply_within=self.reply_within)
        if self.direction not in (1, -1):
            raise InputError(f"target.motor.direction is {self.direction}, expected 1 or -1")
        for name, number in (("id", self.id), ("master_id", self.master_id)):
            if not 0 <= number <= 0x7FF:
                raise InputError(f"target.motor.{name} is {number}, expected a standard CAN id, 0 to 2047")


def open_bus(settings: Mapping[str, Any], master_id: int) -> can.BusABC:
    """A CAN bus that shows the replies of a motor.

    Args:
        settings: Those of `can.Bus`.
        master_id: CAN id of the replies.

    Raises:
        InputError: it cannot be opened.
    """
    try:
        bus = can.Bus(**settings, ignore_config=True)
    except (*BUS_LOST, NotImplementedError, ValueError, TypeError) as error:
        name = f"{settings.get('interface')} {settings.get('channel')}"
        remedy = "check target.can, the adapter, and that the interface is up (docs/hardware.md)"
        raise InputError(f"target.can: {name} cannot be opened ({_one_line(error)}); {remedy}") from error
    bus.set_filters([{"can_id": master_id, "can_mask": 0x7FF, "extended": False}])
    return bus


@dataclass(frozen=True)
class SentCommand:
    """A command as it left.

    Attributes:
        at: Time [s].
        torque: That its frame asks for: a multiple of the protocol's step [N m].
    """

    at: float
    torque: float


class CanMotor:
    """A motor that answers every command with its state.

    Args:
        bus: Opened.
        settings: Of the motor.
        ranges: Of its firmware.

    Attributes:
        lost: Commands that were not answered in time, since `enter`.
        angle: Of the output, unwrapped [rad]; as of the latest reply.
    """

    def __init__(self, bus: Bus, settings: MotorSettings, ranges: Ranges) -> None:
        self.lost = 0
        self.angle = 0.0
        self._bus = bus
        self._settings = settings
        self._protocol = MitProtocol(ranges, settings.id, settings.master_id)
        self._span = 2.0 * ranges.position
        self._end = ranges.position - self._span / 65535.0  # beyond it lies the last code only
        self._position: float | None = None
        self._at_end = 0
        self._settling = 0

    def enter(self) -> MotorReply:
        """Switch motor mode on; torque stays zero until a command asks for some.

        Raises:
            DeviceError: the bus is lost, or the motor does not answer or reports an error.
        """
        self.lost = 0
        if self._settings.zero:
            self._insist(ZERO, within=ZERO_SILENCE)
        self._position = None
        self._settling = SETTLING
        self._insist(ENTER, within=PATIENCE)
        # With a command of zero torque the motor confirms what it does when the loop begins.
        return self._insist(self._protocol.command(), within=PATIENCE)

    def exit(self) -> bool:
        """Ask for zero torque, then switch motor mode off; never raises.

        Returns:
            Whether the motor has confirmed it.
        """
        for _ in range(ATTEMPTS):
            self._answered(self._protocol.command())
            if self._answered(EXIT):
                return True
        return False

    def _answered(self, frame: bytes) -> bool:
        """Whether a frame was sent and answered; a lost bus is none."""
        with suppress(DeviceError):  # a bus that brings nothing may still carry frames to the motor
            self._drain()
        try:
            self._send(frame)
            return self._receive(PATIENCE) is not None
        except DeviceError:
            return False

    def command(self, torque: float) -> SentCommand:
        """Ask for a torque.

        Args:
            torque: At the output [N m].

        Raises:
            DeviceError: the bus is lost.
        """
        if self._settling:
            self._drain()
        frame = self._protocol.command(torque=torque)
        sent = SentCommand(time.perf_counter(), self._protocol.torque_of(frame))
        self._send(frame)
        return sent

    def reply(self) -> MotorReply | None:
        """The state when the latest command arrived; None where it does not come in time.

        Raises:
            DeviceError: the bus is lost, the motor reports an error, or its angle is no longer known.
        """
        reply = self._receive(self._settings.reply_within)
        if reply is None:
            self.lost += 1
            self._settling = SETTLING
            return None
        if self._settling:
            self._settling -= 1
            while (later := self._receive(QUIET)) is not None:
                reply = later
        self._follow(reply)
        return reply

    def _insist(self, frame: bytes, within: float) -> MotorReply:
        """Send a frame until it is answered."""
        for _ in range(ATTEMPTS):
            self._drain()
            self._send(frame)
            reply = self._receive(within)
            if reply is not None:
                self._follow(reply)
                return reply
        seconds = ATTEMPTS * within
        raise DeviceError(
            f"no reply from motor {self._settings.id} in {seconds:g} s; check its supply, the CAN wiring and its id"
        )

    def _follow(self, reply: MotorReply) -> None:
        """Unwrap the angle: a jump by more than half the range is a step over its end."""
        if reply.error:
            reason = ERRORS.get(reply.error, "see the motor's manual")
            raise DeviceError(f"motor {reply.motor_id} reports error {reply.error}: {reason}")
        if self._position is None:
            self.angle = self._position = reply.position
            self._at_end = 0
            return
        step = reply.position - self._position
        self.angle += step - self._span * round(step / self._span)
        self._position = reply.position
        stuck = abs(reply.position) >= self._end and abs(reply.velocity) > TURNING
        self._at_end = self._at_end + 1 if stuck else 0
        if self._at_end == STUCK_REPLIES:
            raise DeviceError(
                f"motor {reply.motor_id} turns but its position stays at {reply.position:g} rad, the end of its range; "
                f"set target.motor.zero=true"
            )

    def _send(self, data: bytes) -> None:
        frame = can.Message(arbitration_id=self._settings.id, data=data, is_extended_id=False)
        try:
            self._bus.send(frame)
        except BUS_LOST as error:
            raise _bus_lost(error) from error

    def _receive(self, within: float) -> MotorReply | None:
        """The next reply of this motor; other frames are passed over."""
        deadline = time.perf_counter() + within
        while (left := deadline - time.perf_counter()) > 0.0:
            try:
                frame = self._bus.recv(left)
            except BUS_LOST as error:
                raise _bus_lost(error) from error
            if frame is None or frame.is_error_frame or frame.is_extended_id:
                continue
            reply = self._protocol.reply(bytes(frame.data))
            if frame.arbitration_id == self._settings.master_id and reply and reply.motor_id == self._settings.id:
                return reply
        return None

    def _drain(self) -> None:
        """Forget the frames that have come, until none comes any more."""
        try:
            for _ in range(BACKLOG):
                if self._bus.recv(QUIET) is None:
                    return
        except BUS_LOST as error:
            raise _bus_lost(error) from error


def _bus_lost(error: Exception) -> DeviceError:
    return DeviceError(f"the CAN bus is lost ({_one_line(error)}); check the adapter and its cable")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
