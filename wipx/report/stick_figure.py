"""A robot as a stick figure: its joints and links as points of a plane, seen from the side that shows most.

Only geometry; colours, labels and files are in `wipx.report.robot_picture`.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.posture import Posture, posture
from wipx.core.tree import Tree

AZIMUTHS, ELEVATIONS = np.deg2rad(np.arange(0.0, 360.0, 15.0)), np.deg2rad([10.0, 25.0])
APART = 0.055  # least distance of two joints, as a share of the figure's size
SHORTEST_END = 0.06  # of the last link of a branch, likewise


@dataclass(frozen=True)
class View:
    """Directions of the ground's frame that point right and up in the picture, shape (3,) each; at right angles."""

    right: np.ndarray
    up: np.ndarray

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the ground's frame in the picture's plane, shape (..., 2) [m]."""
        return points @ np.stack([self.right, self.up], axis=1)


@dataclass(frozen=True)
class StickFigure:
    """Points of a robot in the picture's plane [m], x to the right and y up.

    Joints that coincide, as those of a wrist, are moved apart so that each can be seen.

    Attributes:
        base: Origin of the ground's frame, shape (2,).
        joints: Shape (N, 2).
        ends: Tips of the links that carry no other, else NaN, shape (N, 2).
        axes: Directions of the joints' axes; their length is 1 where they lie in the plane, shape (N, 2).
        ground: Directions of the x, y and z axis of the ground, shape (3, 2).
    """

    base: np.ndarray
    joints: np.ndarray
    ends: np.ndarray
    axes: np.ndarray
    ground: np.ndarray


def stick_figure(tree: Tree, q: np.ndarray, view: View, size: float) -> StickFigure:
    """The figure of a robot whose joints are at `q`, shape (N,) [rad or m].

    Args:
        tree: The robot.
        q: Positions of its joints, shape (N,) [rad or m].
        view: From where it is seen.
        size: Of the figure, as of `figure_size` [m]; how far apart joints are kept.
    """
    at = posture(tree, q)
    base = view.flat(np.zeros(3))
    joints = view.flat(_joint_points(tree, at))
    ends = view.flat(_end_points(tree, at))
    below = [link.parent for link in tree.links]
    moved = _kept_apart(joints, below, base, APART * size)
    ends = _long_enough(moved, ends + moved - joints, below, base, SHORTEST_END * size)
    return StickFigure(base, moved, ends, view.flat(at.rotations[:, :, 2]), view.flat(np.eye(3)))


def figure_size(tree: Tree, q: np.ndarray) -> float:
    """Largest extent of the robot in space at a posture `q`, shape (N,) [m]; 1 m for a robot that is a point."""
    at = posture(tree, q)
    points = np.vstack([np.zeros(3), _joint_points(tree, at), _end_points(tree, at)])
    extent = float(np.nanmax(np.nanmax(points, axis=0) - np.nanmin(points, axis=0)))
    return extent or 1.0


def best_view(tree: Tree, q: np.ndarray) -> View:
    """The side from which the joints of a robot at posture `q`, shape (N,), lie farthest apart; gravity points down.

    A robot that moves in one plane is seen at right angles to it.
    """
    up = -tree.gravity if np.any(tree.gravity) else np.array([0.0, 0.0, 1.0])
    up = up / np.linalg.norm(up)
    at = posture(tree, q)
    normal = _plane_normal(tree, at)
    if normal is not None:
        vertical = up - normal * (normal @ up)
        if np.linalg.norm(vertical) < 1e-6:  # it moves in a horizontal plane: seen from above
            vertical = np.eye(3)[1] if abs(normal[1]) < 0.9 else np.eye(3)[2]
            vertical = vertical - normal * (normal @ vertical)
        vertical = vertical / np.linalg.norm(vertical)
        right = np.cross(vertical, normal)
        return View(right * np.sign(right[int(np.argmax(np.abs(right)))]), vertical)  # x or y points right
    points = np.vstack([np.zeros(3), _joint_points(tree, at), _end_points(tree, at)])
    points = points[~np.isnan(points[:, 0])]
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across = across / np.linalg.norm(across)
    views = [_seen_from(up, across, a, e) for e in ELEVATIONS for a in AZIMUTHS]
    return max(views, key=lambda view: _spread(view.flat(points)))


def _seen_from(up: np.ndarray, across: np.ndarray, azimuth: float, elevation: float) -> View:
    forward = np.cross(up, across)
    toward = np.cos(azimuth) * across + np.sin(azimuth) * forward
    right = np.cross(up, toward)
    return View(right, np.cos(elevation) * up - np.sin(elevation) * toward)


def _spread(points: np.ndarray) -> float:
    """Mean logarithm of the distances between points (n, 2); a bent chain scores more than a straight one."""
    away = np.linalg.norm(points[:, None] - points[None], axis=-1)[np.triu_indices(len(points), 1)]
    size = float(away.max(initial=0.0)) or 1.0
    return float(np.mean(np.log(away + 0.02 * size)))


def _plane_normal(tree: Tree, at: Posture) -> np.ndarray | None:
    """Direction of all hinges at right angles to which all slides move; None where there is none."""
    axes = at.rotations[:, :, 2]
    hinges = axes[[not link.slides for link in tree.links]]
    slides = axes[[link.slides for link in tree.links]]
    if not len(hinges):
        return None
    if np.any(np.linalg.norm(np.cross(hinges, hinges[0]), axis=1) > 1e-3) or np.any(abs(slides @ hinges[0]) > 1e-3):
        return None
    return hinges[0]


def _joint_points(tree: Tree, at: Posture) -> np.ndarray:
    """A point of every joint, shape (N, 3): of a hinge the point of its axis nearest to the body's own origin."""
    own = [link.body_place if link.slides else link.body_place * (0.0, 0.0, 1.0) for link in tree.links]
    return np.array([at.point(i, place) for i, place in enumerate(own)])


