"""Which column is which joint, with which sign and zero: what the motion says beside the names.

A placing is left for another only where the recorded commands fit that one better with certainty. Errors of a nominal
model resemble each other over half a second, so rows that are nearer do not count anew (`Motion.independent`).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from wipx.core.tree import Tree
from wipx.recordings.matching.motion import Fit, Motion, Placed, fit

CERTAIN = 8.0  # [nats] by which another placing must be more likely to be taken in spite of what names say
LIKELY = 2.0  # [nats] likewise, where only the order of the columns speaks for the first one
ZEROS = np.deg2rad([30.0, 60.0, 90.0, 120.0, 150.0, 180.0, -30.0, -60.0, -90.0, -120.0, -150.0])
SMALLEST_SHIFT = np.deg2rad(8.0)  # smaller ones are left to a diagnosis (JOINT's sensor bias)
POOR = 0.35  # mean share left above which two joints are turned at once
MOST_ROUNDS = 12
MOST_ORDERED = 6  # joints whose 720 orders are all tried
FEWEST_INDEPENDENT = 4.0  # rows that a comparison needs


@dataclass(frozen=True)
class Rival:
    """Another placing than the chosen one.

    Attributes:
        joints: Joints that it changes.
        what: What it changes: "joints", "sign" or "zero".
        worse: By how many nats it is less likely; negative where it is more likely [nats].
    """

    joints: tuple[str, ...]
    what: str
    worse: float


@dataclass(frozen=True)
class Assignment:
    """The placing that was chosen.

    Attributes:
        placed: It.
        fit: How it explains the commands.
        rivals: Others, one change away each.
        changed: What was changed of the first placing, in words of `Rival.what`, by joint.
    """

    placed: Placed
    fit: Fit
    rivals: tuple[Rival, ...]
    changed: dict[str, set[str]]


def assignment(tree: Tree, motion: Motion, first: Placed, certain: tuple[bool, ...]) -> Assignment:
    """The placing that names and motion speak for.

    Args:
        tree: The robot.
        motion: Of the log.
        first: Placing that the names, or the order of the columns, speak for.
        certain: Whether the names say which joint a column is, by joint.
    """
    changed: dict[str, set[str]] = {}
    placed, found = first, fit(tree, motion, first)
    if not any(command >= 0 for command in first.commands) or motion.independent < FEWEST_INDEPENDENT:
        return Assignment(placed, found, (), changed)
    placed = _ordered(tree, motion, placed, certain, changed)
    placed = _climbed(tree, motion, placed, certain, changed)
    if np.any(placed.offset):
        placed = _refined(tree, motion, placed)
        placed = _climbed(tree, motion, placed, certain, changed)
    found = fit(tree, motion, placed)
    others = _moves(tree, placed)
    rivals = [replace(rival, worse=-_nats(motion, found, fit(tree, motion, other))) for rival, other in others]
    return Assignment(placed, found, tuple(rivals), changed)


def _ordered(
    tree: Tree, motion: Motion, placed: Placed, certain: tuple[bool, ...], changed: dict[str, set[str]]
) -> Placed:
    """The best order of the joints whose names do not say which they are, where these are few enough to try all."""
    unsure = [j for j, sure in enumerate(certain) if not sure]
    if not 2 <= len(unsure) <= MOST_ORDERED:
        return placed
    best, reached = placed, fit(tree, motion, placed)
    needed = LIKELY
    for order in permutations(unsure):
        source = np.arange(len(certain))
        source[unsure] = order
        other = Placed(
            tuple(placed.columns[j] for j in source),
            placed.scale[source],
            placed.offset[source],
            tuple(placed.commands[j] for j in source),
        )
        found = fit(tree, motion, other)
        if _nats(motion, reached, found) > needed:
            best, reached, needed = other, found, 0.0
    for j, joint in enumerate(tree.joints):
        if best.columns[j] != placed.columns[j]:
            changed.setdefault(joint, set()).add("joints")
    return best


def _climbed(
    tree: Tree, motion: Motion, placed: Placed, certain: tuple[bool, ...], changed: dict[str, set[str]]
) -> Placed:
    """The placing after all changes that are certain, the most likely one first; notes them in `changed`."""
    for _ in range(MOST_ROUNDS):
        found, moves = fit(tree, motion, placed), list(_moves(tree, placed))
        spare = [
            _nats(motion, found, fit(tree, motion, other)) - _needed(rival, tree, certain) for rival, other in moves
        ]
        best = int(np.argmax(spare))
        step = moves[best] if spare[best] > 0.0 else None
        if step is None and float(np.nanmean(found.left)) > POOR:
            step = _best_pair(tree, motion, placed, found)
        if step is None:
            break
        rival, placed = step
        for joint in rival.joints:
            changed.setdefault(joint, set()).add(rival.what)
    return placed


def swapped(placed: Placed, i: int, k: int, *, positions: bool = True, commands: bool = True) -> Placed:
    """A placing with the columns of two joints exchanged; the signs and zeros go with the positions."""
    order = list(range(len(placed.columns)))
    order[i], order[k] = k, i
    if positions:
        columns = tuple(placed.columns[j] for j in order)
        placed = replace(placed, columns=columns, scale=placed.scale[order], offset=placed.offset[order])
    if commands:
        placed = replace(placed, commands=tuple(placed.commands[j] for j in order))
    return placed


def _nats(motion: Motion, before: Fit, after: Fit) -> float:
    return 0.5 * motion.independent * (before.misfit - after.misfit)


def _needed(rival: Rival, tree: Tree, certain: tuple[bool, ...]) -> float:
    if rival.what != "joints":
        return CERTAIN
    return CERTAIN if all(certain[tree.joints.index(joint)] for joint in rival.joints) else LIKELY


def _moves(tree: Tree, placed: Placed) -> Iterator[tuple[Rival, Placed]]:
    """All placings that differ by one exchange, one sign or one zero."""
    joints = tree.joints
    for i, k in combinations(range(len(joints)), 2):
        if tree.links[i].slides == tree.links[k].slides:
            for positions, commands in ((True, True), (True, False), (False, True)):
                other = swapped(placed, i, k, positions=positions, commands=commands)
                yield Rival((joints[i], joints[k]), "joints", 0.0), other
    for j, link in enumerate(tree.links):
        yield Rival((joints[j],), "sign", 0.0), _turned(placed, j)
        for zero in () if link.slides else ZEROS:
            yield Rival((joints[j],), "zero", 0.0), _shifted(placed, j, zero)
            yield Rival((joints[j],), "sign", 0.0), _shifted(_turned(placed, j), j, zero)


def _turned(placed: Placed, j: int) -> Placed:
    one = np.where(np.arange(len(placed.columns)) == j, -1.0, 1.0)
    return replace(placed, scale=placed.scale * one, offset=placed.offset * one)


def _shifted(placed: Placed, j: int, zero: float) -> Placed:
    offset = placed.offset + zero * (np.arange(len(placed.columns)) == j)
    return replace(placed, offset=offset)


def _best_pair(tree: Tree, motion: Motion, placed: Placed, found: Fit) -> tuple[Rival, Placed] | None:
    """The best change of signs and right-angled zeros of two joints at once; None where none is certain."""
    hinges = [j for j, link in enumerate(tree.links) if not link.slides]
    turns = [(turned, zero) for turned in (False, True) for zero in np.deg2rad([0.0, 90.0, 180.0, -90.0])]
    best, gain = None, CERTAIN
    for i, k in combinations(hinges, 2):
        for first in turns[1:]:
            for second in turns[1:]:
                other = placed
                for j, (turned, zero) in ((i, first), (k, second)):
                    other = _shifted(_turned(other, j) if turned else other, j, zero)
                nats = _nats(motion, found, fit(tree, motion, other))
                if nats > gain:
                    best, gain = (Rival((tree.joints[i], tree.joints[k]), "sign", 0.0), other), nats
    return best


def _refined(tree: Tree, motion: Motion, placed: Placed) -> Placed:
    """All zeros of hinges brought to where the commands fit best; those that are small or uncertain stay at zero."""
    from scipy.optimize import minimize

    hinges = np.array([not link.slides for link in tree.links])

    def moved(shifts: np.ndarray, at: Placed, free: np.ndarray) -> Placed:
        offset = at.offset.copy()
        offset[free] += shifts
        return replace(at, offset=(offset + np.pi) % (2.0 * np.pi) - np.pi if np.all(hinges) else offset)

    def best(at: Placed, free: np.ndarray) -> Placed:
        def misfit(shifts: np.ndarray) -> float:
            return fit(tree, motion, moved(shifts, at, free)).misfit

        found = minimize(misfit, np.zeros(int(free.sum())), method="Powell", options={"xtol": 1e-3, "maxiter": 3})
        return moved(np.atleast_1d(found.x), at, free)

    every = best(placed, hinges)
    reached = fit(tree, motion, every)
    free = np.zeros(len(hinges), dtype=bool)
    for j in np.flatnonzero(hinges):
        alone = _shifted(every, int(j), -float(every.offset[j]))
        lost = _nats(motion, fit(tree, motion, alone), reached)
        free[j] = abs(every.offset[j]) > SMALLEST_SHIFT and lost > 2.0 * CERTAIN  # twice: it was free to fit noise
    start = replace(every, offset=np.where(free | ~hinges, every.offset, 0.0))
    return best(start, free) if np.any(free) else replace(placed, offset=np.where(hinges, 0.0, placed.offset))
