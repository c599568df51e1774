"""Frames of the bodies of a tree, as model files place them, and their masses in these frames."""

from dataclasses import dataclass

import numpy as np

from wipx.core.tree import Link, Tree

NEGLIGIBLE = 1e-12  # relative; products of inertia below it are rounding


@dataclass(frozen=True, eq=False)
class BodyFrame:
    """Frame of a body in its link's.

    Attributes:
        turn: From the body's axes to the link's, shape (3, 3).
        origin: In the link's frame, shape (3,) [m].
    """

    turn: np.ndarray
    origin: np.ndarray

    @property
    def axis(self) -> np.ndarray:
        """The joint's axis in the body's frame, shape (3,)."""
        return self.turn[2]

    @property
    def anchor(self) -> np.ndarray:
        """Origin of the link's frame, a point of the axis, in the body's frame, shape (3,) [m]."""
        return self.inside(np.zeros(3))

    def inside(self, place: np.ndarray) -> np.ndarray:
        """A point (3,) of the link's frame in the body's."""
        return self.turn.T @ (place - self.origin)


GROUND = BodyFrame(np.eye(3), np.zeros(3))


def own_frame(link: Link) -> BodyFrame:
    """The frame that the body has in its file."""
    return BodyFrame(link.body_rotation, link.body_place)


def frame_on_axis(link: Link) -> BodyFrame:
    """The body's own axes, their origin moved onto the joint's axis where the joint turns."""
    origin = link.body_place if link.slides else link.body_place * (0.0, 0.0, 1.0)
    return BodyFrame(link.body_rotation, origin)


def placed(tree: Tree, frames: list[BodyFrame], i: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3, 3) and origin (3,) of body i in the frame of the body below, all joints at zero."""
    link, own = tree.links[i], frames[i]
    below = frames[link.parent] if link.parent >= 0 else GROUND
    turn = below.turn.T @ link.rotation @ own.turn
    return turn, below.inside(link.place + link.rotation @ own.origin)


def principal(inertia: np.ndarray, least: float) -> tuple[np.ndarray, np.ndarray]:
    """Moments of inertia (3,), each `least` or more, and the axes (3, 3), columns, to which they belong.

    The largest moment is no more than the sum of the others, which rounding may violate.
    """
    sizes = np.abs(np.diag(inertia)).max()
    if np.abs(inertia - np.diag(np.diag(inertia))).max() <= NEGLIGIBLE * sizes:
        moments, axes = np.diag(inertia), np.eye(3)
    else:
        moments, axes = np.linalg.eigh(inertia)
        axes = axes * np.linalg.det(axes)  # right-handed
    moments = np.maximum(moments, least)
    return np.minimum(moments, moments.sum() - moments), axes


def roll_pitch_yaw(turn: np.ndarray) -> np.ndarray:
    """Angles (3,) of Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    across = float(np.hypot(turn[0, 0], turn[1, 0]))
    pitch = np.arctan2(-turn[2, 0], across)
    if across < 1e-9:  # roll and yaw are about one axis
        return np.array([np.arctan2(-turn[1, 2], turn[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(turn[2, 1], turn[2, 2]), pitch, np.arctan2(turn[1, 0], turn[0, 0])])
