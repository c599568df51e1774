"""Columns of commands: of which kind each drive is, its unit or gain, and what was logged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from wipx.core.drive import Drive
from wipx.core.tree import Link, Tree
from wipx.recordings.matching.assignment import Assignment
from wipx.recordings.matching.drives import TargetUnit, friction_in_command, held_rows, target_unit
from wipx.recordings.matching.log import Log
from wipx.recordings.matching.names import read_name
from wipx.recordings.matching.sources import JointColumns
from wipx.recordings.matching.units import FORCES, NEAR, SLIDING_FORCES, Measure, nearest
from wipx.recordings.signals import Signal

KNOWN = 0.4  # relative standard error up to which a gain says something
SHOWN = 0.3  # share of a lag left up to which the stiffness of a position drive is believed
CLOSED = 0.25  # share of the Coulomb friction in the command from which a position control made it


@dataclass(frozen=True)
class CommandSource:
    """What drives a joint, as far as names say.

    Attributes:
        kind: "force", "target" or "none".
        column: Column of the log.
        values: What is compared with the forces that the motion needs: the force as logged, or target minus position
            [rad or m]; one array for each log, shape (rows,). Empty for none.
        target: Unit of the target; None for a force.
        force_too: Column of a force that the drive reports beside its target or command; empty for none.
    """

    kind: str
    column: str
    values: tuple[np.ndarray, ...]
    target: TargetUnit | None = None
    force_too: str = ""


@dataclass(frozen=True)
class JointDrive:
    """The drive of a joint in a robot.yaml.

    Attributes:
        drive: None where the model file's actuator counts.
        signals: Of its command and of the force that it reports.
        uncertainty: Relative standard deviations of what was read off the motion.
        words: What it is, in words.
        doubt: Number that is not sure: "gain" or "stiffness"; empty for none.
    """

    drive: Drive | None
    signals: Mapping[str, Signal] = field(default_factory=dict)
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    words: str = ""
    doubt: Literal["", "gain", "stiffness"] = ""


def command_source(
    logs: Sequence[Log],
    own: JointColumns,
    measure: Measure,
    positions: Sequence[np.ndarray],
    link: Link,
    in_file: Drive | None,
) -> CommandSource:
    """What drives the joint of a position column.

    A force is preferred to a target, whose drive's stiffness is seldom known, but not where the model file has it.

    Args:
        logs: The logs.
        own: Columns of the joint.
        measure: Of its position.
        positions: In SI, one for each log, shape (rows,).
        link: Link of the joint that has the columns' name.
        in_file: Actuator of that joint in the model file.
    """
    force = own.command or own.measured
    target = None
    if own.target:
        logged = np.concatenate([log.columns[own.target] for log in logs])
        target = target_unit(logged, np.concatenate(positions), measure, slides=link.slides)
    is_servo = in_file is not None and in_file.kind == "position"
    if target is not None and (is_servo or not force):
        pairs = zip(logs, positions, strict=True)
        lag = tuple(target.factor * log.columns[own.target] + target.centre - q for log, q in pairs)
        return CommandSource("target", own.target, lag, target, own.measured)
    if force:
        beside = own.measured if own.command and own.measured else ""
        return CommandSource("force", force, tuple(log.columns[force] for log in logs), None, beside)
    return CommandSource("none", "", ())


def command_numbers(sources: Sequence[CommandSource]) -> tuple[int, ...]:
    """Number of each drive's command among those that there are; -1 for none."""
    found, count = [], 0
    for source in sources:
        found.append(-1 if source.kind == "none" else count)
        count += source.kind != "none"
    return tuple(found)


def drives_of(
    tree: Tree,
    in_file: Mapping[str, Drive],
    logs: Sequence[Log],
    sources: Sequence[CommandSource],
    positions: Sequence[np.ndarray],
    chosen: Assignment,
) -> list[JointDrive]:
    """The drive of each joint.

    Args:
        tree: The robot.
        in_file: Actuators of the model file, by joint.
        logs: The logs.
        sources: What drives the joint of each position column, by name.
        positions: In SI, one for each log, shape (rows, columns).
        chosen: Which source is that of which joint.
    """
    there = [source for source in sources if source.kind != "none"]
    own = [there[c] if c >= 0 else CommandSource("none", "", ()) for c in chosen.placed.commands]
    units = {slides: _force_unit(tree, own, chosen, slides) for slides in (False, True)}
    motor = _shows_friction(tree, logs, own, positions, chosen)
    servos = np.array([each.kind == "target" and not link.slides for each, link in zip(own, tree.links, strict=True)])
    found = []
    for j, link in enumerate(tree.links):
        source, given = own[j], in_file.get(link.joint)
        if source.kind == "none":
            found.append(JointDrive(Drive("none"), words="no command in the log, taken as passive"))
        elif source.kind == "target":
            found.append(_position_drive(link.joint, link.slides, source, given, chosen, j, servos))
        else:
            found.append(_torque_drive(link.joint, source, units[link.slides], chosen, j, motor=motor))
    return [
        replace(drive, words=drive.words + _renewed(source, logs)) for drive, source in zip(found, own, strict=True)
    ]


def _renewed(source: CommandSource, logs: Sequence[Log]) -> str:
    """How often the command changes, in words, where that is not in every row."""
    rows = max((held_rows(log.columns[source.column]) for log in logs if source.column), default=1)
    return f", renewed at {logs[0].rate / rows:.4g} Hz" if rows > 1 else ""


@dataclass(frozen=True)
class _ForceUnit:
    """Unit of forces; an empty one where each drive has its own gain, of which `typical` is the middle."""

    unit: str
    typical: float
    measured: bool


