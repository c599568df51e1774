"""Binary logs of VectorNav sensors: the messages as they left the port, one after the other.

Source: VectorNav UM001, binary output messages. Groups common, time, IMU, GNSS (without the satellites), attitude and
INS are known; the stamp is the time since the sensor's start.
"""

import binascii
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from wipx.core.errors import InputError
from wipx.importing.log_format import NO_STAMP, Chunk, LogFormat, Loss, Rows, Wanted, open_binary

SYNC = 0xFA
STREAM = "vectornav"
BLOCK = 1 << 20  # bytes
LONGEST_MESSAGE = 1024  # bytes; the sensor's own limit is 600

# Fields of the groups by bit: names of the numbers, their types (of `struct`), their unit.
_YPR = ("yaw pitch roll", "fff", "deg")
_QUATERNION = ("qx qy qz qw", "ffff", "1")
_RATES = ("rate_x rate_y rate_z", "fff", "rad/s")
_ACCELERATION = ("accel_x accel_y accel_z", "fff", "m/s^2")
_MAGNETIC = ("mag_x mag_y mag_z", "fff", "G")
_DELTA_THETA = ("delta_t delta_theta_x delta_theta_y delta_theta_z", "ffff", "")
_DELTA_VEL = ("delta_vel_x delta_vel_y delta_vel_z", "fff", "m/s")


def _triple(name: str, code: str = "f", unit: str = "") -> tuple[str, str, str]:
    return f"{name}_x {name}_y {name}_z", code * 3, unit


COMMON = (
    ("time_startup", "Q", "ns"),
    ("time_gps", "Q", "ns"),
    ("time_sync_in", "Q", "ns"),
    _YPR,
    _QUATERNION,
    _RATES,
    ("latitude longitude altitude", "ddd", ""),
    _triple("velocity", unit="m/s"),
    _ACCELERATION,
    ("imu_accel_x imu_accel_y imu_accel_z imu_rate_x imu_rate_y imu_rate_z", "ffffff", ""),
    ("mag_x mag_y mag_z temperature pressure", "fffff", ""),
    (f"{_DELTA_THETA[0]} {_DELTA_VEL[0]}", "fffffff", ""),
    ("ins_status", "H", ""),
    ("sync_in_count", "I", ""),
    ("time_gps_pps", "Q", "ns"),
)
TIME = (
    ("time_startup", "Q", "ns"),
    ("time_gps", "Q", "ns"),
    ("gps_tow", "Q", "ns"),
    ("gps_week", "H", ""),
    ("time_sync_in", "Q", "ns"),
    ("time_gps_pps", "Q", "ns"),
    ("utc_year utc_month utc_day utc_hour utc_minute utc_second utc_ms", "bBBBBBH", ""),
    ("sync_in_count", "I", ""),
    ("sync_out_count", "I", ""),
    ("time_status", "B", ""),
)
IMU = (
    ("imu_status", "H", ""),
    _triple("uncomp_mag", unit="G"),
    _triple("uncomp_accel", unit="m/s^2"),
    _triple("uncomp_rate", unit="rad/s"),
    ("temperature", "f", "degC"),
    ("pressure", "f", "kPa"),
    _DELTA_THETA,
    _DELTA_VEL,
    _MAGNETIC,
    _ACCELERATION,
    _RATES,
    ("sensor_saturation", "H", ""),
)
GNSS = (
    ("gnss_year gnss_month gnss_day gnss_hour gnss_minute gnss_second gnss_ms", "bBBBBBH", ""),
    ("gnss_tow", "Q", "ns"),
    ("gnss_week", "H", ""),
    ("gnss_satellites", "B", ""),
    ("gnss_fix", "B", ""),
    ("gnss_latitude gnss_longitude gnss_altitude", "ddd", ""),
    _triple("gnss_ecef", "d", "m"),
    _triple("gnss_velocity_ned", unit="m/s"),
    _triple("gnss_velocity_ecef", unit="m/s"),
    _triple("gnss_position_uncertainty", unit="m"),
    ("gnss_velocity_uncertainty", "f", "m/s"),
    ("gnss_time_uncertainty", "f", "s"),
)
ATTITUDE = (
    ("vpe_status", "H", ""),
    _YPR,
    _QUATERNION,
    (" ".join(f"dcm_{row}{column}" for column in range(3) for row in range(3)), "f" * 9, "1"),
    _triple("mag_ned", unit="G"),
    _triple("accel_ned", unit="m/s^2"),
    _triple("linear_accel", unit="m/s^2"),
    _triple("linear_accel_ned", unit="m/s^2"),
    ("yaw_uncertainty pitch_uncertainty roll_uncertainty", "fff", "deg"),
)
INS = (
    ("ins_status", "H", ""),
    ("latitude longitude altitude", "ddd", ""),
    _triple("ecef", "d", "m"),
    _triple("velocity_body", unit="m/s"),
    _triple("velocity_ned", unit="m/s"),
    _triple("velocity_ecef", unit="m/s"),
    _triple("mag_ecef", unit="G"),
    _triple("accel_ecef", unit="m/s^2"),
    _triple("linear_accel_ecef", unit="m/s^2"),
    ("position_uncertainty", "f", "m"),
    ("velocity_uncertainty", "f", "m/s"),
)
GROUPS = (COMMON, TIME, IMU, GNSS, ATTITUDE, INS)


