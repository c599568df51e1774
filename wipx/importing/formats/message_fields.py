"""A decoded message as named numbers.

Fields of nested messages are joined by a point (`angular_velocity.y`). Elements of a list are numbered (`data[0]`), or
named where the message names them: `position.elbow` is the position of the joint that a JointState calls elbow.
Quaternions also give `roll`, `pitch` and `yaw`. Text, and lists longer than `LONGEST`, are no numbers of a robot and
are left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import asin, atan2, copysign, pi
from typing import Any

import numpy as np

LONGEST = 256  # elements; images, maps and point clouds are longer
LABELS = ("name", "names", "joint_names", "interface_names")
LABELLED_LISTS = ("interface_values",)  # control_msgs/DynamicJointState: one element for each joint


class NameTwiceError(ValueError):
    """A message gives one name to two elements; the text is the name."""


def fields_of(message: object) -> dict[str, float]:
    """The numbers of a message by the path of their field, without its header.

    Args:
        message: A decoded ROS message, or the content of a JSON message.

    Raises:
        NameTwiceError: two elements have one name.
    """
    fields: dict[str, float] = {}
    for name, value in _members(message):
        if name != "header":
            for path, number in _numbers(name, value, _labels(message)):
                if path in fields:
                    raise NameTwiceError(path)
                fields[path] = number
    return fields


def stamp_of(message: object) -> int | None:
    """The stamp in the header of a message [ns]; None where it has none or left it at zero."""
    header = dict(_members(message)).get("header")
    stamp = dict(_members(header)).get("stamp") if header is not None else None
    if stamp is None:
        return None
    nanoseconds = duration(stamp)
    return nanoseconds or None


def duration(time: object) -> int:
    """A ROS time or duration [ns]."""
    parts = dict(_members(time))
    seconds = parts.get("sec", parts.get("secs", 0))
    rest = parts.get("nanosec", parts.get("nsec", parts.get("nsecs", 0)))
    return int(seconds) * 1_000_000_000 + int(rest)


def _members(message: object) -> Iterator[tuple[str, Any]]:
    if isinstance(message, Mapping):
        yield from ((str(name), value) for name, value in message.items())
    elif hasattr(message, "__msgtype__"):
        yield from vars(message).items()


def _labels(message: object) -> Sequence[str]:
    members = dict(_members(message))
    for name in LABELS:
        value = members.get(name)
        if isinstance(value, list) and value and all(isinstance(label, str) for label in value):
            return value
    return ()


def _numbers(path: str, value: object, labels: Sequence[str]) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float | np.number):
        yield path, float(value)
    elif isinstance(value, np.ndarray | list):
        if len(value) <= LONGEST:
            yield from _elements(path, value, labels)
    elif _is_time(value):
        yield path, duration(value) / 1e9
    elif isinstance(value, Mapping) or hasattr(value, "__msgtype__"):
        own = _labels(value) or labels
        for name, member in _members(value):
            yield from _numbers(f"{path}.{name}", member, own)
        yield from _angles(path, value)


def _elements(path: str, value: np.ndarray | list, labels: Sequence[str]) -> Iterator[tuple[str, float]]:
    plain = isinstance(value, np.ndarray) or all(isinstance(element, int | float) for element in value)
    named = len(labels) == len(value) and (plain or path.endswith(LABELLED_LISTS))
    elements = value.tolist() if isinstance(value, np.ndarray) else value
    for k, element in enumerate(elements):
        yield from _numbers(f"{path}.{labels[k]}" if named else f"{path}[{k}]", element, labels)


def _is_time(value: object) -> bool:
    kind = str(getattr(value, "__msgtype__", ""))
    return kind.endswith(("/Time", "/Duration")) or (isinstance(value, Mapping) and set(value) == {"sec", "nanosec"})


def _angles(path: str, value: object) -> Iterator[tuple[str, float]]:
    """Roll, pitch, yaw of a quaternion, turned about z, then y, then x [rad]."""
    parts = dict(_members(value))
    if set(parts) - {"__msgtype__"} != {"x", "y", "z", "w"}:
        return
    x, y, z, w = (parts[axis] for axis in "xyzw")
    if not all(isinstance(number, int | float) for number in (x, y, z, w)):
        return
    yield f"{path}.roll", atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    sine = 2.0 * (w * y - z * x)
    yield f"{path}.pitch", asin(sine) if abs(sine) < 1.0 else copysign(pi / 2.0, sine)
    yield f"{path}.yaw", atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
