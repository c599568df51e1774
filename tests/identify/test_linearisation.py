"""The body along a recording, linearised: small changes of the state go on as in the simulator."""

from pathlib import Path

import numpy as np
import pytest
from identify.stiff_arm import ENGINE, motion, stiff_arm

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.identify.linearisation import answers_to_commands, linearise_along, transition_over
from wipx.sim.inputs import Inputs

pytest.importorskip("mujoco")
ROWS = (150, 300, 450, 600)


def one_row_later(model: Model, recording: Recording, row: int, states: np.ndarray, commands: np.ndarray) -> np.ndarray:
    """States (2 joints, C) after a row of the recording under commands (inputs, C)."""
    t = recording.t[row : row + 2]
    count = states.shape[1]
    inputs = Inputs.of([t] * count, [np.repeat(each[None], 2, axis=0) for each in commands.T], [0] * count)
    run = ENGINE.replay(ModelBatch(model), inputs, states[:, None])
    return np.concatenate([run.coordinates[1, :, 0], run.rates[1, :, 0]])


@pytest.mark.parametrize("kd", [0.1, 8.0])
def test_changes_of_state_and_of_command_go_on_as_in_the_simulator(kd: float, tmp_path: Path, fresh_seed: int):
    model = stiff_arm(tmp_path, kd)
    recording, run = motion(model, np.random.default_rng(fresh_seed))
    inputs = Inputs.of([recording.t], [recording.stack(model.plant.commands)], [0])
    coordinates = recording.stack(model.plant.coordinates)[:, :, None]
    linear = linearise_along(model, inputs, coordinates)
    slopes = answers_to_commands(model, inputs, coordinates)
    for row in ROWS:
        state = np.concatenate([run.coordinates[row, :, 0, 0], run.rates[row, :, 0, 0]])
        commands = inputs.commands[row, :, 0]
        moved = np.concatenate([np.eye(4), -np.eye(4), np.zeros((4, 4))], axis=1)
        asked = np.concatenate([np.zeros((2, 8)), np.eye(2), -np.eye(2)], axis=1)
        small = 1e-5
        ends = one_row_later(model, recording, row, state[:, None] + small * moved, commands[:, None] + small * asked)
        by_state = (ends[:, :4] - ends[:, 4:8]) / (2.0 * small)
        by_command = (ends[:, 8:10] - ends[:, 10:]) / (2.0 * small)
        transition, pushed = np.zeros((4, 4)), np.zeros((4, 2))
        dt = float(recording.t[row + 1] - recording.t[row])
        transition_over(linear.a[linear.place[row, 0]], dt, transition, pushed, np.zeros_like(transition))
        size = np.array([dt, dt, 1.0, 1.0])[:, None]
        np.testing.assert_allclose(transition / size, by_state / size, atol=0.03 * np.abs(by_state / size).max())
        expected = pushed @ slopes[row, 0]
        np.testing.assert_allclose(expected, by_command, atol=0.05 * np.abs(by_command).max())
