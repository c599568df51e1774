"""A moving arm: its model file, a motion, and exactly the forces that it needs for it, with friction beside."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.tree import Tree
from wipx.recordings.robot_model import read_tree
from wipx.sim.tree.inverse import needed_forces

JOINTS = ("pan", "shoulder", "elbow", "wrist")
ARM = """<mujoco><compiler angle="radian"/><worldbody><body name="base">
<inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
<joint name="pan" axis="0 0 1" range="-3 3"/>
<body name="upper" pos="0 0 0.2"><inertial pos="0.2 0 0" mass="0.9" diaginertia="0.002 0.012 0.012"/>
<joint name="shoulder" axis="0 -1 0" range="-2 2"/>
<body name="lower" pos="0.4 0 0"><inertial pos="0.15 0 0" mass="0.5" diaginertia="0.0005 0.005 0.005"/>
<joint name="elbow" axis="0 -1 0" range="-2.6 2.6"/>
<body name="hand" pos="0.3 0 0"><inertial pos="0.08 0 0.02" mass="0.25" diaginertia="0.0005 0.001 0.001"/>
<joint name="wrist" axis="1 0 0" range="-3 3"/></body></body></body></body></worldbody></mujoco>"""


@dataclass(frozen=True)
class MovingArm:
    """A motion of sines, and the forces that an arm needs for it, with friction that its model lacks."""

    path: Path
    tree: Tree
    t: np.ndarray
    q: np.ndarray
    u: np.ndarray


def made_arm(folder: Path) -> MovingArm:
    """The arm, its model file in a folder."""
    path = folder / "arm.xml"
    path.write_text(ARM, encoding="utf-8")
    tree = read_tree(path)
    rng, t = np.random.default_rng(3), np.arange(0.0, 10.0, 0.02)
    frequencies, phases = rng.uniform(0.1, 0.6, (3, 4)), rng.uniform(0.0, 6.3, (3, 4))
    angle = 2.0 * np.pi * frequencies[..., None] * t + phases[..., None]
    size, turning = np.array([0.35, 0.3, 0.35, 0.5])[:, None], 2.0 * np.pi * frequencies[..., None]
    q = (size * np.sin(angle)).sum(axis=0).T + np.array([0.3, 0.4, -0.5, 0.2])
    v = (size * turning * np.cos(angle)).sum(axis=0).T
    a = -(size * turning**2 * np.sin(angle)).sum(axis=0).T
    friction = np.array([0.1, 0.15, 0.08, 0.02]) * np.sign(v) + np.array([0.1, 0.05, 0.02, 0.02]) * v
    u = needed_forces(tree, q, v, a) + friction
    return MovingArm(path, tree, t, q + 2e-4 * rng.normal(size=q.shape), u + 0.01 * rng.normal(size=u.shape))
