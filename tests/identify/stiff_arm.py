"""A double pendulum from a model file whose second joint has a fast position drive, and recordings of it."""

from pathlib import Path

import numpy as np

from wipx.core.drive import Drive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.core.recording import Recording
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts

ARM = """<mujoco><worldbody><body name="upper"><inertial pos="0 0 -0.2" mass="1.5" diaginertia="0.02 0.02 0.002"/>
<joint name="shoulder" axis="0 -1 0"/><body name="lower" pos="0 0 -0.4"><inertial pos="0.02 0 -0.15" mass="0.6"
diaginertia="0.004 0.004 0.0004"/><joint name="elbow" axis="0 -1 0"/></body></body></worldbody></mujoco>"""
NOISE = np.array([1e-4, 1e-4])  # [rad]
ENGINE = AnalyticSimulator(step=2.5e-4, threads=1)


def stiff_arm(folder: Path, kd: float = 8.0) -> Model:
    """A shoulder with a torque drive, an elbow whose drive is damped some hundred times per second."""
    (folder / "arm.xml").write_text(ARM, encoding="utf-8")
    drives = {"shoulder": Drive("torque", gain=1.0), "elbow": Drive("position", kp=120.0, kd=kd, limit=30.0)}
    plant = robot_plant(read_tree(folder / "arm.xml"), drives)
    return Model(plant, plant.complete({}, "robot.yaml"), {})


def motion(model: Model, rng: np.random.Generator, duration: float = 3.0) -> tuple[Recording, Rollouts]:
    """A recording at 250 Hz, and the motion behind it."""
    t = np.arange(0.0, duration, 0.004)
    waves = np.sin(np.outer(t, [3.0, 7.0, 15.0]) + rng.uniform(0.0, 6.28, 3))
    commands = np.stack([waves @ (1.5, 1.0, 0.5), waves @ (0.5, 0.3, 0.2)], axis=1)
    run = ENGINE.replay(ModelBatch(model), Inputs.of([t], [commands], [0]), np.zeros((4, 1, 1)))
    shown = run.coordinates[:, :, 0, 0] + NOISE * rng.normal(size=(len(t), 2))
    columns = {"t": t, "shoulder": shown[:, 0], "elbow": shown[:, 1]}
    columns |= {"u_shoulder": commands[:, 0], "u_elbow": commands[:, 1]}
    return Recording("run.csv", columns), run
