"""Judging a diagnosis of a robot with many joints, joint by joint."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

WHOLE = ""  # stands for the joint of what acts on the whole robot
LEAST = 0.1  # of its even part of the mismatch, that a site must be given to count as named


@dataclass(frozen=True)
class TreeScore:
    """What a diagnosis named of a robot with many joints.

    What acts on the whole robot (a common delay, a base that is not level) counts as one more joint where it is hidden
    or named.

    Attributes:
        joints: Joints of the robot.
        affected: Joints with hidden effects.
        exact: Of those, joints whose effects are all named, and none beside them.
        effects: Hidden effects.
        found: Of those, the ones that are named, by their name or as an equivalent.
        false_effects: Named effects that are not hidden.
        sites: Hidden effects at whose site, or at that of the equivalent that is named for it, mismatch is located.
    """

    joints: int
    affected: int
    exact: int
    effects: int
    found: int
    false_effects: int
    sites: int


def tree_score(
    truth: Mapping[str, Any], named: tuple[str, ...], found: Mapping[str, str], shares: Mapping[str, float]
) -> TreeScore:
    """Count what was named.

    Args:
        truth: What is hidden, see `trees.write.truth`.
        named: Effects of the answer.
        found: The named effect that stands for each hidden one that was found, see `score.matches`.
        shares: Of the mismatch by site.
    """
    hidden = [effect["name"] for effect in truth["effects"]]
    joints = truth["joints"]
    extra = {joint_of(name, joints) for name in named if name not in found.values()}
    missed = {joint_of(name, joints) for name in hidden if name not in found}
    affected = {joint_of(name, joints) for name in hidden}
    least = LEAST / max(len(hidden), 1)
    located = sum(
        any(shares.get(site_of(one), 0.0) >= least for one in {name, found.get(name, name)}) for name in hidden
    )
    return TreeScore(
        joints=len(joints),
        affected=len(affected),
        exact=len(affected - missed - extra),
        effects=len(hidden),
        found=len(found),
        false_effects=len(named) - len(set(found.values())),
        sites=located,
    )


def joint_of(name: str, joints: Mapping[str, Mapping[str, str]]) -> str:
    """The joint at whose drive, sensor or link an effect "site/kind" is; `WHOLE` for the whole robot."""
    site = site_of(name)
    for joint, own in joints.items():
        if site in (joint, f"actuator_{joint}", f"sensor_{joint}", f"link_{own['body']}"):
            return joint
    return WHOLE


def site_of(name: str) -> str:
    """The site of an effect "site/kind"."""
    return name.partition("/")[0]


def same_force(named: Mapping[str, Mapping[str, Any]], hidden: tuple[str, ...]) -> dict[str, Mapping[str, Any]]:
    """The named effects, with dry friction of two levels told as it is hidden.

    Two levels are Coulomb friction and a constant force of the drive: the same force at any motion and at rest.
    """
    told = dict(named)
    for joint in {site_of(name) for name in (*named, *hidden) if name.endswith(("/asymmetric_coulomb", "/coulomb"))}:
        levels, pair = f"{joint}/asymmetric_coulomb", (f"{joint}/coulomb", f"actuator_{joint}/offset")
        if levels in hidden and levels not in told and all(one in told for one in pair):
            told = {name: answer for name, answer in told.items() if name not in pair} | {levels: {}}
        elif levels in told and levels not in hidden and all(one in hidden for one in pair):
            told = {name: answer for name, answer in told.items() if name != levels} | {one: {} for one in pair}
    return told