@dataclass(frozen=True)
class VectorNavLog(LogFormat):
    """A file of binary messages; its one stream is "vectornav"."""

    def reads(self, path: Path) -> bool:
        """Whether it ends in .vnb, .vn or .bin and has messages at its beginning."""
        if not path.is_file() or path.suffix.lower() not in (".vnb", ".vn", ".bin"):
            return False
        with open_binary(path) as file:
            return any(True for _ in _Scan().feed(file.read(16 * LONGEST_MESSAGE)))

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        size = max(path.stat().st_size, 1)
        rows, scan = Rows(), _Scan()
        with open_binary(path) as file:
            while block := file.read(BLOCK):
                rows.done = file.tell() / size
                for layout, payload in scan.feed(block):
                    yield from _added(rows, layout, payload)
        for layout, payload in scan.rest():
            yield from _added(rows, layout, payload)
        yield from rows.rest()
        if not scan.messages:
            raise InputError(f"{path}: no binary message of a VectorNav sensor in the file; check the file")
        if scan.damaged:
            yield Loss(str(path), "damaged messages are left out (their checksums are wrong)", scan.damaged)
        if scan.garbage:
            yield Loss(str(path), f"{scan.garbage} bytes belong to no whole message")


def _added(rows: Rows, layout: "_Layout", payload: bytes) -> Iterator[Chunk]:
    fields = layout.numbers(payload)
    stamp = int(fields["time_startup"]) if "time_startup" in fields else NO_STAMP
    stamp = stamp if abs(stamp) < 2**62 else NO_STAMP
    values = tuple(fields.values())
    yield from rows.add(STREAM, layout.names, values, header=stamp, kind="binary messages", units=layout.units)


@dataclass(frozen=True)
class _Layout:
    """What a message with given groups and fields holds."""

    body: struct.Struct
    names: tuple[str, ...]
    units: dict[str, str]

    def numbers(self, payload: bytes) -> dict[str, float]:
        return dict(zip(self.names, map(float, self.body.unpack(payload)), strict=True))


@cache
def _layout(groups: int, masks: tuple[int, ...]) -> _Layout | None:
    """The layout of a message; None where the length of a field is not known."""
    codes, names, units = "<", [], {}
    present = [group for group in range(8) if groups >> group & 1]
    for group, mask in zip(present, masks, strict=True):
        for bit in (bit for bit in range(16) if mask >> bit & 1):
            if group >= len(GROUPS) or bit >= len(GROUPS[group]):
                return None
            listed, code, unit = GROUPS[group][bit]
            for name in listed.split():
                # A field that two groups hold is the same number; the copy keeps its place under a name of its own.
                names.append(name if name not in names else f"{name}_{group + 1}")
                units[names[-1]] = unit
            codes += code
    return _Layout(struct.Struct(codes), tuple(names), {name: unit for name, unit in units.items() if unit})


class _Scan:
    """Finds messages in a stream that may begin anywhere and be damaged."""

    def __init__(self) -> None:
        self.messages = 0
        self.damaged = 0
        self.garbage = 0
        self.pending = b""

    def feed(self, data: bytes) -> Iterator[tuple[_Layout, bytes]]:
        """Layout and content of the messages that these bytes complete."""
        content = self.pending + data
        place = 0
        while True:
            begin = content.find(SYNC, place)
            if begin < 0:
                self.garbage += len(content) - place
                place = len(content)
                break
            self.garbage += begin - place
            place = begin
            found = self._message(content, begin)
            if found is None:
                break
            length, layout, payload = found
            if layout is None:
                self.garbage += length
            else:
                self.messages += 1
                yield layout, payload
            place = begin + length
        self.pending = content[place:]

    def rest(self) -> Iterator[tuple[_Layout, bytes]]:
        """The messages behind what looks like the beginning of one that the file does not end."""
        while self.pending:
            self.garbage += 1
            content, self.pending = self.pending[1:], b""
            yield from self.feed(content)

    def _message(self, content: bytes, begin: int) -> tuple[int, _Layout | None, bytes] | None:
        """Length, layout and content of what begins with a sync byte; None where its end has not come yet."""
        if begin + 2 > len(content):
            return None
        groups = content[begin + 1]
        count = groups.bit_count()
        head = 2 + 2 * count
        if groups == 0 or groups >> len(GROUPS):
            return 1, None, b""
        if begin + head > len(content):
            return None
        layout = _layout(groups, struct.unpack_from(f"<{count}H", content, begin + 2))
        if layout is None or layout.body.size == 0 or layout.body.size > LONGEST_MESSAGE:
            return 1, None, b""
        end = begin + head + layout.body.size + 2
        if end > len(content):
            return None
        # The checksum covers all after the sync, itself included (UM001: the remainder is then 0).
        if binascii.crc_hqx(content[begin + 1 : end], 0):
            self.damaged += 1
            return 1, None, b""
        return end - begin, layout, content[begin + head : end - 2]
