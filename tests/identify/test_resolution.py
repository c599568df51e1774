"""Steps of the integrator are as short as the drives of a robot ask for."""

from pathlib import Path

import numpy as np
import pytest
from identify.emulated_robot import Robot, nominal_model
from identify.stiff_arm import NOISE, motion, stiff_arm

from wipx.identify.resolution import resolving
from wipx.sim.analytic import AnalyticSimulator

SIMULATOR = AnalyticSimulator(threads=1)


def test_a_fast_drive_asks_for_shorter_steps_than_a_slow_one(tmp_path: Path, fresh_seed: int):
    pytest.importorskip("mujoco")
    steps = {}
    for kd in (0.1, 8.0):
        model = stiff_arm(tmp_path, kd)
        recording, _ = motion(model, np.random.default_rng(fresh_seed))
        steps[kd] = resolving(SIMULATOR, model, (recording,), NOISE).step
    assert steps[0.1] == SIMULATOR.step
    assert steps[8.0] < steps[0.1]


def test_plants_without_loops_of_their_own_keep_the_step(fresh_seed: int):
    model = nominal_model("wip")
    recordings = Robot(model, 2.0).record(np.random.default_rng(fresh_seed), 1)
    assert resolving(SIMULATOR, model, recordings, np.full(2, 1e-4)) is SIMULATOR
