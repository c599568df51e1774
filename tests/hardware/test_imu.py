"""Messages of a VN-100: checksums, damage, which angle is the pitch, and how old it is."""

import binascii
import struct

import numpy as np
import pytest
from hardware.fake_lines import QUIET, WIP, Bench

from wipx.core.errors import InputError
from wipx.hardware.emulated_devices import EmulatedImu, EmulatedRobot
from wipx.hardware.imu import Imu, ImuSettings, PitchSample, open_imu, times
from wipx.hardware.vn100 import LENGTH, BinaryParser, TextParser, text_message


def crc16(data: bytes) -> int:
    """The checksum as the sensor's manual writes it in C."""
    crc = 0
    for byte in data:
        crc = (crc >> 8 | crc << 8) & 0xFFFF
        crc ^= byte
        crc ^= (crc & 0xFF) >> 4
        crc ^= crc << 12 & 0xFFFF
        crc ^= (crc & 0xFF) << 5 & 0xFFFF
    return crc


def binary(seconds: float, yaw: float, pitch: float, roll: float, rates: tuple[float, float, float]) -> bytes:
    body = b"\x01\x29\x01" + struct.pack("<Q9f", round(seconds * 1e9), yaw, pitch, roll, *rates, 0.0, 0.0, -9.81)
    return b"\xfa" + body + struct.pack(">H", crc16(body))


