"""Links of a tree of hinges and slides, and what changes their masses.

A link's frame has its origin on its joint, and the axes of the body's frame in the file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Link:
    """A link and the joint that carries it.

    Attributes:
        body: Name of the body.
        joint: Name of the joint.
        parent: Number of the link below, -1 for the ground; lower than the link's own.
        slides: Whether the joint slides; else it turns.
        axis: Of the joint, in the link's frame, shape (3,), of length one.
        turn: From the link's frame to its parent's, at position zero, shape (3, 3).
        place: Origin in the parent's frame, shape (3,) [m].
        mass: [kg].
        com: Centre of mass in the link's frame, shape (3,) [m].
        inertia: About the centre of mass, in the link's frame, shape (3, 3) [kg m^2].
        origin: Origin of the body's frame of the file, in the link's frame, shape (3,) [m].
        tip: Far end, where the next links are, shape (3,) [m].
        limits: Lowest and highest position [rad or m].
        armature: Inertia of the joint itself [kg m^2 or kg].
        damping: Viscous friction that the file knows [N m s/rad or N s/m].
        friction: Dry friction that the file knows [N m or N].
        welded: Share of the mass that the file has in a second body, welded to the first.
    """

    body: str
    joint: str
    parent: int
    slides: bool
    axis: np.ndarray
    turn: np.ndarray
    place: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    origin: np.ndarray
    tip: np.ndarray
    limits: tuple[float, float]
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    welded: float = 0.0

    @property
    def length(self) -> float:
        """Distance of the far end from the joint [m]."""
        return float(np.linalg.norm(self.tip))

    def with_mass_at(self, mass: float, point: np.ndarray) -> "Link":
        """The link with a point mass at a point of its frame; a negative one is taken out."""
        total = self.mass + mass
        com = (self.mass * self.com + mass * point) / total
        own, other = self.com - com, point - com
        return replace(
            self,
            mass=total,
            com=com,
            inertia=self.inertia + self.mass * steiner(own) + mass * steiner(other),
        )


def steiner(arm: np.ndarray) -> np.ndarray:
    """Moments of inertia of a unit point mass at `arm` from the reference point, shape (3, 3)."""
    return float(arm @ arm) * np.eye(3) - np.outer(arm, arm)


def changed(links: tuple[Link, ...], effects: Mapping[str, Mapping[str, float]]) -> tuple[Link, ...]:
    """The links with the effects of the sites `link_BODY`; first the centre moves, then inertia, then the payload."""
    found = []
    for link in links:
        site = f"link_{link.body}"
        moved = effects.get(f"{site}/com_offset")
        if moved is not None:
            link = replace(link, com=link.com + _point(moved))
        scaled = effects.get(f"{site}/inertia")
        if scaled is not None:
            link = replace(link, inertia=link.inertia * scaled["scale"])
        load = effects.get(f"{site}/payload")
        if load is not None:
            link = link.with_mass_at(load["mass"], _point(load) + link.origin)
        found.append(link)
    return tuple(found)


def corrected(links: tuple[Link, ...], values: Mapping[str, float]) -> tuple[Link, ...]:
    """The links with other numbers: "BODY.mass", "BODY.com_x" (in the body's frame), "BODY.inertia" (a factor)."""
    found = []
    for link in links:
        known = {name.rpartition(".")[2]: value for name, value in values.items() if name.startswith(f"{link.body}.")}
        com = [known.get(f"com_{axis}", before) for axis, before in zip("xyz", link.com - link.origin, strict=True)]
        mass, scale = known.get("mass", link.mass), known.get("inertia", 1.0)
        found.append(replace(link, mass=mass, com=np.array(com) + link.origin, inertia=link.inertia * scale))
    return tuple(found)


def _point(values: Mapping[str, float]) -> np.ndarray:
    return np.array([values[axis] for axis in "xyz"])


def rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """Turn by an angle about an axis of length one, shape (3, 3) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def tilted(gravity: np.ndarray, roll: float, pitch: float) -> np.ndarray:
    """Gravity in the frame of a base that is turned by R = Ry(pitch) Rx(roll): R^T g."""
    turn = rotation(np.array([0.0, 1.0, 0.0]), pitch) @ rotation(np.array([1.0, 0.0, 0.0]), roll)
    return turn.T @ gravity
