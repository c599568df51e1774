"""Robots with many joints, drawn at random: sizes that one could build, from servo kits to industrial arms."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from wipx.proof.blind_robots.robots import log_uniform
from wipx.proof.blind_robots.trees.dynamics import at_poses, room
from wipx.proof.blind_robots.trees.links import Link, rotation
from wipx.proof.blind_robots.trees.physics import Drive, body_of

JOINT_SHARES = {1: 0.05, 2: 0.07, 3: 0.18, 4: 0.18, 5: 0.16, 6: 0.2, 7: 0.16}
NAMES = (
    ("base", "shoulder", "upper_arm", "elbow", "forearm", "wrist", "hand"),
    ("joint_1", "joint_2", "joint_3", "joint_4", "joint_5", "joint_6", "joint_7"),
    ("j1", "j2", "j3", "j4", "j5", "j6", "j7"),
    ("hip", "thigh", "knee", "shank", "ankle", "heel", "toe"),
)
GRAVITY = np.array([0.0, 0.0, -9.81])
POSES = 60  # drawn within the limits, for the inertia that a joint has


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot as its owner believes it to be.

    Attributes:
        links: Parents before children.
        drives: Of each joint.
        urdf: Whether its file is URDF, else MJCF.
        rate: Instants of the controller per second [Hz].
        cutoff: Of the filter of differenced coordinates [Hz].
        inertia: That each joint moves, on average over the poses, shape (joints,) [kg m^2 or kg].
        light: The same where it is small and the other joints are free, shape (joints,).
        weight: Root mean square force of gravity over the poses, shape (joints,) [N m or N].
    """

    links: tuple[Link, ...]
    drives: tuple[Drive, ...]
    urdf: bool
    rate: float
    cutoff: float
    inertia: np.ndarray
    light: np.ndarray
    weight: np.ndarray

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(link.joint for link in self.links)

    @property
    def moves(self) -> str:
        """Which drives it has: "torque", "position" or both."""
        return " and ".join(sorted({drive.kind for drive in self.drives} - {"none"}))


def draw_robot(rng: np.random.Generator, joints: int | None = None) -> Robot:
    """A robot with that many joints, or with a random number of them."""
    count = joints or int(rng.choice(list(JOINT_SHARES), p=list(JOINT_SHARES.values())))
    urdf = bool(rng.random() < 0.3)
    links = _links(count, urdf, rng)
    inertia, light, weight = _poses(links, rng)
    geared = () if urdf else tuple(float(f"{rng.uniform(0.05, 0.5) * size:.3g}") for size in inertia)
    if geared:
        links = tuple(replace(link, armature=own) for link, own in zip(links, geared, strict=True))
    links = tuple(_known_friction(link, size, rng) for link, size in zip(links, weight + 2.0 * inertia, strict=True))
    inertia, light, weight = _poses(links, rng)
    rate = float(rng.choice([100.0, 125.0, 200.0, 250.0, 400.0, 500.0], p=[0.15, 0.15, 0.3, 0.2, 0.1, 0.1]))
    drives = _drives(links, inertia, urdf, rate, rng)
    return Robot(links, drives, urdf, rate, float(rng.uniform(0.12, 0.25) * rate), inertia, light, weight)


def _links(count: int, urdf: bool, rng: np.random.Generator) -> tuple[Link, ...]:
    total = log_uniform(rng, 0.1, 50.0)
    reach = rng.uniform(0.3, 0.5) * total ** (1.0 / 3.0)
    shares = np.cumprod(np.concatenate([[1.0], rng.uniform(0.55, 0.95, count - 1)]))
    masses, lengths = total * shares / shares.sum(), reach * np.sqrt(shares) / np.sqrt(shares).sum()
    names = NAMES[int(rng.integers(len(NAMES)))]
    sliding = rng.random(count) < (0.3 if count == 1 else 0.12)
    branch = int(rng.integers(1, count)) if count >= 4 and rng.random() < 0.3 else count
    links: list[Link] = []
    for i in range(count):
        parent = i - 1 if i != branch else int(rng.integers(0, branch - 1)) if branch > 1 else 0
        below = None if parent < 0 else links[parent]
        links.append(_link(i, names[i], parent, below, bool(sliding[i]), masses[i], lengths[i], urdf, rng))
    return tuple(links)


