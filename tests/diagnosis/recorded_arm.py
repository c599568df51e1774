"""An arm of two joints from a model file, and what it records while its drives shake it."""

from pathlib import Path

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.recordings.robot_file import robot_from_mapping
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

ARM = """<mujoco><worldbody><body name="upper"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="shoulder" axis="0 -1 0" damping="0.05"/><body name="lower" pos="0 0 -0.3">
<inertial pos="0 0 -0.15" mass="0.3" diaginertia="0.004 0.004 0.0005"/><joint name="elbow" axis="1 0 0"/>
</body></body></worldbody></mujoco>"""
NOISE = 2e-5  # [rad]


def arm(folder: Path, mjcf: str = ARM) -> Model:
    """The arm, or another robot of torque drives."""
    (folder / "arm.xml").write_text(mjcf, encoding="utf-8")
    return robot_from_mapping({"plant": "robot", "model": "arm.xml"}, "robot.yaml", folder).model


def recorded(model: Model, seed: int, sizes: tuple[float, ...] = (0.5, 0.25)) -> Recording:
    """Ten seconds of slow and fast waves, of some size at each joint [N or N m]."""
    rng, t, plant = np.random.default_rng(seed), np.arange(0.0, 10.0, 0.004), model.plant
    phases = rng.uniform(0.0, 6.3, (3, len(sizes)))
    waves = np.sin(2.0 * np.pi * np.array([0.4, 0.9, 1.7])[:, None, None] * t + phases[..., None])
    commands = (waves.sum(axis=0) * np.array(sizes)[:, None]).T
    start = np.zeros((2 * len(sizes), 1, 1))
    run = AnalyticSimulator().replay(ModelBatch(model), Inputs.of([t], [commands], [0]), start)
    q = run.coordinates[:, :, 0, 0] + NOISE * rng.normal(size=(len(t), len(sizes)))
    columns = {
        "t": t,
        **dict(zip(plant.coordinates, q.T, strict=True)),
        **dict(zip(plant.commands, commands.T, strict=True)),
    }
    return Recording("r1.csv", columns)
