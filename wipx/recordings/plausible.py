"""Recordings of a robot that cannot be what robot.yaml says: degrees for radians, ticks for radians, swapped joints.

A recording is refused only where it is certain: where the forces that the model needs for the motion fit the commands
far better in another reading, or where positions far beyond the limits make no sense as they are. Positions that are
somewhat beyond, or that the commands speak for, are worth a warning: limits are not simulated, and may be wrong.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from wipx.core.errors import InputError
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.tree import Link
from wipx.recordings.matching.assignment import swapped
from wipx.recordings.matching.drives import line
from wipx.recordings.matching.motion import Fit, Motion, Placed, fit, motion_of
from wipx.recordings.matching.units import TURNING
from wipx.recordings.signals import Signal

GROSS = 0.5  # of the way between the limits, by which positions are beyond them
SLIGHT = 0.02  # likewise, from which a warning is due
FITS = 0.15  # share of the commands left by a reading that is right; public recordings of three arms leave up to 0.25
CERTAIN = 20.0  # [nats] by which another order must be likelier; on these recordings none is by more than 0
MUCH_BETTER = 1.5  # by which it must lower the misfit, whatever the length: the two joints' errors by a factor of 4.5
DECIDED = 8.0  # [nats] that decide between two units
MOST_JOINTS = 8  # that are exchanged, those of which most is left
FEWEST_INDEPENDENT = 6.0  # rows that tell readings apart
OTHER_UNIT = 3.0  # factor between a target and a position from which their units differ
CROSSED = 0.1  # share of a target's variance about its own position that is left about the other one
IN_STEP = 0.9  # share of a position's variance that a target in another unit explains


def check_recording(recording: Recording, plant: Plant, signals: Mapping[str, Signal]) -> tuple[str, ...]:
    """Warnings about a recording of a robot from a model file, one line each.

    Args:
        recording: Of the robot, in SI.
        plant: The robot.
        signals: What its robot.yaml says of columns.

    Raises:
        InputError: a column is certainly not what it is said to be.
    """
    assert plant.tree is not None
    for joint in plant.joints:
        if joint in plant.drives and plant.drives[joint].kind == "position":
            _check_target(recording, joint, signals)
    motion, placed = _motion(recording, plant)
    warnings = _check_limits(recording, plant, motion, placed)
    if motion.independent >= FEWEST_INDEPENDENT and len(motion.q):
        _check_targets(recording, plant)
        _check_order(recording, plant, motion, placed)
    return tuple(warnings)


def _check_limits(recording: Recording, plant: Plant, motion: Motion, placed: Placed) -> list[str]:
    """Warnings of positions beyond the limits.

    Raises:
        InputError: positions are far beyond them, and the commands do not speak for them.
    """
    assert plant.tree is not None
    warnings = []
    beyond = [link for link in plant.tree.links if _beyond(recording[link.joint], link) > SLIGHT]
    gross = [link for link in beyond if _beyond(recording[link.joint], link) > GROSS]
    if gross and not _spoken_for(plant, motion, placed, [link.joint for link in gross]):
        raise _beyond_limits(recording, gross[0])
    for link in beyond:
        assert link.limits is not None
        low, high = recording[link.joint].min(), recording[link.joint].max()
        unit = plant.unit_of(link.joint)
        warnings.append(
            f"{recording.source}: {link.joint} moves from {low:.4g} to {high:.4g} {unit}, beyond the limits "
            f"{link.limits[0]:.4g} and {link.limits[1]:.4g} of the model file, which are not simulated"
        )
    return warnings


def _spoken_for(plant: Plant, motion: Motion, placed: Placed, joints: list[str]) -> bool:
    """Whether the commands fit the motion as it is, certainly better than if these joints were in degrees."""
    tree = plant.tree
    assert tree is not None
    if motion.independent < FEWEST_INDEPENDENT or not len(motion.q):
        return False
    found = fit(tree, motion, placed)
    known = np.isfinite(found.left)
    scale = np.where([joint in joints for joint in plant.joints], np.pi / 180.0, 1.0)
    other = fit(tree, motion, replace(placed, scale=placed.scale * scale))
    nats = 0.5 * motion.independent * (other.misfit - found.misfit)
    return bool(np.any(known) and np.nanmean(found.left) < FITS and nats > DECIDED)


def _beyond(q: np.ndarray, link: Link) -> float:
    """How far positions are beyond the limits, as a share of the way between them."""
    if link.limits is None or link.limits[1] <= link.limits[0]:
        return 0.0
    low, high = link.limits
    return float(max(low - q.min(), q.max() - high, 0.0)) / (high - low)


def _beyond_limits(recording: Recording, link: Link) -> InputError:
    q = recording[link.joint]
    assert link.limits is not None
    low, high = link.limits
    unit = "m" if link.slides else "rad"
    said = f"{recording.source}: {link.joint} moves from {q.min():.4g} to {q.max():.4g} {unit}, its limits are "
    said += f"{low:.4g} and {high:.4g}; "
    for words, factor in (("deg", np.pi / 180.0),) if not link.slides else (("mm", 1e-3), ("cm", 1e-2)):
        if _beyond(factor * q, link) <= SLIGHT:
            setting = f"{{{link.joint}: {{unit: {words}}}}}"
            return InputError(
                f"{said}if it is logged in {words}, write signals: {setting}, else correct its zero or column"
            )
    return InputError(
        f"{said}correct its column, unit or zero (signals: {{{link.joint}: {{offset: ...}}}}), or the limits"
    )


def _check_target(recording: Recording, joint: str, signals: Mapping[str, Signal]) -> None:
    """Refuse a target that runs with the position in another unit."""
    target, q = recording[f"u_{joint}"], recording[joint]
    slope, start = line(target, q)
    spread = float(np.var(q))
    if slope == 0.0 or np.var(q - slope * target - start) > (1.0 - IN_STEP) * spread:
        return
    if 1.0 / OTHER_UNIT < abs(slope) < OTHER_UNIT:
        return
    column = signals[f"u_{joint}"].column if f"u_{joint}" in signals else f"u_{joint}"
    known = [m for m in TURNING.values() if 1.0 / 1.15 < abs(slope) / m.factor < 1.15]
    scale, words = (known[0].factor, f"{known[0].words}?") if known else (abs(slope), "another unit?")
    offset = float(np.median(q - np.sign(slope) * scale * target))
    setting = f"{{column: {column}, scale: {np.sign(slope) * scale:.6g}, offset: {offset:.4g}}}"
    raise InputError(
        f"{recording.source}: the targets u_{joint} run from {target.min():.4g} to {target.max():.4g} where {joint} "
        f"moves from {q.min():.4g} to {q.max():.4g}; {words} Write signals: {{u_{joint}: {setting}}}"
    )


def _motion(recording: Recording, plant: Plant) -> tuple[Motion, Placed]:
    """The motion of a recording, with its columns where their names say."""
    q = recording.stack(plant.joints)
    commands, numbers = [], []
    for j, joint in enumerate(plant.joints):
        drive = plant.drives[joint]
        if drive.kind == "none":
            numbers.append(-1)
            continue
        numbers.append(len(commands))
        values = recording[f"u_{joint}"]
        commands.append(values - q[:, j] if drive.kind == "position" else values)
    u = np.stack(commands, axis=1) if commands else np.zeros((len(q), 0))
    count = len(plant.joints)
    placed = Placed(tuple(range(count)), np.ones(count), np.zeros(count), tuple(numbers))
    return motion_of([recording.t], [q], [u]), placed


def _check_targets(recording: Recording, plant: Plant) -> None:
    """Refuse targets of two position drives of which each is followed by the other's joint."""
    driven = [joint for joint, drive in plant.drives.items() if drive.kind == "position"]
    lag = {(i, k): float(np.var(recording[f"u_{i}"] - recording[k])) for i in driven for k in driven}
    for i, k in combinations(driven, 2):
        if max(lag[i, k], lag[k, i]) < CROSSED * min(lag[i, i], lag[k, k]):
            raise InputError(
                f"{recording.source}: {i} follows the targets of {k}, and {k} those of {i}; exchange u_{i} and u_{k} "
                "under signals in robot.yaml, or the positions"
            )