def _force_unit(tree: Tree, own: Sequence[CommandSource], chosen: Assignment, slides: bool) -> _ForceUnit:
    """The unit of all forces of hinges, or of slides: by name, else by the gains that the motion shows."""
    known = SLIDING_FORCES if slides else FORCES
    here = [j for j, link in enumerate(tree.links) if link.slides == slides and own[j].kind == "force"]
    said = {read_name(own[j].column).unit for j in here}
    if len(said) == 1 and said <= set(known):
        unit = said.pop()
        return _ForceUnit(unit, known[unit], measured=True)
    gains, errors = chosen.fit.coefficients[here, 0], chosen.fit.error[here]
    sure = gains > 0.0
    sure[sure] = errors[sure] < KNOWN * gains[sure]
    if not np.any(sure):
        return _ForceUnit("N" if slides else "N m", 1.0, measured=False)
    order = np.argsort(gains[sure])
    weights = np.cumsum((gains[sure] / errors[sure])[order])
    typical = float(gains[sure][order][np.searchsorted(weights, 0.5 * weights[-1])])
    if any(read_name(own[j].column).current for j in here):
        return _ForceUnit("", typical, measured=True)
    return _ForceUnit(nearest(typical, known, NEAR) or "", typical, measured=True)


def _torque_drive(
    joint: str, source: CommandSource, force: _ForceUnit, chosen: Assignment, j: int, *, motor: bool | None
) -> JointDrive:
    sign, gain, error = float(chosen.fit.sign[j]), float(chosen.fit.coefficients[j, 0]), float(chosen.fit.error[j])
    name = read_name(source.column)
    from_motor = name.measured or name.current or name.role == "force" or bool(motor)
    logged = "motor" if from_motor else "command"
    doubt: Literal["", "gain"] = ""
    signals = {f"u_{joint}": Signal(source.column, force.unit or "1", sign)}
    uncertainty = {}
    if force.unit:
        drive = Drive("torque", logged=logged)
        words = f"torque drive, {source.column} in {force.unit}"
    else:
        known = gain > 0.0 and error < KNOWN * gain
        share = gain if known else force.typical
        drive = Drive("torque", gain=float(f"{1.0 / share:.4g}"), logged=logged)
        uncertainty[f"{joint}.gain"] = float(f"{min(max(error / gain, 0.05), 0.5):.2g}") if known else 0.5
        words = f"torque drive, {drive.gain:.4g} N m per unit of {source.column}"
        doubt = "" if known else "gain"
    if sign < 0.0:
        words += ", turned round"
    if source.force_too and force.unit:
        signals[f"u_{joint}_measured"] = Signal(source.force_too, force.unit, sign)
    return JointDrive(drive, signals, uncertainty, words, doubt)


def _position_drive(
    joint: str, slides: bool, source: CommandSource, given: Drive | None, chosen: Assignment, j: int, servos: np.ndarray
) -> JointDrive:
    assert source.target is not None
    target, placed = source.target, chosen.placed
    sign, zero = float(placed.scale[j]), float(placed.offset[j])
    unit = "m" if slides else "rad"
    scale = sign * target.factor if not target.unit else sign * float(np.sign(target.factor))
    signals = {f"u_{joint}": Signal(source.column, target.unit or unit, scale, sign * target.centre + zero)}
    if given is not None and given.kind == "position":
        words = f"position drive of the model file, targets {source.column} in {target.words}"
        return JointDrive(None, signals, {}, words)
    gain, viscous = float(chosen.fit.coefficients[j, 0]), float(chosen.fit.coefficients[j, 2])
    known = bool(_known_stiffness(chosen)[j])
    typical = chosen.fit.coefficients[_known_stiffness(chosen) & servos, 0]
    share = gain if known or not len(typical) else float(np.median(typical))
    share = share if share > 0.0 else 0.01
    drive = Drive("position", kp=float(f"{1.0 / share:.4g}"), kd=float(f"{viscous / share:.3g}"))
    spread = min(max(float(chosen.fit.error[j]) / gain, 0.1), 1.0) if known else 1.0
    uncertainty = {f"{joint}.kp": float(f"{spread:.2g}")}
    if drive.kd > 0.0:
        uncertainty[f"{joint}.kd"] = 0.5 if known else 1.0
    per = "N/m" if slides else "N m/rad"
    origin = "read off the motion" if known else "taken from the other drives" if len(typical) else "guessed"
    words = f"position drive, targets {source.column} in {target.words}, kp {drive.kp:.4g} {per} {origin}"
    return JointDrive(drive, signals, uncertainty, words, "stiffness")


def _known_stiffness(chosen: Assignment) -> np.ndarray:
    """Whether the motion shows the stiffness of each drive: its lag is mostly explained, and not by friction alone."""
    gain, error = chosen.fit.coefficients[:, 0], chosen.fit.error
    return (gain > 0.0) & (error < KNOWN * np.where(gain > 0.0, gain, 0.0)) & (chosen.fit.left < SHOWN)


def _shows_friction(
    tree: Tree, logs: Sequence[Log], own: Sequence[CommandSource], positions: Sequence[np.ndarray], chosen: Assignment
) -> bool | None:
    """Whether forces have the friction in them, as those of motors under position control; None where none can tell."""
    shares = []
    for j in range(len(tree.links)):
        if own[j].kind != "force":
            continue
        coulomb = float(chosen.fit.sign[j] * chosen.fit.coefficients[j, 1])
        column, sign = chosen.placed.columns[j], float(chosen.placed.scale[j])
        for log, q, u in zip(logs, positions, own[j].values, strict=True):
            shares.append(friction_in_command(log.t, sign * q[:, column], u, coulomb))
    known = [share for share in shares if share is not None]
    return bool(np.median(known) > CLOSED) if known else None
