"""A robot as an open tree of links, each carried by one hinge or slide.

A link's frame has its origin on the joint's axis and z along it; at position zero of the joint it stands in its
parent's frame as `rotation` and `place` say. The ground is number -1.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Link:
    """A link and the joint that carries it; arrays are read only.

    Attributes:
        joint: Name of the joint.
        body: Name of the body. Between two joints of one body stands a link without mass, named after body and joint.
        parent: Number of the link below, -1 for the ground; always lower than the link's own.
        slides: Whether the joint slides; else it turns.
        rotation: From the link's frame to its parent's, at position zero, shape (3, 3).
        place: Origin in the parent's frame, shape (3,) [m].
        mass: Of the body and all that is welded to it [kg].
        com: Centre of mass in the link's frame, shape (3,) [m].
        inertia: About the centre of mass, in the link's frame, shape (3, 3) [kg m^2].
        body_rotation: From the body's own frame to the link's, shape (3, 3).
        body_place: Origin of the body's own frame in the link's, shape (3,) [m].
        armature: Inertia of the joint itself [kg m^2 or kg].
        damping: [N m s/rad or N s/m].
        friction: Dry friction [N m or N].
        limits: Lowest and highest position; None for no limits [rad or m].
        effort: Largest force of the drive; None for no limit [N m or N].
        speed: Largest speed; None for no limit [rad/s or m/s].
    """

    joint: str
    body: str
    parent: int
    slides: bool
    rotation: np.ndarray
    place: np.ndarray
    mass: float
    com: np.ndarray
    inertia: np.ndarray
    body_rotation: np.ndarray
    body_place: np.ndarray
    armature: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    limits: tuple[float, float] | None = None
    effort: float | None = None
    speed: float | None = None


@dataclass(frozen=True)
class ModelFile:
    """The MJCF or URDF file that a tree was read from.

    Attributes:
        path: Absolute.
        locked: Joints that were fixed, with their positions [rad or m].
    """

    path: Path
    locked: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Tree:
    """An open kinematic tree on a fixed base.

    Attributes:
        links: Parents before children; link i is carried by joint i.
        gravity: In the ground's frame, shape (3,) [m/s^2].
        source: The file that it was read from, which need not be there any more; None for a tree from elsewhere.
    """

    links: tuple[Link, ...]
    gravity: np.ndarray
    source: ModelFile | None = None

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the links."""
        return tuple(link.joint for link in self.links)

    def ancestors(self, i: int) -> tuple[int, ...]:
        """Links below link i, the nearest first."""
        found: list[int] = []
        parent = self.links[i].parent
        while parent >= 0:
            found.append(parent)
            parent = self.links[parent].parent
        return tuple(found)