def test_a_message_is_read_as_the_manual_describes_it(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    parser = BinaryParser()
    for _ in range(200):
        yaw, pitch, roll = rng.uniform(-180.0, 180.0, 3)
        x, y, z = (float(rate) for rate in rng.normal(size=3))
        (sample,) = parser.feed(binary(12.25, yaw, pitch, roll, (x, y, z)))
        assert sample.time == 12.25
        assert sample.angles == pytest.approx(np.radians([roll, pitch, yaw]), rel=1e-6)  # sent as float32
        assert sample.rates == pytest.approx((x, y, z), rel=1e-6)
    assert parser.damaged == 0


@pytest.mark.parametrize("chunk", [1, 7, 50, 333])
def test_the_parser_finds_its_way_through_garbage_and_damage(chunk: int, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    stream, expected = bytearray(), []
    for k in range(100):
        message = bytearray(binary(k, 0.0, 1.0, 2.0, (0.0, 0.0, 0.0)))
        fate = rng.integers(4)
        if fate == 0:  # one bit is flipped
            place = rng.integers(len(message))
            message[place] ^= 1 << rng.integers(8)
        elif fate == 1:  # the end is missing
            del message[rng.integers(len(message)) :]
        else:
            expected.append(float(k))
        stream += message
        if rng.integers(2):  # no false beginning: without it a good message could be taken for another's body
            stream += rng.integers(0, 0xFA, rng.integers(60), dtype=np.uint8).tobytes()
    parser = BinaryParser()
    found = [s.time for k in range(0, len(stream), chunk) for s in parser.feed(bytes(stream[k : k + chunk]))]
    found += [s.time for s in parser.feed(bytes(LENGTH))]  # what had waited for the rest of a message cut off
    assert found == expected


def test_a_header_inside_a_damaged_message_is_tried_too():
    good = binary(3.0, 0.0, 1.0, 2.0, (0.0, 0.0, 0.0))
    assert [s.time for s in BinaryParser().feed(good[:20] + good)] == [3.0]


def text(pitch: float, rate: float, *, crc: bool = False) -> bytes:
    content = f"VNYMR,+010.000,{pitch:+08.3f},-002.000,+1,+0,+1,+0,+0,-9.8,+00.1,{rate:+010.6f},-00.3"
    return f"${content}*{binascii.crc_hqx(content.encode(), 0):04X}\r\n".encode() if crc else text_message(content)


@pytest.mark.parametrize("crc", [False, True])
def test_text_messages_are_read_with_either_checksum(crc: bool):
    (sample,) = TextParser().feed(b"#\xff$VNYMR,+0" + text(5.0, 0.25, crc=crc))
    assert sample.time is None
    assert sample.angles == pytest.approx(np.radians([-2.0, 5.0, 10.0]))
    assert sample.rates == pytest.approx((0.1, 0.25, -0.3))


def test_damaged_text_messages_are_refused_and_counted(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    parser = TextParser()
    message = text(5.0, 0.25)
    for _ in range(100):
        place = int(rng.integers(8, len(message) - 5))  # between the name and the checksum
        damaged = message[:place] + bytes([message[place] ^ 1 << int(rng.integers(7))]) + message[place + 1 :]
        assert parser.feed(damaged + message)[-1:] == parser.feed(message)
    assert parser.damaged > 0


def test_lines_that_never_end_are_forgotten():
    parser = TextParser()
    for _ in range(100):
        parser.feed(b"x" * 1000)
    assert len(parser.feed(b"\r\n" + text(1.0, 0.0))) == 1


@pytest.mark.parametrize(
    ("settings", "theta", "theta_dot"),
    [
        ({}, 0.2, 5.0),
        ({"sign": -1, "zero": 0.05}, -0.25, -5.0),
        ({"angle": "roll"}, -3.1, 4.0),
        ({"angle": "roll", "zero": np.pi}, np.pi - 3.1, 4.0),  # mounted upside down
        ({"angle": "yaw"}, 0.3, 6.0),
    ],
)
def test_which_angle_is_the_pitch_is_a_setting(settings: dict, theta: float, theta_dot: float):
    class Port:
        def read(self, size: int) -> bytes:
            return binary(1.0, np.degrees(0.3), np.degrees(0.2), np.degrees(-3.1), (4.0, 5.0, 6.0))

        def reset_input_buffer(self) -> None:
            return

        def close(self) -> None:
            return

    sample = Imu(Port(), ImuSettings("nowhere", **settings)).read()
    assert sample is not None
    assert (sample.theta, sample.theta_dot) == pytest.approx((theta, theta_dot), abs=1e-6)


def test_the_age_grows_until_something_new_comes():
    bench = Bench()
    bench.imu.begin()
    assert bench.imu.age(10.0) == float("inf")
    newest = bench.imu.read()
    assert newest is not None
    bench.port.silent = True
    assert bench.imu.read() is None
    assert bench.imu.age(newest.read_at + 0.5) == pytest.approx(0.5)


def test_samples_are_placed_by_the_sensors_clock():
    own = np.arange(0.0, 1.0, 0.0025)
    read = own + 100.0 + np.random.default_rng(0).uniform(0.0005, 0.003, len(own))
    samples = [PitchSample(at, clock, 0.0, 0.0) for at, clock in zip(read, own, strict=True)]
    placed = times(samples)
    np.testing.assert_allclose(np.diff(placed), 0.0025, rtol=1e-6)
    assert np.all(placed <= read)
    assert placed[0] == pytest.approx(100.0005, abs=1e-4)  # the shortest of 400 waits


def test_the_emulated_sensor_does_what_the_driver_asks_of_it():
    class Port:
        def __init__(self) -> None:
            self.asked = b""

        def write(self, data: bytes) -> None:
            self.asked += data

    for message, parser in (("binary", BinaryParser()), ("text", TextParser())):
        port, opened = Port(), ImuSettings("nowhere", message=message, rate=100)
        imu = EmulatedImu(EmulatedRobot(WIP, QUIET, 0.1, 0.0), QUIET, np.random.default_rng(0), 0.0)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("serial.serial_for_url", lambda *_, port=port, **__: port)
            open_imu(opened)
        assert b"VNERR" not in imu.receive(port.asked)
        assert imu.period == pytest.approx(0.01)
        (sample,) = parser.feed(imu.message(1.0))
        assert sample.angles[1] == pytest.approx(0.1, abs=1e-5)  # text has 1e-3 degrees


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"message": "ascii"}, "target.imu.message: unknown value 'ascii'"),
        ({"angle": "tilt"}, "target.imu.angle: unknown value 'tilt'"),
        ({"sign": 0}, "target.imu.sign is 0, expected 1 or -1"),
        ({"rate": 300}, "target.imu.rate is 300 Hz, expected a divisor of 800"),
        ({"rate": 400, "message": "text"}, "expected 1 to 200 for text messages"),
    ],
)
def test_settings_that_the_sensor_lacks_are_refused(settings: dict, message: str):
    with pytest.raises(InputError, match=message):
        ImuSettings("nowhere", **settings)


def test_a_port_that_does_not_exist_is_one_line_for_the_user():
    with pytest.raises(InputError, match=r"target\.imu: /dev/no_such_port cannot be opened"):
        open_imu(ImuSettings("/dev/no_such_port"))
