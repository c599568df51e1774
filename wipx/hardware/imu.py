"""A VN-100 on a serial line: the pitch of the body, its rate, and how old they are.

The bytes are in `vn100`.
"""

import time
from dataclasses import dataclass
from math import pi, remainder
from typing import Protocol

import numpy as np
import serial

from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.hardware.safety import DeviceError
from wipx.hardware.vn100 import INTERNAL_RATE, BinaryParser, Parser, TextParser, text_message

ANGLES = ("roll", "pitch", "yaw")  # each about the sensor's axis of the same number: x, y, z
PARSERS = {"binary": BinaryParser, "text": TextParser}
FASTEST_TEXT = 200  # [Hz]
CHUNK = 4096  # bytes taken at a time: a tenth of a second of binary messages at 800 Hz


@dataclass(frozen=True)
class ImuSettings:
    """How the IMU is connected and built in: theta = sign * angle - zero.

    Attributes:
        port: Device, or URL of `serial.serial_for_url`.
        baud: Of the line.
        message: "binary" (50 bytes, with the sensor's clock) or "text" (VNYMR).
        rate: Messages per second that the sensor is told to send [Hz]; None leaves it as it is.
        angle: Which of its angles is the pitch of the body: "roll", "pitch" or "yaw".
        sign: 1 or -1: positive theta moves the centre of mass to -x.
        zero: sign * angle when the body's axis is upright [rad].
    """

    port: str
    baud: int = 921600
    message: str = "binary"
    rate: int | None = 400
    angle: str = "pitch"
    sign: int = 1
    zero: float = 0.0

    def __post_init__(self) -> None:
        check_positive(baud=self.baud)
        for name, value, valid in (("message", self.message, PARSERS), ("angle", self.angle, ANGLES)):
            if value not in valid:
                raise unknown_name("value", value, valid, f"target.imu.{name}")
        if self.sign not in (1, -1):
            raise InputError(f"target.imu.sign is {self.sign}, expected 1 or -1")
        fits = self.rate is None or (
            self.rate > 0
            and (INTERNAL_RATE % self.rate == 0 if self.message == "binary" else self.rate <= FASTEST_TEXT)
        )
        if not fits:
            valid = f"a divisor of {INTERNAL_RATE}" if self.message == "binary" else f"1 to {FASTEST_TEXT}"
            raise InputError(f"target.imu.rate is {self.rate} Hz, expected {valid} for {self.message} messages")


@dataclass(frozen=True)
class PitchSample:
    """The body's pitch.

    Attributes:
        read_at: When it was read, by the computer's clock [s].
        sensor_time: When it was measured, by the sensor's clock [s]; None where its messages have no time.
        theta: Pitch [rad].
        theta_dot: Its rate [rad/s].
    """

    read_at: float
    sensor_time: float | None
    theta: float
    theta_dot: float


class Port(Protocol):
    """What is used of `serial.Serial`."""

    def read(self, size: int) -> bytes:
        """What has come, `size` bytes at most."""
        ...

    def reset_input_buffer(self) -> None:
        """Forget what has come."""
        ...

    def close(self) -> None:
        """Close it."""
        ...


class Imu:
    """Reads without waiting.

    Args:
        port: Opened, with a timeout of zero.
        settings: Of the sensor.

    Attributes:
        samples: All since `begin`, oldest first.
    """

    def __init__(self, port: Port, settings: ImuSettings) -> None:
        self.samples: list[PitchSample] = []
        self._port = port
        self._settings = settings
        self._axis = ANGLES.index(settings.angle)
        self._parser: Parser = PARSERS[settings.message]()

    def begin(self) -> None:
        """Forget the past, also what waits in the line's buffer.

        Raises:
            DeviceError: the line is lost.
        """
        try:
            self._port.reset_input_buffer()
        except OSError as error:
            raise _lost(self._settings, error) from error
        self._parser = PARSERS[self._settings.message]()
        self.samples = []

    def read(self) -> PitchSample | None:
        """The newest sample of those that have come since the last call; None where none has.

        Raises:
            DeviceError: the line is lost.
        """
        fresh = []
        try:
            while data := self._port.read(CHUNK):
                fresh += self._parser.feed(data)
                if len(data) < CHUNK:
                    break
        except OSError as error:  # serial.SerialException is one
            raise _lost(self._settings, error) from error
        now = time.perf_counter()  # after the reading, so that nothing is read before it was measured
        for sample in fresh:
            theta = remainder(self._settings.sign * sample.angles[self._axis] - self._settings.zero, 2.0 * pi)
            rate = self._settings.sign * sample.rates[self._axis]
            self.samples.append(PitchSample(now, sample.time, theta, rate))
        return self.samples[-1] if fresh else None

    def age(self, now: float) -> float:
        """Time since the newest sample was read [s]."""
        return now - self.samples[-1].read_at if self.samples else float("inf")

    @property
    def damaged(self) -> int:
        """Messages since `begin` that were refused for their checksum."""
        return self._parser.damaged

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def open_imu(settings: ImuSettings) -> Imu:
    """The IMU of these settings, told to send what is wanted; nothing is written to its permanent memory.

    Raises:
        InputError: the port cannot be opened.
    """
    try:
        port = serial.serial_for_url(settings.port, baudrate=settings.baud, timeout=0)
        if settings.rate is not None:
            port.write(_registers(settings))
    except (OSError, ValueError) as error:
        remedy = "check target.imu.port, the cable and your right to use it (docs/hardware.md)"
        raise InputError(f"target.imu: {settings.port} cannot be opened ({error}); {remedy}") from error
    return Imu(port, settings)


def times(samples: list[PitchSample]) -> np.ndarray:
    """When the samples were measured, by the computer's clock, shape (N,) [s].

    The sensor's clock has no jitter but another zero; the sample that waited least before it was read gives the
    difference. A delay that all samples share, such as transport, remains.
    """
    read = np.array([sample.read_at for sample in samples])
    own = [sample.sensor_time for sample in samples if sample.sensor_time is not None]
    return np.array(own) + np.min(read - own) if own else read


def _registers(settings: ImuSettings) -> bytes:
    """Commands that make the sensor send the wanted messages on its main port, and no others."""
    if settings.rate is None:
        return b""
    if settings.message == "binary":
        divisor = INTERNAL_RATE // settings.rate
        return text_message("VNWRG,06,0") + text_message(f"VNWRG,75,1,{divisor},01,0129")
    return (
        text_message("VNWRG,75,0,4,01,0129") + text_message("VNWRG,06,14") + text_message(f"VNWRG,07,{settings.rate}")
    )


def _lost(settings: ImuSettings, error: Exception) -> DeviceError:
    return DeviceError(f"the line of the IMU on {settings.port} is lost ({error}); check its cable")
