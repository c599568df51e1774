"""What joints carry from step to step: kept along a followed recording, taken up where a replay starts."""

from dataclasses import replace

import numpy as np
import pytest
from sim.robots import LIVELY, robot, sines

from wipx.core.model import ModelBatch
from wipx.sim.analytic import AnalyticSimulator, Observer
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path

SIMULATOR = AnalyticSimulator(threads=1)
LAGGED = {"F_c": 0.5, "F_s": 0.9, "v_s": 0.1, "sigma": 0.2, "epsilon": 0.01, "alpha": 0.9}
MEMORIES = {
    "a lag and bristles": {"actuator/lag": {"tau": 0.03}, "pitch/presliding": {"F_c": 0.1, "stiffness": 20.0}},
    "a drive on a spring": {"actuator/elasticity": {"drive_inertia": 0.2, "stiffness": 300.0, "damping": 0.5}},
    "a loose drive": {"actuator/backlash": {"gap": 0.01, "drive_inertia": 0.05, "drive_damping": 1.0}},
    "lagged friction": {"translation/lagged_stribeck": LAGGED},
}
ROWS = np.array([20, 45, 20])  # one of them twice, as logs of a few rows a second have it


@pytest.mark.parametrize("memory", MEMORIES)
def test_a_replay_goes_on_from_what_joints_carry_as_if_it_had_never_stopped(memory: str):
    model = robot("wip", MEMORIES[memory])
    t = np.linspace(0.0, 0.6, 61)
    commands = np.vstack([sines(t, 6.0), [[0.0]]])
    batch, whole = ModelBatch(model), Inputs.of([t], [commands], [0])
    start = np.array(LIVELY["wip"])[:, None, None]
    idle = Observer(np.zeros((61, 2, 1)), np.zeros((1, 61, 1, 4, 2)), np.zeros(1, dtype=np.int64))
    run = SIMULATOR.follow(batch, whole, start, replace(idle, kept=(ROWS, np.zeros(3, dtype=np.int64))))
    assert run.carried is not None
    rest = Inputs.of([t[row:] for row in ROWS], [commands[row:] for row in ROWS], [0, 0, 0])
    states = np.stack([np.concatenate([run.coordinates[row, :, 0, 0], run.rates[row, :, 0, 0]]) for row in ROWS])
    later = SIMULATOR.replay(batch, rest, states.T[:, None], Path.behind(run.carried))
    for window, row in enumerate(ROWS):
        np.testing.assert_array_equal(later.coordinates[: 61 - row, :, 0, window], run.coordinates[row:, :, 0, 0])