def _link(
    i: int, name: str, parent: int, below: Link | None, slides: bool, mass: float, length: float, urdf: bool, rng
) -> Link:
    tidy = lambda values: np.array([float(f"{value:.5g}") for value in np.ravel(values)])  # noqa: E731
    direction = np.eye(3)[int(rng.integers(3))] * rng.choice([-1.0, 1.0])
    tip = tidy(length * (direction + rng.normal(0.0, 0.1, 3)))
    half = length * np.array([rng.uniform(0.12, 0.3), rng.uniform(0.12, 0.3), rng.uniform(0.35, 0.6)])
    moments = (
        mass / 3.0 * np.array([half[1] ** 2 + half[2] ** 2, half[0] ** 2 + half[2] ** 2, half[0] ** 2 + half[1] ** 2])
    )
    # the longest side lies along the link, a few degrees beside it
    frame = np.stack([np.roll(direction, 1), np.roll(direction, 2), direction], axis=1)
    frame = frame @ rotation(np.eye(3)[int(rng.integers(3))], rng.normal(0.0, 0.15))
    inertia = np.array([float(f"{v:.6g}") for v in np.ravel(frame @ np.diag(moments) @ frame.T)]).reshape(3, 3)
    inertia = np.tril(inertia) + np.tril(inertia, -1).T
    along = np.eye(3)[int(np.argmax(np.abs(direction)))]
    others = [axis for axis in np.eye(3) if axis @ along == 0.0]
    axis = along if rng.random() < 0.3 or slides else others[int(rng.integers(2))]
    if rng.random() < 0.25:  # an axis that is not along a side
        axis = axis + rng.normal(0.0, 0.3, 3)
    turn = rotation(np.eye(3)[int(rng.integers(3))], 0.5 * pi * float(rng.integers(-1, 3)))
    if rng.random() < 0.25:
        turn = turn @ rotation(np.eye(3)[int(rng.integers(3))], float(f"{rng.uniform(-0.6, 0.6):.3g}"))
    place = np.zeros(3) if below is None else below.tip * float(f"{rng.uniform(0.85, 1.0):.3g}")
    span = rng.uniform(0.3, 0.8) * length + 0.03 if slides else rng.uniform(0.7, 2.4)
    middle = 0.0 if slides else rng.uniform(-0.5, 0.5) * (rng.random() < 0.6)
    return Link(
        body=f"{name}_link" if rng.random() < 0.8 else f"b{i}",
        joint=name,
        parent=parent,
        slides=slides,
        axis=axis / np.linalg.norm(axis),
        turn=turn,
        place=place,
        mass=float(f"{mass:.4g}"),
        com=tidy(rng.uniform(0.3, 0.6) * tip + rng.normal(0.0, 0.04, 3) * length),
        inertia=inertia,
        origin=np.zeros(3) if urdf or rng.random() < 0.7 else tidy(rng.normal(0.0, 0.3, 3) * length),
        tip=tip,
        limits=(float(f"{middle - span:.4g}"), float(f"{middle + span:.4g}")),
        welded=0.0 if urdf or rng.random() < 0.7 else float(f"{rng.uniform(0.1, 0.4):.2g}"),
    )


def _known_friction(link: Link, size: float, rng: np.random.Generator) -> Link:
    """Sometimes the file knows some of a joint's friction."""
    if rng.random() > 0.25:
        return link
    damping = float(f"{rng.uniform(0.01, 0.1) * size:.3g}")
    friction = float(f"{rng.uniform(0.01, 0.06) * size:.3g}") if rng.random() < 0.5 else 0.0
    return replace(link, damping=damping, friction=friction)


def _poses(links: tuple[Link, ...], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean inertia of each joint, its low one with the others free, and root mean square weight, over poses."""
    n = len(links)
    low, high = np.array([link.limits for link in links]).T
    matrices, weights = np.zeros((POSES, n, n)), np.zeros((POSES, n))
    poses = rng.uniform(low, high, (POSES, n))
    body, helper = body_of(links, GRAVITY), np.zeros((2, 3, 3))
    at_poses(poses, np.zeros((POSES, n)), body, room(n), helper, matrices, weights)
    matrices += np.diag([link.armature for link in links])
    inertias = np.diagonal(matrices, axis1=1, axis2=2)
    lights = 1.0 / np.diagonal(np.linalg.inv(matrices), axis1=1, axis2=2)
    return np.mean(inertias, axis=0), np.quantile(lights, 0.1, axis=0), np.sqrt(np.mean(np.square(weights), axis=0))


def _drives(
    links: tuple[Link, ...], inertia: np.ndarray, urdf: bool, rate: float, rng: np.random.Generator
) -> tuple[Drive, ...]:
    style = str(rng.choice(["torque", "position", "mixed"], p=[0.6, 0.3, 0.1]))
    in_file = not urdf and bool(rng.random() < 0.4)
    loop = None if rng.random() < 0.5 or in_file else rate * float(rng.choice([1.0, 2.0, 4.0]))
    stiff = 2.0 * pi * rng.uniform(3.0, 6.0)
    motors = style != "position" and bool(rng.random() < 0.15)
    drives = []
    for size in inertia:
        kind = style if style != "mixed" else str(rng.choice(["torque", "position"]))
        if kind == "position":
            kp = float(f"{size * (stiff * rng.uniform(0.8, 1.25)) ** 2:.4g}")
            kd = float(f"{2.0 * rng.uniform(0.5, 1.0) * np.sqrt(kp * size):.4g}")
            drives.append(Drive("position", kp=kp, kd=kd, rate=loop, in_file=in_file))
        else:
            gain = float(f"{rng.uniform(20.0, 120.0):.3g}") if rng.random() < 0.3 else 1.0
            drives.append(Drive("torque", gain=gain, in_file=in_file, logged="motor" if motors else "command"))
    last = len(links) - 1
    if last > 0 and rng.random() < 0.08 and not links[last].slides:
        drives[last] = Drive("none")
    return tuple(drives)
