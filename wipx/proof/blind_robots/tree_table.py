"""Figures over many scored robots with many joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.proof.blind_robots.score import CaseScore
from wipx.proof.blind_robots.table import Count, covered

SIZES = ((1, 2), (3, 4), (5, 7))  # numbers of joints that are counted together


@dataclass(frozen=True)
class TreeGroup:
    """Scores of some robots with many joints.

    Attributes:
        name: What they have in common.
        cases: How many.
        joints: Joints with hidden effects whose set is named exactly.
        effects: Hidden effects that are named.
        sites: Hidden effects whose site is named.
        false_effects: Named effects that are not hidden.
        all_joints: Joints of all these robots.
        covered: True parameters that lie in their 95 % intervals.
        flagged: Robots with physics outside the vocabulary that were called unexplained.
        over_floor: Median error on unseen recordings over that of the true model; None where that is not known.
        seconds: Median time [s].
        slowest: Longest time [s].
        failures: Robots without an answer.
    """

    name: str
    cases: int
    joints: Count
    effects: Count
    sites: Count
    false_effects: int
    all_joints: int
    covered: Count
    flagged: Count
    over_floor: float | None
    seconds: float
    slowest: float
    failures: int

    @property
    def false_per_100(self) -> float:
        """False effects per 100 joints."""
        return 100.0 * self.false_effects / max(self.all_joints, 1)


def tree_group(name: str, scores: Sequence[CaseScore]) -> TreeGroup:
    """The score of some robots with many joints, one at least."""
    trees = [one.tree for one in scores if one.tree is not None]
    outside = [one for one in scores if one.outside is not None]
    errors = [one.over_floor for one in scores if one.over_floor is not None and one.outside is None]
    return TreeGroup(
        name=name,
        cases=len(scores),
        joints=Count(sum(tree.exact for tree in trees), sum(tree.affected for tree in trees)),
        effects=Count(sum(tree.found for tree in trees), sum(tree.effects for tree in trees)),
        sites=Count(sum(tree.sites for tree in trees), sum(tree.effects for tree in trees)),
        false_effects=sum(tree.false_effects for tree in trees),
        all_joints=sum(tree.joints for tree in trees),
        covered=covered([number for one in scores for number in one.parameters]),
        flagged=Count(sum(bool(one.flagged) for one in outside), len(outside)),
        over_floor=float(np.median(errors)) if errors else None,
        seconds=float(np.median([one.seconds for one in scores])),
        slowest=max(one.seconds for one in scores),
        failures=sum(one.failure != "" for one in scores),
    )


def tree_groups(scores: Sequence[CaseScore]) -> tuple[TreeGroup, ...]:
    """Robots with many joints: nothing hidden, hidden effects by number of joints, and outside the vocabulary."""
    trees = [one for one in scores if one.tree is not None]
    inside = [one for one in trees if one.outside is None]
    parts = [("nothing hidden", [one for one in inside if not one.truth])]
    for low, high in SIZES:
        sized = [one for one in inside if one.truth and one.tree is not None and low <= one.tree.joints <= high]
        parts.append((f"{low} to {high} joints", sized))
    parts.append(("all with effects", [one for one in inside if one.truth]))
    parts.append(("outside the vocabulary", [one for one in trees if one.outside is not None]))
    return tuple(tree_group(name, part) for name, part in parts if part)
