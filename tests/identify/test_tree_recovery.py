"""Stiffness and damping of a position drive come back from noisy recordings of a robot from a model file."""

from pathlib import Path

import numpy as np
import pytest

from wipx.core.drive import Drive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.core.recording import Recording, RecordingSplit
from wipx.identify.identification import Request, identify
from wipx.identify.objectives import MultiStep
from wipx.identify.optimizers.least_squares import LeastSquares
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

pytest.importorskip("mujoco")
ONE = """<mujoco><worldbody><body name="upper"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="shoulder" axis="0 -1 0"/></body></worldbody></mujoco>"""
HIDDEN = {"actuator_shoulder/kp": {"factor": 0.85}, "actuator_shoulder/kd": {"factor": 1.2}}
NOISE = 3e-4  # [rad]
SIMULATOR = AnalyticSimulator(threads=1)


@pytest.mark.parametrize("rate", [None, 50.0])
def test_stiffness_and_damping_of_a_position_drive_come_back(rate: float | None, tmp_path: Path, fresh_seed: int):
    (tmp_path / "arm.xml").write_text(ONE, encoding="utf-8")
    plant = robot_plant(read_tree(tmp_path / "arm.xml"), {"shoulder": Drive("position", kp=8.0, kd=0.4, rate=rate)})
    nominal = Model(plant, plant.complete({}, "robot.yaml"), {})
    rng, t = np.random.default_rng(fresh_seed), np.arange(0.0, 3.0, 0.005)
    recordings = []
    for k in range(2):
        target = 0.5 * np.sin(np.outer(t, [4.0, 11.0, 23.0]) + rng.uniform(0.0, 6.28, 3)) @ (0.6, 0.4, 0.3)
        inputs = Inputs.of([t], [target[:, None]], [0])
        run = SIMULATOR.replay(ModelBatch(nominal.with_effects(HIDDEN)), inputs, np.zeros((2, 1, 1)))
        shown = run.coordinates[:, 0, 0, 0] + NOISE * rng.normal(size=len(t))
        recordings.append(Recording(f"r{k}.csv", {"t": t, "shoulder": shown, "u_shoulder": target}))
    found = identify(
        Request(nominal, tuple(HIDDEN), {}, {}, {}),
        RecordingSplit(tuple(recordings), (), "as the test says"),
        SIMULATOR,
        MultiStep(horizon=0.3),
        LeastSquares(starts=1),
        horizon=0.5,
        rng=np.random.default_rng(0),
    )
    for estimate in found.estimates:
        effect = estimate.name.rpartition(".")[0]
        assert estimate.value == pytest.approx(HIDDEN[effect]["factor"], rel=0.03), estimate
