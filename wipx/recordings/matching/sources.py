"""Which columns of a log may be positions, rates, forces and targets of which joint, by their names."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError
from wipx.recordings.matching.drives import FOLLOWS_CLOSELY, FOLLOWS_LIKE_OTHERS, follows
from wipx.recordings.matching.log import Log, same_columns
from wipx.recordings.matching.names import ALIKE, ColumnName, columns_by_name, likeness, read_name


@dataclass(frozen=True)
class JointColumns:
    """Columns of one joint; empty names for those that the log lacks.

    Attributes:
        position: Of its position.
        certain: Whether its name says so.
        target: Of its position's target.
        command: Of its commanded force.
        measured: Of the force or current that its drive reports.
        rate: Of its measured rate.
    """

    position: str
    certain: bool
    target: str = ""
    command: str = ""
    measured: str = ""
    rate: str = ""


def joint_columns(logs: Sequence[Log], joints: Sequence[str]) -> tuple[JointColumns, ...]:
    """Columns of each joint, by name, or by order where the names do not say.

    Raises:
        InputError: the logs have fewer positions than the robot has joints.
    """
    names = [read_name(name) for name in same_columns(logs)]
    moving = [name for name in names if any(np.ptp(log.columns[name.name]) > 0.0 for log in logs)]
    positions = [name for name in names if name.role == "position"]
    positions += [n for n in names if n.role == "unknown" and max(likeness(n.rest, joint) for joint in joints) >= ALIKE]
    if len(positions) < len(joints):
        unknown = [n for n in moving if n.role == "unknown" and n not in positions]
        positions += _smoothest(unknown, logs, len(joints) - len(positions))
    chosen = columns_by_name(positions, joints)
    for joint, column in zip(joints, chosen.columns, strict=True):
        if column < 0:
            have = ", ".join(name.name for name in names)
            raise InputError(
                f"{logs[0].path}: no column for the position of joint {joint} among {have}; rename its column {joint}, "
                f"or give task.locked={{{joint}: 0.0}} if it does not move"
            )
    own = [positions[column] for column in chosen.columns]
    # Other columns are matched to the words of the positions' names too: q_3, tau_3.
    keys = [(joint, name) for joint, name in zip(joints, own, strict=True)]
    targets = _of_joints([n for n in names if n.role == "target"], keys)
    commands = _of_joints([n for n in names if n.role == "command"], keys)
    forces = _of_joints([n for n in names if n.role == "force"], keys)
    if not any((*targets, *commands, *forces)):
        left = [n for n in moving if n.role == "unknown" and n not in positions]
        forces = _of_joints(left, keys)
    rates = _of_joints([n for n in names if n.role == "rate"], keys)
    pairs = [(logs, command, name.name) for command, name in zip(commands, own, strict=True) if command]
    mostly = 2 * sum(_is_target(*pair, FOLLOWS_CLOSELY) for pair in pairs) >= max(len(pairs), 1)
    share = FOLLOWS_LIKE_OTHERS if mostly else FOLLOWS_CLOSELY
    found = []
    for j, name in enumerate(own):
        target, command = targets[j], commands[j]
        if command and not target and _is_target(logs, command, name.name, share):
            target, command = command, ""
        found.append(JointColumns(name.name, chosen.certain[j], target, command, forces[j], rates[j]))
    return tuple(found)


def _is_target(logs: Sequence[Log], command: str, position: str, share: float) -> bool:
    return all(follows(log.columns[command], log.columns[position], share) for log in logs)


def _of_joints(names: list[ColumnName], keys: list[tuple[str, ColumnName]]) -> list[str]:
    """Column of each joint among those of one role; empty where there is none."""
    by_joint = columns_by_name(names, [joint for joint, _ in keys])
    by_column = columns_by_name(names, [" ".join(own.rest) or own.name for _, own in keys])
    better = by_joint if sum(by_joint.certain) >= sum(by_column.certain) else by_column
    complete = len(names) >= len(keys)  # the order of the columns says nothing where some are missing
    return [
        names[column].name if column >= 0 and (sure or complete) else ""
        for column, sure in zip(better.columns, better.certain, strict=True)
    ]


def _smoothest(names: list[ColumnName], logs: Sequence[Log], count: int) -> list[ColumnName]:
    """So many columns, in their order, of least noise beside their spread: positions are smoother than forces."""

    def roughness(name: ColumnName) -> float:
        values = [log.columns[name.name] for log in logs]
        return max(float(np.mean(np.abs(np.diff(v, 4))) / (np.std(v) or 1.0)) for v in values)

    smooth = sorted(names, key=roughness)[:count]
    return [name for name in names if name in smooth]
