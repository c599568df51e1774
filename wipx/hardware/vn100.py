"""Messages of a VectorNav VN-100: bytes in, samples out, without a port.

Sources: VectorNav UM001 (registers, messages) and UM004 (checksums). The binary message is the one of 50 bytes with
time of start-up, yaw, pitch, roll, angular rate and acceleration; the text message is VNYMR.
"""

import binascii
import struct
from dataclasses import dataclass
from functools import reduce
from math import radians
from operator import xor
from typing import Protocol

HEADER = b"\xfa\x01\x29\x01"  # sync, group "common", fields 0, 3, 5 and 8 of it
BODY = struct.Struct("<Q9f")  # [ns], [deg] x 3, [rad/s] x 3, [m/s^2] x 3
LENGTH = len(HEADER) + BODY.size + 2
INTERNAL_RATE = 800  # [Hz] of which the rate of binary messages is a fraction
LONGEST_TEXT = 256  # bytes; a line that is longer is garbage


@dataclass(frozen=True)
class ImuSample:
    """One message.

    Attributes:
        time: Since the sensor's start, by its own clock [s]; None where the message has none.
        angles: Roll, pitch, yaw [rad].
        rates: About the sensor's x, y, z [rad/s].
    """

    time: float | None
    angles: tuple[float, float, float]
    rates: tuple[float, float, float]


class Parser(Protocol):
    """Finds messages in a stream that may begin anywhere and be damaged."""

    @property
    def damaged(self) -> int:
        """Messages that were refused for their checksum."""
        ...

    def feed(self, data: bytes) -> list[ImuSample]:
        """The messages that these bytes complete, oldest first."""
        ...


class BinaryParser:
    """The binary message of 50 bytes."""

    def __init__(self) -> None:
        self.damaged = 0
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[ImuSample]:
        """See `Parser`."""
        pending = self._pending
        pending += data
        samples = []
        while (begin := pending.find(HEADER)) >= 0 and len(pending) - begin >= LENGTH:
            frame = bytes(pending[begin : begin + LENGTH])
            if binascii.crc_hqx(frame[1:], 0) == 0:  # over all after the sync, checksum included
                del pending[: begin + LENGTH]
                samples.append(_from_binary(frame))
            else:  # a message may begin inside what looked like one
                self.damaged += 1
                del pending[: begin + 1]
        if begin < 0:
            del pending[: max(0, len(pending) - len(HEADER) + 1)]
        return samples


class TextParser:
    """VNYMR lines, with either checksum."""

    def __init__(self) -> None:
        self.damaged = 0
        self._pending = bytearray()

    def feed(self, data: bytes) -> list[ImuSample]:
        """See `Parser`."""
        self._pending += data
        *lines, rest = self._pending.split(b"\n")
        self._pending = bytearray(rest[-LONGEST_TEXT:])
        samples = []
        for line in lines:
            begin = line.rfind(b"$VNYMR,")
            if begin < 0:
                continue
            try:
                samples.append(_from_text(bytes(line[begin + 1 :]).strip()))
            except ValueError:
                self.damaged += 1
        return samples


def text_message(content: str) -> bytes:
    """A line of the text protocol with its checksum.

    Args:
        content: What stands between "$" and "*".
    """
    return f"${content}*{reduce(xor, content.encode(), 0):02X}\r\n".encode()


def _from_binary(frame: bytes) -> ImuSample:
    nanoseconds, yaw, pitch, roll, *rates = BODY.unpack_from(frame, len(HEADER))[:7]
    return ImuSample(nanoseconds / 1e9, (radians(roll), radians(pitch), radians(yaw)), (rates[0], rates[1], rates[2]))


def _from_text(line: bytes) -> ImuSample:
    """From a line without "$".

    Raises:
        ValueError: it is damaged.
    """
    content, star, checksum = line.partition(b"*")
    right = reduce(xor, content, 0) if len(checksum) == 2 else binascii.crc_hqx(content, 0)
    numbers = content.split(b",")[1:]
    if not star or int(checksum, 16) != right or len(numbers) != 12:
        raise ValueError(line)
    yaw, pitch, roll = (radians(float(number)) for number in numbers[:3])
    x, y, z = (float(number) for number in numbers[9:])
    return ImuSample(None, (roll, pitch, yaw), (x, y, z))
