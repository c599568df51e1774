"""What the name of a column says: what it holds, of which joint, in which unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Literal

import numpy as np

Role = Literal["position", "rate", "target", "force", "command", "other", "unknown"]

POSITION = {"q", "pos", "position", "positions", "angle", "ang", "theta", "phi", "enc", "encoder", "qpos"}
RATE = {"vel", "velocity", "velocities", "qd", "dq", "dot", "rate", "speed", "qdot", "omega", "qvel"}
FORCE = {"tau", "torque", "effort", "eff", "trq", "moment", "force", "load", "frc", "mot"}
CURRENT = {"current", "cur", "curr", "amp", "amps", "iq", "i"}
TARGET = {
    "goal",
    "target",
    "tgt",
    "cmd",
    "command",
    "commanded",
    "des",
    "desired",
    "ref",
    "qref",
    "reference",
    "setpoint",
}
MEASURED = {"meas", "measured", "actual", "act", "state", "present", "fb", "feedback", "msr"}
OTHER = {"acc", "accel", "acceleration", "qdd", "ddq", "temp", "temperature", "volt", "voltage", "error", "err", "mode"}
OTHER |= {"status", "seq", "id", "index", "qlink"}
UNITS = {
    "rad": "rad",
    "radians": "rad",
    "deg": "deg",
    "degree": "deg",
    "degrees": "deg",
    "turns": "turn",
    "ticks": "ticks",
    "tick": "ticks",
    "counts": "ticks",
    "raw": "ticks",
    "mm": "mm",
    "rpm": "rpm",
    "nm": "N m",
    "mnm": "mN m",
    "ma": "mA",
}
GENERIC = {"joint", "joints", "j", "axis", "link", "motor", "servo", "actuator", "drive", "m", "states"}
ALIKE = 0.6  # least likeness of names that says something


@dataclass(frozen=True)
class ColumnName:
    """A name of a column, read.

    Attributes:
        name: The name.
        role: What the column holds, as far as the name says; "command" may be a force or a position's target.
        rest: Words that are left for the joint.
        unit: Unit that the name ends in; empty for none.
        measured: Whether the name says that it was measured.
        current: Whether it is a motor's current.
    """

    name: str
    role: Role
    rest: tuple[str, ...]
    unit: str
    measured: bool
    current: bool


def words_of(name: str) -> list[str]:
    """Lower-case words and numbers of a name, e.g. tauJ3 -> tau, j, 3."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    return re.findall(r"[a-z]+|\d+", spaced.lower())


def read_name(name: str) -> ColumnName:
    """What a column's name says."""
    words = words_of(name)
    unit = next((UNITS[word] for word in words[1:] if word in UNITS), "")
    found = set(words)
    current = bool(found & CURRENT)
    role: Role = "unknown"
    if found & OTHER:
        role = "other"
    elif found & TARGET:
        role = "other" if found & RATE else "command" if found & (FORCE | CURRENT) else "target"
    elif found & RATE:
        role = "rate"
    elif found & FORCE or current:
        role = "force"
    elif words and words[0] == "u":
        role = "force" if found & MEASURED else "command"
    elif found & POSITION:
        role = "position"
    said = POSITION | RATE | FORCE | CURRENT | TARGET | MEASURED | set(UNITS) | {"u"}
    rest = tuple(word for word in words if word not in said)
    return ColumnName(name, role, rest, unit, bool(found & MEASURED), current)


def likeness(rest: Sequence[str], joint: str) -> float:
    """How alike the words of a column and a joint's name are, from 0 to 1; common words such as joint do not count."""
    mine = [word for word in rest if word not in GENERIC]
    all_words = words_of(joint)
    theirs = [word for word in all_words if word not in GENERIC] or all_words
    if not mine or not theirs:
        return 1.0 if list(rest) == all_words and rest else 0.0
    total = sum(max(_alike(a, b) for b in theirs) for a in mine) + sum(max(_alike(a, b) for a in mine) for b in theirs)
    return total / (len(mine) + len(theirs))


def _alike(a: str, b: str) -> float:
    if a == b:
        return 1.0
    if a.isdigit() or b.isdigit():
        return 0.0
    if min(len(a), len(b)) >= 2 and (a.startswith(b) or b.startswith(a)):
        return 0.8
    return 0.7 if SequenceMatcher(None, a, b).ratio() >= 0.8 else 0.0


@dataclass(frozen=True)
class Named:
    """Columns of one role by joint.

    Attributes:
        columns: Number of the column among those that were offered, by joint; -1 for none.
        certain: Whether the names say so, by joint; else the order of the columns does.
    """

    columns: tuple[int, ...]
    certain: tuple[bool, ...]


def columns_by_name(names: Sequence[ColumnName], joints: Sequence[str]) -> Named:
    """Which of the columns, all of one role, belongs to which joint: by name, what is left by number or order."""
    from scipy.optimize import linear_sum_assignment

    found, certain = [-1] * len(joints), [False] * len(joints)
    if not names:
        return Named(tuple(found), tuple(certain))
    counted = _counted(names, joints)
    if counted is not None:
        return Named(counted, tuple(certain))
    scores = np.array([[likeness(name.rest, joint) for name in names] for joint in joints])
    for j, c in zip(*linear_sum_assignment(-scores), strict=True):
        rivals = np.concatenate([np.delete(scores[j], c), np.delete(scores[:, c], j)])
        if scores[j, c] >= ALIKE and scores[j, c] > rivals.max(initial=0.0) + 0.1:
            found[j], certain[j] = int(c), True
    left = [c for c in range(len(names)) if c not in found]
    for j in (j for j in range(len(joints)) if found[j] < 0):
        if left:
            found[j] = left.pop(0)
    return Named(tuple(found), tuple(certain))


def _counted(names: Sequence[ColumnName], joints: Sequence[str]) -> tuple[int, ...] | None:
    """Columns in the order of their numbers, where numbers are all that they have and none that the joints have."""
    rests = [[word for word in name.rest if word not in GENERIC] for name in names]
    if len(names) != len(joints) or not all(len(rest) == 1 and rest[0].isdigit() for rest in rests):
        return None
    numbers = [int(rest[0]) for rest in rests]
    of_joints = {int(word) for joint in joints for word in words_of(joint) if word.isdigit()}
    if set(numbers) == of_joints or len(set(numbers)) < len(numbers):
        return None
    return tuple(int(c) for c in np.argsort(numbers))