def _end_points(tree: Tree, at: Posture) -> np.ndarray:
    """The tip of every link that carries no other: twice as far from its joint as its centre of mass."""
    joints, carrying = _joint_points(tree, at), {link.parent for link in tree.links}
    ends = np.full((len(tree.links), 3), np.nan)
    for i, link in enumerate(tree.links):
        if i not in carrying:
            ends[i] = 2.0 * at.point(i, link.com) - joints[i]
    return ends


def _kept_apart(joints: np.ndarray, parents: list[int], base: np.ndarray, least: float) -> np.ndarray:
    """Joints (N, 2), moved as little as needed to be `least` apart.

    Joints that coincide part along the way from the joint below to the first one beyond them.
    """
    moved = joints.copy()
    for i, parent in enumerate(parents):
        below = joints[parent] if parent >= 0 else base
        beyond = [k for k in range(i + 1, len(joints)) if parents[k] == i]
        far = [joints[k] - below for k in beyond if np.linalg.norm(joints[k] - below) > least]
        ahead = far[0] if far else joints[i] - (joints[parents[parent]] if parent > 0 else base)
        length = float(np.linalg.norm(ahead))
        direction = ahead / length if length > 1e-9 else np.array([0.6, 0.8])
        # A small step in that direction, a different one for each joint, decides which way joints part.
        moved[i] += 0.01 * least * (i % 7) * direction
    for _ in range(60):
        gap = moved[:, None] - moved[None]
        distance = np.linalg.norm(gap, axis=-1)
        np.fill_diagonal(distance, np.inf)
        if distance.min(initial=np.inf) > 0.98 * least:
            break
        lacking = np.clip(least - distance, 0.0, None) / (distance + 1e-12)
        moved += 0.4 * np.einsum("ij,ijk->ik", lacking, gap)
    return moved


def _long_enough(
    joints: np.ndarray, ends: np.ndarray, parents: list[int], base: np.ndarray, shortest: float
) -> np.ndarray:
    """Tips moved out to `shortest` from their joints where they are nearer; NaN stays."""
    ends = ends.copy()
    for i, parent in enumerate(parents):
        if np.isnan(ends[i, 0]):
            continue
        away = ends[i] - joints[i]
        if np.linalg.norm(away) < 0.3 * shortest:
            away = joints[i] - (joints[parent] if parent >= 0 else base)
        length = float(np.linalg.norm(away))
        if length < shortest:
            ends[i] = joints[i] + shortest * (away / length if length > 1e-9 else np.array([0.0, 1.0]))
    return ends
