"""Where predictions start: smoothed states follow right models closely, forgive wrong ones, and know no future."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from identify.emulated_robot import Robot, nominal_model
from identify.stiff_arm import ENGINE, NOISE, motion, stiff_arm

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.identify.smoothing import BANDWIDTHS, Smoother
from wipx.identify.starts import starts_by
from wipx.identify.windows import LOOK_AHEAD, cut
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

SIMULATOR = AnalyticSimulator(threads=1)
KINDS = ("wip", "pendulum", "linear_axis", "double_pendulum")
WRONG = {"linear_axis": {"translation/coulomb": {"F_c": 1.0}}, "pendulum": {"pitch/coulomb": {"F_c": 0.2}}}


def recorded(kind: str, effects, seed: int, duration: float = 3.0):
    return Robot(nominal_model(kind).with_effects(effects), duration).record(np.random.default_rng(seed), 2)


@pytest.mark.parametrize("kind", KINDS)
def test_no_later_row_than_the_look_ahead_changes_a_state(kind: str, fresh_seed: int):
    model, recordings = nominal_model(kind), recorded(kind, {}, fresh_seed)
    noise = sensor_noise(recordings, model.plant)
    bandwidth = np.full(len(noise), 10.0)
    whole = Smoother(SIMULATOR, model.plant, recordings[:1], noise).along(model, bandwidth)
    t = recordings[0].t
    cut = int(np.searchsorted(t, 0.5 * t[-1]))
    part = replace(recordings[0].rows(0, cut + 1), name="part")
    short = Smoother(SIMULATOR, model.plant, (part,), noise).along(model, bandwidth)
    known = int(np.searchsorted(t, t[cut] - LOOK_AHEAD - 1e-6))
    np.testing.assert_allclose(short[:known], whole[:known], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_model_predicts_best_from_states_that_hardly_trust_it(kind: str, fresh_seed: int):
    recordings = recorded(kind, WRONG[kind], fresh_seed)
    nominal = nominal_model(kind)
    judge = Judge(SIMULATOR, sensor_noise(recordings, nominal.plant), 0.5)
    wrong = judge.tuned(nominal, recordings)
    assert max(wrong.bandwidths.values()) >= 10.0
    trusted = replace(nominal, bandwidths=dict.fromkeys(nominal.plant.coordinates, BANDWIDTHS[0]))
    errors = [judge.compare(m, m, recordings, held_out=True)[0].completed for m in (wrong, trusted)]
    for name in nominal.plant.coordinates:
        assert errors[0][name] < errors[1][name]


def test_models_that_are_followed_together_have_the_states_of_each_alone(fresh_seed: int):
    model = nominal_model("wip").with_effects({"sensor_theta/scale": {"e": 0.02}, "actuator/gain": {"k": 1.0}})
    recordings = recorded("wip", {}, fresh_seed)
    smoother = Smoother(SIMULATOR, model.plant, recordings, sensor_noise(recordings, model.plant))
    windows = cut(recordings, model.plant, horizon=0.5, lead=0.1)
    one = [smoother.filtered(model, np.full(2, 10.0))]
    names, values = ("actuator/gain.k", "sensor_theta/scale.e"), np.array([[0.8, 0.0], [1.1, 0.03]])
    together = starts_by(smoother, windows, ModelBatch(model, names, values), one).states
    for p, each in enumerate(values):
        alone = starts_by(smoother, windows, ModelBatch(model, names, each[None]), one).states
        np.testing.assert_allclose(together[:, :, [p]], alone, rtol=1e-9, atol=1e-12)
    assert not np.allclose(together[:, :, 0], together[:, :, 1])


@pytest.mark.parametrize("kind", KINDS)
def test_states_that_lead_to_a_start_use_what_it_may_see_and_nothing_later(kind: str, fresh_seed: int):
    model, recording = nominal_model(kind), recorded(kind, {}, fresh_seed)[0]
    noise = sensor_noise((recording,), model.plant)
    bandwidth = np.full(len(noise), 10.0)

    def led(one: Recording):
        smoother = Smoother(SIMULATOR, model.plant, (one,), noise)
        windows = cut((one,), model.plant, horizon=0.5, lead=0.1)
        starts = starts_by(smoother, windows, ModelBatch(model), [smoother.filtered(model, bandwidth)])
        return windows, starts, smoother.along(model, bandwidth)[..., 0]

    windows, starts, along = led(recording)
    until = starts.until[0]
    begun = starts.states[until, :, 0, 0]
    np.testing.assert_allclose(begun, along[windows.row[0] + until], rtol=1e-9, atol=1e-12)
    seen = int(np.searchsorted(recording.t, windows.starts[0] + LOOK_AHEAD + 1e-6, side="right"))
    moved = {name: np.where(np.arange(len(recording)) < seen, x, 1.1 * x) for name, x in recording.columns.items()}
    later = led(replace(recording, columns=moved | {"t": recording.t}))[1]
    np.testing.assert_allclose(later.states[:, :, 0, 0], starts.states[:, :, 0, 0], rtol=1e-9, atol=1e-12)
    moved = {name: np.where(np.arange(len(recording)) < seen - 1, x, 1.1 * x) for name, x in recording.columns.items()}
    earlier = led(replace(recording, columns=moved | {"t": recording.t}))[1]
    assert not np.allclose(earlier.states[until - 5, :, 0, 0], starts.states[until - 5, :, 0, 0], rtol=1e-9, atol=1e-12)


def test_a_constant_acceleration_that_the_model_lacks_is_found(fresh_seed: int):
    force = 2.0
    recordings = recorded("linear_axis", {"actuator/offset": {"F_0": force}}, fresh_seed)
    nominal = nominal_model("linear_axis")
    smoother = Smoother(SIMULATOR, nominal.plant, recordings, sensor_noise(recordings, nominal.plant))
    missing = smoother.disturbance(nominal, np.array([10.0]))[:, 0]
    p = nominal.parameters
    mass = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    assert np.median(missing[200 : len(recordings[0])]) == pytest.approx(force / mass, rel=0.1)


SETTLED = 500  # rows, two seconds: what was not known of the start is forgotten
DRAWS = 4  # a filter remembers a third of a second; few seconds have few independent errors
NEGLIGIBLE = 0.05  # of the sensor noise, and of that a second: what is less is not judged


def error_over_claim(
    model: Model, draws: list[tuple[Recording, np.ndarray]], noise: np.ndarray, least: float = 0.0
) -> np.ndarray:
    """Typical error of smoothed states over the deviation that the filter claims, shape (2 joints,).

    Args:
        model: That made the recordings.
        draws: Recordings, each with the true states.
        noise: Of the sensors.
        least: Deviation below which a claim is not judged, in multiples of the noise (of rates, a second).
    """
    squares = []
    for recording, true in draws:
        smoother = Smoother(ENGINE, model.plant, (recording,), noise)
        rows = np.arange(SETTLED, len(recording) - 50, 5)
        bandwidth = np.full(len(noise), 3.0)
        places = smoother.places(rows, np.zeros_like(rows), rows)
        found = smoother.along(model, bandwidth)[rows, :, 0]
        claimed = np.sqrt(np.diagonal(smoother.filtered(model, bandwidth).spread(places), axis1=1, axis2=2))
        squares.append(np.mean(((found - true[rows]) / np.maximum(claimed, least * np.tile(noise, 2))) ** 2, axis=0))
    return np.sqrt(np.mean(squares, axis=0))


def test_states_of_an_arm_with_a_stiff_position_drive_err_as_the_filter_says(tmp_path: Path, fresh_seed: int):
    pytest.importorskip("mujoco")
    model, rng = stiff_arm(tmp_path), np.random.default_rng(fresh_seed)
    runs = [motion(model, rng, 4.0) for _ in range(DRAWS)]
    draws = [
        (recording, np.concatenate([run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0]], axis=1))
        for recording, run in runs
    ]
    assert np.all(error_over_claim(model, draws, NOISE, NEGLIGIBLE) < 1.6)


def test_states_behind_a_late_sensor_err_as_the_filter_says(fresh_seed: int):
    """Within the delay the joint turns round: its position now is not what it showed plus the delay times its rate."""
    late, rng, noise = 0.02, np.random.default_rng(fresh_seed), np.array([2e-5])
    model = nominal_model("linear_axis").with_effects({"sensor_x/delay": {"tau": late}})
    t = np.arange(0.0, 6.0, 0.004)
    draws = []
    for _ in range(DRAWS):
        force = 30.0 * np.sin(20.0 * t + rng.uniform(0.0, 6.0))
        inputs = Inputs.of([t], [force[:, None]], [0])
        run = SIMULATOR.replay(ModelBatch(model), inputs, np.zeros((2, 1, 1)))
        exact = SIMULATOR.replay(ModelBatch(nominal_model("linear_axis")), inputs, np.zeros((2, 1, 1)))
        x = run.coordinates[:, 0, 0, 0] + noise * rng.normal(size=len(t))
        true = np.stack([exact.coordinates[:, 0, 0, 0], exact.rates[:, 0, 0, 0]], axis=1)
        draws.append((Recording("late.csv", {"t": t, "x": x, "u": force}), true))
    assert np.all(error_over_claim(model, draws, noise) < 1.6)


def test_states_from_a_log_of_mean_commands_err_as_the_filter_says(fresh_seed: int):
    """Each row has the mean of four noisy commands: how they shook the robot within the row is not in the log."""
    model, rng, noise = nominal_model("linear_axis"), np.random.default_rng(fresh_seed), np.array([2e-6])
    t, kept = np.arange(0.0, 8.0, 0.002), slice(0, 4000, 4)
    draws = []
    for _ in range(DRAWS):
        force = 2.0 * np.sin(3.0 * t) + 20.0 * rng.normal(size=len(t))
        run = SIMULATOR.replay(ModelBatch(model), Inputs.of([t], [force[:, None]], [0]), np.zeros((2, 1, 1)))
        columns = {"t": t[kept], "x": run.coordinates[kept, 0, 0, 0] + noise * rng.normal(size=len(t[kept]))}
        recording = Recording("means.csv", {**columns, "u": force.reshape(-1, 4).mean(axis=1)}, periods=4)
        draws.append((recording, np.stack([run.coordinates[kept, 0, 0, 0], run.rates[kept, 0, 0, 0]], axis=1)))
    assert np.all(error_over_claim(model, draws, noise) < 1.6)
    blind = [(replace(recording, periods=1), true) for recording, true in draws]
    assert np.all(error_over_claim(model, blind, noise) > 3.0)
