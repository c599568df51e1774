"""Frames of the MIT Mini Cheetah protocol, and the motor behind them."""

import can
import cantools
import numpy as np
import pytest
from hardware.fake_lines import Bench

from wipx.core.errors import InputError
from wipx.hardware.can_motor import CanMotor, MotorSettings, open_bus
from wipx.hardware.mit_protocol import ENTER, EXIT, ZERO, MitProtocol, Ranges
from wipx.hardware.safety import DeviceError

FIRMWARES = (Ranges(), Ranges(12.5, 38.2, 12.0), Ranges(95.5, 45.0, 18.0))


def packed(ends: Ranges, position: float, velocity: float, kp: float, kd: float, torque: float) -> str:
    """The frame as a string of bits, from the table in the motor's manual."""

    def bits(value: float, low: float, high: float, width: int) -> str:
        return format(round((value - low) * (2**width - 1) / (high - low)), f"0{width}b")

    return (
        bits(position, -ends.position, ends.position, 16)
        + bits(velocity, -ends.velocity, ends.velocity, 12)
        + bits(kp, 0.0, ends.stiffness, 12)
        + bits(kd, 0.0, ends.damping, 12)
        + bits(torque, -ends.torque, ends.torque, 12)
    )


@pytest.mark.parametrize("ends", FIRMWARES)
def test_commands_are_packed_as_the_manual_says(ends: Ranges, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    protocol = MitProtocol(ends, 1, 0)
    for _ in range(300):
        p, v, t = rng.uniform(-1.0, 1.0, 3) * (ends.position, ends.velocity, ends.torque)
        kp, kd = rng.uniform(0.0, 0.99, 2) * (ends.stiffness, ends.damping)
        frame = protocol.command(torque=t, position=p, velocity=v, stiffness=kp, damping=kd)
        assert format(int.from_bytes(frame, "big"), "064b") == packed(ends, p, v, kp, kd, t)
        # what the motor is told differs from what was wanted by half a step at most
        assert protocol.torque_of(frame) == pytest.approx(t, abs=1.001 * ends.torque / 4095.0)


def test_both_ends_of_the_ranges_are_whole_codes_and_what_is_beyond_is_limited():
    protocol = MitProtocol(Ranges(), 1, 0)
    low = protocol.command(torque=-1e9, position=-1e9, velocity=-1e9, stiffness=-1.0, damping=-1.0)
    high = protocol.command(torque=1e9, position=1e9, velocity=1e9, stiffness=0.0, damping=1e9)
    assert low == bytes(8)
    assert high == bytes.fromhex("fffffff000ffffff")


def test_no_command_is_a_special_frame():
    protocol = MitProtocol(Ranges(), 1, 0)
    for torque in np.linspace(11.6, 12.0, 300):
        frame = protocol.command(torque=torque, position=99.0, velocity=99.0, stiffness=999.0, damping=9.0)
        assert frame not in (ENTER, EXIT, ZERO)


def test_replies_of_old_and_new_firmware_are_read(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    protocol = MitProtocol(Ranges(), 1, 0)
    for _ in range(300):
        p, v, t = (int(n) for n in rng.integers((2**16, 2**12, 2**12)))
        six = bytes([7]) + (p << 24 | v << 12 | t).to_bytes(5, "big")
        for data, temperature, error in ((six, None, 0), (six + bytes([41, 3]), 41.0, 3)):
            reply = protocol.reply(data)
            assert reply is not None
            assert (reply.motor_id, reply.temperature, reply.error) == (7, temperature, error)
            assert reply.position == pytest.approx(p * 25.0 / 65535.0 - 12.5, abs=1e-9)
            assert reply.velocity == pytest.approx(v * 152.0 / 4095.0 - 76.0, abs=1e-9)
            assert reply.torque == pytest.approx(t * 24.0 / 4095.0 - 12.0, abs=1e-9)


@pytest.mark.parametrize("length", range(6))
def test_a_reply_that_is_cut_off_is_none(length: int):
    assert MitProtocol(Ranges(), 1, 0).reply(bytes(length)) is None


def test_the_dbc_file_describes_the_same_frames():
    protocol = MitProtocol(Ranges(), 5, 0)
    database = cantools.database.load_string(protocol.dbc(), "dbc")
    assert isinstance(database, cantools.database.Database)
    fields = database.decode_message(5, protocol.command(torque=3.0))
    assert isinstance(fields, dict)
    assert fields["torque"] == pytest.approx(3.0, abs=0.003)  # half a step


def test_the_angle_is_unwrapped_over_the_ends_of_the_range(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    bench = Bench(angle=12.4)
    bench.motor.enter()
    assert bench.motor.angle == pytest.approx(12.4, abs=1e-3)  # a step of the protocol is 0.4 mrad
    travelled = 0.0
    for step in rng.uniform(-11.0, 12.0, 50):  # below half of the range of 25 rad
        travelled += step
        bench.robot._x = travelled * bench.robot.radius
        bench.robot._x_dot = 0.0
        bench.motor.command(0.0)
        bench.motor.reply()
        assert bench.motor.angle == pytest.approx(12.4 + travelled, abs=1e-2)  # it rolls a little between frames


def motor_with_replies(*replies: bytes) -> CanMotor:
    bench = Bench()
    bench.bus.silent = True
    bench.bus.waiting = [can.Message(arbitration_id=0, data=data, is_extended_id=False) for data in replies]
    return bench.motor


def reply_frame(position: float, velocity: float = 0.0, motor_id: int = 1, error: int = 0) -> bytes:
    p, v = round((position + 12.5) * 65535 / 25.0), round((velocity + 76.0) * 4095 / 152.0)
    return bytes([motor_id]) + (p << 24 | v << 12 | 2048).to_bytes(5, "big") + bytes([30, error])


def test_a_position_that_stays_at_the_end_of_its_range_while_the_motor_turns_is_refused():
    motor = motor_with_replies(reply_frame(12.0, 5.0), *[reply_frame(12.5, 5.0)] * 5)
    assert all(motor.reply() for _ in range(5))
    with pytest.raises(DeviceError, match=r"stays at 12\.5 rad.*target\.motor\.zero=true"):
        motor.reply()


def test_errors_of_the_firmware_are_told_in_words():
    motor = motor_with_replies(reply_frame(0.0, error=4))
    with pytest.raises(DeviceError, match="motor 1 reports error 4: under-voltage"):
        motor.reply()


def test_frames_of_others_are_passed_over():
    motor = motor_with_replies(reply_frame(1.0, motor_id=2), b"\x01\x02", reply_frame(3.0))
    reply = motor.reply()
    assert reply is not None
    assert reply.position == pytest.approx(3.0, abs=1e-3)
    assert motor.lost == 0


def test_a_reply_that_comes_late_is_not_taken_for_the_next_one():
    bench = Bench()
    bench.motor.enter()
    bench.bus.silent = True
    bench.motor.command(0.0)
    assert bench.motor.reply() is None
    bench.bus.silent = False
    late = can.Message(arbitration_id=0, data=reply_frame(-3.0), is_extended_id=False)
    bench.bus.waiting.append(late)
    bench.motor.command(0.0)
    reply = bench.motor.reply()
    assert reply is not None
    assert reply.position == pytest.approx(12.4, abs=1e-3)
    assert bench.motor.lost == 1


@pytest.mark.parametrize("error", [can.CanOperationError("gone"), BrokenPipeError(32, "Broken pipe")])
def test_both_kinds_of_a_lost_bus_are_one_error(error: Exception):
    bench = Bench()
    bench.bus.broken = error
    with pytest.raises(DeviceError, match="the CAN bus is lost"):
        bench.motor.enter()
    assert bench.motor.exit() is False  # it tries, and does not raise
    assert EXIT not in bench.bus.sent[:1]


def test_a_motor_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("wipx.hardware.can_motor.PATIENCE", 0.002)
    bench = Bench(settings=MotorSettings(id=9))
    bench.bus.silent = True
    with pytest.raises(DeviceError, match="no reply from motor 9"):
        bench.motor.enter()


def test_a_bus_that_does_not_exist_is_one_line_for_the_user():
    with pytest.raises(InputError, match=r"target\.can: slcan /dev/no_such_adapter cannot be opened") as caught:
        open_bus({"interface": "slcan", "channel": "/dev/no_such_adapter", "sleep_after_open": 0.0}, 0)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match=r"target\.can: nonsense can0 cannot be opened"):
        open_bus({"interface": "nonsense", "channel": "can0"}, 0)
