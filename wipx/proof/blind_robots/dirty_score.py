"""Judging a diagnosis of a dirty robot: what was named of its dominant effects, and what was named beside them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

KINDS = (  # laws of the same physics: one may stand for another of the same site where neither holds exactly
    ("coulomb", "stribeck", "presliding", "lugre", "asymmetric_coulomb", "load_friction", "lagged_stribeck"),
    ("viscous", "quadratic_drag"),
    ("delay", "lag"),
    ("saturation", "speed_limit", "back_emf"),
    ("dead_zone", "backlash"),
    ("payload", "payload_event", "inertia"),
)
CORRECTIONS = ("geometry/inertia", "geometry/payload", "actuator/gain")  # what wrong masses and lengths look like
SAGS = ("drive sags with time", "drive sags with load")


@dataclass(frozen=True)
class DirtyScore:
    """What a diagnosis named of a dirty robot.

    Attributes:
        dominant: Dominant effects.
        named: Those that were named, by their name or as an equivalent.
        kin: Others for which another law of the same physics at the same site was named.
        corrected: Named laws that correct what the owner has wrong: nominal numbers, the mean level of a known friction
            or of a drive that sags.
        false_laws: Other named laws.
        over_reference: Error on unseen recordings over that of the true effects fitted to the visible ones, root mean
            square over signals; of a robot with dirt only, over that of the owner's model. None where it is not known.
    """

    dominant: int
    named: int
    kin: int
    corrected: int
    false_laws: int
    over_reference: float | None


def dirty_score(
    truth: Mapping[str, Any], named: tuple[str, ...], found: Mapping[str, str], over_reference: float | None
) -> DirtyScore:
    """Count what was named.

    Args:
        truth: What is hidden, see `write.truth`.
        named: Effects of the answer.
        found: The named effect that stands for each hidden one that was found, see `score.matches`.
        over_reference: See `DirtyScore`.
    """
    hidden = [effect["name"] for effect in truth["effects"]]
    left = [name for name in named if name not in found.values()]
    kin = 0
    for name in hidden:
        other = next((one for one in left if alike(name, one)), None)
        if name not in found and other is not None:
            left.remove(other)
            kin += 1
    corrected = sum(_corrects(name, truth) for name in left)
    return DirtyScore(len(hidden), len(found), kin, corrected, len(left) - corrected, over_reference)


def alike(name: str, other: str) -> bool:
    """Whether two effects are laws of the same physics at the same site."""
    (site, _, law), (place, _, rule) = name.partition("/"), other.partition("/")
    return site == place and any(law in laws and rule in laws for laws in KINDS)


def _corrects(name: str, truth: Mapping[str, Any]) -> bool:
    dirt = truth["dirt"]
    if name in CORRECTIONS and dirt["wrong_parameters"]:
        return True
    sags = any(sag in dirt["names"] for sag in SAGS)
    return (name == "actuator/gain" and sags) or name in truth["known"]
