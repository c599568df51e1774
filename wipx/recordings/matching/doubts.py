"""What a match of columns to joints is sure of and what not, in sentences."""

from collections.abc import Sequence

import numpy as np

from wipx.core.tree import Tree
from wipx.recordings.matching.assignment import CERTAIN, Assignment
from wipx.recordings.matching.commands import JointDrive
from wipx.recordings.matching.motion import Motion
from wipx.recordings.matching.sources import JointColumns
from wipx.recordings.matching.units import Measure

UNEXPLAINED = 0.5  # share of a command's variance left from which the model and the log hardly go together


def reason(own: JointColumns, measure: Measure, sign: float, zero: float, drive: JointDrive) -> str:
    """What the columns of a joint are taken for."""
    parts = [f"position {own.position} in {measure.words}"]
    if sign < 0.0:
        parts.append("turned round")
    if zero:
        parts.append(f"zero moved by {np.rad2deg(zero):.1f} deg")
    return f"{', '.join(parts)}; {drive.words}"


def doubts_of(tree: Tree, columns: Sequence[JointColumns], motion: Motion, chosen: Assignment) -> list[str]:
    """What of the positions is not sure."""
    found = []
    moved = {what: [j for j, changes in chosen.changed.items() if what in changes] for what in ("joints", "sign")}
    placed = {joint: columns[chosen.placed.columns[j]] for j, joint in enumerate(tree.joints)}
    shifted = [joint for j, joint in enumerate(tree.joints) if chosen.placed.offset[j] != 0.0]
    if not chosen.rivals:
        found.append(
            "there is no command that moves the joints, so signs, zeros and order of the joints are not tested"
        )
    by_order = [joint for joint, own in placed.items() if not own.certain and joint not in moved["joints"]]
    if by_order:
        listed = ", ".join(f"{joint} = {placed[joint].position}" for joint in by_order)
        found.append(f"the names do not say which joint is which; by their order: {listed}")
    if moved["joints"]:
        listed = ", ".join(f"{joint} = {placed[joint].position}" for joint in moved["joints"])
        found.append(f"the forces that the motion needs say otherwise than names or order: {listed}")
    turned = [joint for joint in moved["sign"] if chosen.placed.scale[tree.joints.index(joint)] < 0.0]
    if turned:
        found.append(f"{_and(turned)}: turned round, since the commands fit much better so")
    if shifted:
        zeros = [
            f"{joint} by {np.rad2deg(chosen.placed.offset[tree.joints.index(joint)]):.0f} deg" for joint in shifted
        ]
        found.append(f"zeros that are moved, since the commands fit much better so: {', '.join(zeros)}; correct them")
    open_order = sorted(
        {
            joint
            for r in chosen.rivals
            if r.what == "joints" and r.worse < CERTAIN
            for joint in r.joints
            if joint in by_order
        }
    )
    if open_order:
        found.append(f"the motion does not tell {_and(open_order)} apart from others")
    open_signs = _open(tree, chosen, "sign")
    if open_signs:
        found.append(f"the motion does not show the sign of {_and(open_signs)}; taken as in the model file")
    open_zeros = [joint for joint in _open(tree, chosen, "zero") if joint not in shifted]
    if open_zeros:
        found.append(f"the motion does not show the zero of {_and(open_zeros)}; taken as in the model file")
    strange = [joint for joint, left in zip(tree.joints, chosen.fit.left, strict=True) if left > UNEXPLAINED]
    if strange:
        found.append(
            f"the model explains less than half of the command of {_and(strange)}; look at its columns, or let the "
            "diagnosis say what is missing"
        )
    return found


def _open(tree: Tree, chosen: Assignment, what: str) -> list[str]:
    rivals = [rival for rival in chosen.rivals if rival.what == what and rival.worse < CERTAIN]
    return [joint for joint in tree.joints if any(joint in rival.joints for rival in rivals)]


def drive_doubts(tree: Tree, drives: Sequence[JointDrive]) -> list[str]:
    """What of the drives is not sure."""
    found = []
    unsure = {
        what: [j for j, d in zip(tree.joints, drives, strict=True) if d.doubt == what] for what in ("stiffness", "gain")
    }
    if unsure["stiffness"]:
        joints = _and(unsure["stiffness"])
        found.append(f"kp and kd of the position drives of {joints} are estimates; give the maker's if you have them")
    if unsure["gain"]:
        found.append(
            f"the motion does not show the drive's gain of {_and(unsure['gain'])}; that of the other drives is taken"
        )
    by_logged: dict[str, list[str]] = {}
    for joint, each in zip(tree.joints, drives, strict=True):
        if each.drive is not None and each.drive.kind == "torque":
            by_logged.setdefault(each.drive.logged, []).append(joint)
    meaning = {
        "motor": "what the motors made, so that delay, dead zone and saturation before them cannot show",
        "command": "what was commanded; write logged: motor where it is what the motors made",
    }
    for logged, joints in by_logged.items():
        which = "forces" if len(joints) == len(tree.joints) else f"forces of {_and(joints)}"
        found.append(f"{which} are taken for {meaning[logged]}")
    passive = [
        j for j, each in zip(tree.joints, drives, strict=True) if each.drive is not None and each.drive.kind == "none"
    ]
    if passive:
        found.append(f"{_and(passive)}: no command in the log, taken as passive")
    return found


def _and(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
