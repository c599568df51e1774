"""Where the links of a tree stand in space when its joints are at given positions."""

from dataclasses import dataclass

import numpy as np

from wipx.core.tree import Tree


@dataclass(frozen=True)
class Posture:
    """Frames of the links in the ground's frame; see `wipx.core.tree` for the frame of a link.

    Attributes:
        rotations: From each link's frame to the ground's, shape (N, 3, 3).
        origins: Of the links' frames, shape (N, 3) [m].
    """

    rotations: np.ndarray
    origins: np.ndarray

    def point(self, link: int, place: np.ndarray) -> np.ndarray:
        """A point of a link, given in its frame, in the ground's frame, shape (3,) [m]."""
        return self.rotations[link] @ place + self.origins[link]


def posture(tree: Tree, q: np.ndarray) -> Posture:
    """The frames of all links.

    Args:
        tree: The robot.
        q: Positions of its joints, shape (N,) [rad or m].
    """
    rotations: list[np.ndarray] = []
    origins: list[np.ndarray] = []
    for link, position in zip(tree.links, q, strict=True):
        turn, origin = link.rotation, link.place
        if link.slides:
            origin = origin + position * turn[:, 2]
        else:
            sine, cosine = np.sin(position), np.cos(position)
            turn = turn @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        if link.parent >= 0:
            below = rotations[link.parent]
            origin = below @ origin + origins[link.parent]
            turn = below @ turn
        rotations.append(turn)
        origins.append(origin)
    return Posture(np.array(rotations), np.array(origins))