def _check_order(recording: Recording, plant: Plant, motion: Motion, placed: Placed) -> None:
    """Refuse joints that are swapped: with them exchanged the model explains the commands far better."""
    tree = plant.tree
    assert tree is not None
    found = fit(tree, motion, placed)
    known = [j for j in range(len(tree.links)) if np.isfinite(found.left[j])]
    tried = sorted(sorted(known, key=lambda j: -found.left[j])[:MOST_JOINTS])
    best: tuple[float, int, int, str, Fit] | None = None
    for i, k in combinations(tried, 2):
        if tree.links[i].slides != tree.links[k].slides:
            continue
        tied = any(plant.drives[tree.links[j].joint].kind == "position" for j in (i, k))
        ways = ((True, True, "columns"), (True, False, "positions"), (False, True, "commands"))
        for positions, commands, words in ways[:1] if tied else ways:
            other = fit(tree, motion, swapped(placed, i, k, positions=positions, commands=commands))
            better = found.misfit - other.misfit
            if max(other.left[i], other.left[k]) < FITS and (best is None or better > best[0]):
                best = better, i, k, words, other
    if best is None or best[0] < MUCH_BETTER or 0.5 * motion.independent * best[0] < CERTAIN:
        return
    _, i, k, words, other = best
    before, after = (100.0 * float(max(each.left[i], each.left[k])) for each in (found, other))
    raise InputError(
        f"{recording.source}: the {words} of {tree.links[i].joint} and {tree.links[k].joint} are swapped: the model "
        f"leaves up to {before:.2g} % of their commands unexplained, {after:.2g} % with them exchanged; exchange "
        "them under signals in robot.yaml"
    )
