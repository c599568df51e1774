"""Prediction windows of contract section 4."""

import numpy as np
import pytest
from emulated_robot import ANGLE_NOISE, Robot, nominal_model, sensor_deviations

from wipx.core.errors import InputError
from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.identify.prediction import Predictor
from wipx.identify.windows import LOOK_AHEAD, Windows, cut
from wipx.sim.analytic import AnalyticSimulator

HORIZON, LEAD = 0.5, 0.3
PENDULUM = nominal_model("pendulum")
ROBOT = Robot(PENDULUM.with_effects({"pitch/coulomb": {"F_c": 0.05}}))


@pytest.fixture(scope="module")
def recording() -> Recording:
    return ROBOT.record(np.random.default_rng(5), 1)[0]


def contract_windows(*recordings: Recording) -> Windows:
    return cut(recordings, PENDULUM.plant, horizon=HORIZON, lead=LEAD)


def predicted(recording: Recording) -> np.ndarray:
    """Predictions of a recording by the right model, NaN where there is none, shape (rows,) [rad]."""
    windows = contract_windows(recording)
    out = Predictor(AnalyticSimulator(threads=1), windows, sensor_deviations(PENDULUM)).predict(ModelBatch(ROBOT.model))
    series = np.full(len(recording), np.nan)
    for r in range(windows.count):
        rows = np.flatnonzero(windows.predicted[:, r])
        series[windows.row[r] + rows] = out.coordinates[rows, 0, 0, r]
    return series


def jittered(recording: Recording, rng: np.random.Generator) -> Recording:
    """The same motion with a fifth of the rows lost and the others moved a little in time."""
    kept = rng.random(len(recording)) < 0.8
    kept[0] = True
    t = recording.t + rng.uniform(0.0, 1e-3, len(recording))
    return Recording("jittered.csv", {n: (t if n == "t" else c)[kept] for n, c in recording.columns.items()})


def test_predictions_restart_every_half_second_from_half_a_second_on(recording: Recording):
    windows = contract_windows(recording)
    np.testing.assert_allclose(windows.starts, [0.5, 1.0, 1.5, 2.0, 2.5])


def test_every_row_after_the_first_half_second_is_predicted_once(recording: Recording):
    windows = contract_windows(recording)
    count = np.zeros(len(recording), dtype=int)
    for r in range(windows.count):
        np.add.at(count, windows.row[r] + np.flatnonzero(windows.predicted[:, r]), 1)
    np.testing.assert_array_equal(count, recording.t >= 0.5 - 1e-9)


@pytest.mark.parametrize("uneven", [False, True])
def test_the_state_is_estimated_from_the_lead_and_the_look_ahead(recording: Recording, uneven: bool):
    log = jittered(recording, np.random.default_rng(1)) if uneven else recording
    windows = contract_windows(log)
    for r, start in enumerate(windows.starts):
        t = log.t[windows.row[r] + np.flatnonzero(windows.known[:, r])]
        expected = log.t[(log.t >= start - LEAD - 1e-6) & (log.t <= start + LOOK_AHEAD + 1e-6)]
        np.testing.assert_array_equal(t, expected)


def test_nothing_after_the_look_ahead_influences_a_prediction(recording: Recording):
    before = predicted(recording)
    for start in (0.5, 1.5, 2.5):
        later = recording.t > start + LOOK_AHEAD + 1e-6
        falsified = np.where(later, 7.0, recording["theta"])
        after = predicted(Recording("other.csv", {**recording.columns, "theta": falsified}))
        window = (recording.t >= start - 1e-6) & (recording.t < start + HORIZON - 1e-6)
        np.testing.assert_array_equal(after[window], before[window])


def test_commands_after_a_row_do_not_influence_its_prediction(recording: Recording):
    row = int(np.searchsorted(recording.t, 1.8))
    falsified = np.where(np.arange(len(recording)) >= row, 3.0, recording["u"])
    after = predicted(Recording("other.csv", {**recording.columns, "u": falsified}))
    np.testing.assert_array_equal(after[: row + 1], predicted(recording)[: row + 1])
    assert abs(after[row + 20] - predicted(recording)[row + 20]) > 1e-3


def test_the_right_model_predicts_at_the_level_of_the_noise(recording: Recording):
    errors = predicted(recording) - recording["theta"]
    # The estimated state adds to the sensor's own noise; without friction's memory it is a small part.
    assert np.sqrt(np.nanmean(errors**2)) < 2.0 * ANGLE_NOISE


def test_missing_rows_and_uneven_steps_cost_little(recording: Recording):
    sparse = jittered(recording, np.random.default_rng(2))
    errors = predicted(sparse) - sparse["theta"]
    covered = ~np.isnan(errors)
    np.testing.assert_array_equal(covered, sparse.t >= sparse.t[0] + 0.5 - 1e-6)
    # Up to 1 ms of jitter at 1 rad/s is three times the noise; lost commands come on top.
    assert np.sqrt(np.nanmean(errors**2)) < 60.0 * ANGLE_NOISE


def test_a_gap_without_rows_costs_its_window_only(recording: Recording):
    gap = (recording.t > 1.2) & (recording.t < 1.9)
    windows = contract_windows(Recording("gap.csv", {n: c[~gap] for n, c in recording.columns.items()}))
    assert {0.5, 2.0, 2.5} <= set(np.round(windows.starts, 6))
    assert windows.predicted.any(axis=0).all()


def test_recordings_keep_their_own_time(recording: Recording):
    moved = Recording("moved.csv", {**recording.columns, "t": recording.t + 100.0})
    windows = contract_windows(recording, moved)
    np.testing.assert_array_equal(windows.recording, np.repeat([0, 1], 5))
    np.testing.assert_allclose(windows.starts[5:], windows.starts[:5] + 100.0)
    # The rounding of t may end an estimate of the state one step earlier or later.
    np.testing.assert_allclose(predicted(moved), predicted(recording), atol=0.1 * ANGLE_NOISE)


def test_a_recording_shorter_than_a_window_is_refused_in_one_line(recording: Recording):
    short = Recording("short.csv", dict(recording.between(0.0, 0.5).columns), "folder/short.csv")
    with pytest.raises(InputError, match=r"^folder/short\.csv: 0\.496 s long, expected more than 0\.55 s .* longer$"):
        contract_windows(recording, short)


def test_shooting_windows_begin_with_the_recording_and_see_all_their_rows(recording: Recording):
    windows = cut((recording,), PENDULUM.plant, horizon=HORIZON, lead=0.0, shooting=True)
    np.testing.assert_allclose(windows.starts, np.arange(6) * 0.5)
    np.testing.assert_array_equal(windows.known, windows.predicted)
