"""How commands that are not in the log move the body unseen."""

import numpy as np
import pytest
from identify.emulated_robot import nominal_model
from sim.robots import unit_axis

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.identify.unlogged_commands import jolts
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

SIMULATOR = AnalyticSimulator(threads=1)
DT = 0.004  # [s]


def logged(t: np.ndarray, x: np.ndarray, command: np.ndarray, rows: np.ndarray) -> tuple[Recording, Inputs, np.ndarray]:
    """Some rows of a run, as a recording, as inputs, and their coordinates."""
    recording = Recording("r1.csv", {"t": t[rows], "x": x[rows], "u": command[rows]})
    return recording, Inputs.of([t[rows]], [command[rows, None]], [0]), x[rows, None, None]


@pytest.mark.parametrize("missing", [1, 4])
@pytest.mark.parametrize("white", [0.0, 1.0])
def test_rows_that_are_missing_move_the_body_by_as_much_as_the_jolts_say(missing: int, white: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = DT * np.arange(4000)
    command = 5.0 * np.sin(11.0 * t) + 3.0 * np.sin(2.7 * t) + white * rng.normal(size=len(t))
    model = unit_axis({})
    run = SIMULATOR.replay(ModelBatch(model), Inputs.of([t], [command[:, None]], [0]), np.zeros((2, 1, 1)))
    true = np.stack([run.coordinates[:, 0, 0, 0], run.rates[:, 0, 0, 0]], axis=1)
    rows = np.flatnonzero(np.arange(len(t)) % 20 >= missing)
    recording, inputs, coordinates = logged(t, true[:, 0], command, rows)
    found = jolts(model, (recording,), inputs, coordinates)[:-1, 0]
    before = np.flatnonzero(recording.missing)
    # One row ahead from the true state, by the command that the log has.
    held = Inputs.of(
        [np.array([0.0, t[rows[k + 1]] - t[rows[k]]]) for k in before],
        [command[rows[[k, k]], None] for k in before],
        [0] * len(before),
    )
    ahead = SIMULATOR.replay(ModelBatch(model), held, true[rows[before]].T[:, None, :])
    reached = np.stack([ahead.coordinates[1, 0, 0], ahead.rates[1, 0, 0]], axis=1)
    errors = true[rows[before + 1]] - reached
    claimed = np.einsum("kii->ki", found[before])
    assert np.all(np.mean(errors**2, axis=0) < 1.3 * np.mean(claimed, axis=0))
    assert np.all(np.mean(errors**2, axis=0) > 0.05 * np.mean(claimed, axis=0))
    assert not found[recording.missing == 0].any()


@pytest.mark.parametrize("kind", ["linear_axis", "wip"])
def test_a_log_of_all_commands_leaves_nothing_open(kind: str):
    model = nominal_model(kind)
    t = DT * np.arange(50)
    columns = {name: np.sin(t) for name in (*model.plant.coordinates, *model.plant.commands)}
    recording = Recording("r1.csv", {"t": t, **columns})
    inputs = Inputs.of([t], [recording.stack(model.plant.commands)], [0])
    coordinates = recording.stack(model.plant.coordinates)[:, :, None]
    assert not jolts(model, (recording,), inputs, coordinates).any()
