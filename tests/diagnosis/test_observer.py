"""The observer is the Kalman filter of the robot: gains, innovations, and nothing added where it does nothing."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench
from identify.emulated_robot import nominal_model
from scipy.linalg import solve_discrete_are
from sim.robots import unit_axis

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.fitting import Fitter
from wipx.diagnosis.hypothesis import Hypothesis
from wipx.diagnosis.log import Log
from wipx.diagnosis.observer import NoiseLevels, linearise_along, observer_gains
from wipx.sim.analytic import Observer
from wipx.sim.inputs import Inputs

DT = 0.004  # [s]
LEVELS = NoiseLevels(np.array([0.02]), np.array([1e-4]))  # [N s^0.5, m]


def pushed_carriage(rng: np.random.Generator, rows: int = 3000) -> Bench:
    """A carriage of 1 kg, pushed by a command and by white forces that the log does not have."""
    t = DT * np.arange(rows)
    command = 0.3 * np.sin(3.0 * t)
    unknown = rng.normal(size=rows) * LEVELS.force[0] / np.sqrt(DT)
    inputs = Inputs.of([t], [(command + unknown)[:, None]], [0])
    model = unit_axis({})
    run = SIMULATOR.replay(ModelBatch(model), inputs, np.zeros((2, 1, 1)))
    x = run.coordinates[:, 0, 0, 0] + rng.normal(size=rows) * LEVELS.sensor[0]
    return Bench(model, (Recording("r1.csv", {"t": t, "x": x, "u": command}),), {})


def correlation(series: np.ndarray, lag: int) -> float:
    return float(np.mean(series[lag:] * series[:-lag]) / np.mean(series**2))


def test_innovations_of_the_true_model_are_white_and_of_unit_variance(fresh_seed: int):
    case = pushed_carriage(np.random.default_rng(fresh_seed))
    gains = case.fitter.follower.gains(LEVELS, case.nominal)
    shown = case.fitter.follower.innovations(ModelBatch(case.nominal), (gains,), np.zeros(1, int), np.zeros(1))
    series = shown[0, 0, 0, case.log.counted[:, 0]]
    n = len(series)
    assert np.mean(series**2) == pytest.approx(1.0, abs=4.5 * np.sqrt(2.0 / n))  # 4.5 standard deviations
    for lag in (1, 2, 5, 20):
        assert abs(correlation(series, lag)) < 4.5 / np.sqrt(n)


def test_innovations_of_a_wrong_model_are_not(fresh_seed: int):
    case = pushed_carriage(np.random.default_rng(fresh_seed))
    wrong = unit_axis({"translation/coulomb": {"F_c": 0.2}})
    gains = case.fitter.follower.gains(LEVELS, wrong)
    shown = case.fitter.follower.innovations(ModelBatch(wrong), (gains,), np.zeros(1, int), np.zeros(1))
    series = shown[0, 0, 0, case.log.counted[:, 0]]
    assert correlation(series, 1) > 10.0 / np.sqrt(len(series))


def test_noise_levels_come_back(fresh_seed: int):
    case = pushed_carriage(np.random.default_rng(fresh_seed))
    start = NoiseLevels(5.0 * LEVELS.force, LEVELS.sensor)
    fitter = Fitter(case.fitter.follower)
    levels = fitter.levels_of(fitter.fit(Hypothesis.of(case.setting, (), {}), start))
    # The search ends at steps of 0.375 of the logarithm, beyond which less than 0.3 nats are gained.
    assert np.log(levels.force[0] / LEVELS.force[0]) == pytest.approx(0.0, abs=0.4)


@pytest.mark.parametrize("kind", ["linear_axis", "wip"])
def test_gains_settle_at_the_solution_of_the_riccati_equation(kind: str):
    model = nominal_model(kind)
    joints = len(model.plant.joints)
    t = DT * np.arange(2000)
    still = {name: np.zeros(len(t)) for name in (*model.plant.coordinates, *model.plant.commands)}
    log = Log.of((Recording("still.csv", {"t": t, **still}),), model.plant)
    levels = NoiseLevels(np.array([0.05, 0.02])[:joints], np.array([1e-4, 3e-4])[:joints])
    linear = linearise_along(model, log)
    gains = observer_gains(linear, log, levels)
    a = np.block([[np.zeros((joints, joints)), np.eye(joints)], [linear.a[0]]])
    drive = np.zeros((2 * joints, 2 * joints))
    drive[joints:, joints:] = linear.b[0] @ np.diag(levels.force**2) @ linear.b[0].T
    transition, noise = discretised(a, drive)
    h = np.eye(joints, 2 * joints)
    sensor = np.diag(levels.sensor**2)
    p = solve_discrete_are(transition.T, h.T, noise, sensor)
    s = h @ p @ h.T + sensor
    # To third order in the interval, and variances are taken for constant once they change by 1e-5 a row.
    np.testing.assert_allclose(gains.gains[-1, 0, :, :joints], p @ h.T @ np.linalg.inv(s), rtol=0.01, atol=1e-4)
    factor = gains.whitening[-1, 0]
    np.testing.assert_allclose(factor @ s @ factor.T, np.eye(joints), atol=0.01)


def discretised(a: np.ndarray, drive: np.ndarray, steps: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """exp(A dt) and the covariance that white noise leaves within dt, by many small steps."""
    n, h = len(a), DT / steps
    small = np.eye(n) + h * a + 0.5 * h * h * a @ a
    transition, covariance = np.eye(n), np.zeros((n, n))
    for _ in range(steps):
        covariance = small @ (covariance + 0.5 * h * drive) @ small.T + 0.5 * h * drive
        transition = small @ transition
    return transition, covariance


@pytest.mark.parametrize("kind", ["wip", "pendulum", "double_pendulum"])
def test_following_without_gains_is_replaying(kind: str):
    case = bench(kind, {}, seed=2, duration=1.0)
    joints = len(case.nominal.plant.joints)
    batch = ModelBatch(case.nominal)
    rows, recordings = case.log.rows.shape
    start = np.full((2 * joints, 1, recordings), 0.01)
    idle = np.zeros((1, rows, recordings, 2 * joints, 2 * joints))
    observer = Observer(case.log.measured, idle, np.zeros(1, dtype=np.int64), np.zeros(1))
    followed = SIMULATOR.follow(batch, case.log.inputs, start, observer)
    replayed = SIMULATOR.replay(batch, case.log.inputs, start)
    np.testing.assert_array_equal(followed.coordinates, replayed.coordinates)
    np.testing.assert_array_equal(followed.rates, replayed.rates)


def test_full_gains_put_the_state_on_the_recording():
    case = bench("linear_axis", {}, seed=2, duration=1.0)
    rows, recordings = case.log.rows.shape
    follow_x = np.zeros((1, rows, recordings, 2, 2))
    follow_x[..., 0, 0] = 1.0
    observer = Observer(case.log.measured, follow_x, np.zeros(1, dtype=np.int64), np.zeros(1))
    start = np.zeros((2, 1, recordings))
    shown = SIMULATOR.follow(ModelBatch(case.nominal), case.log.inputs, start, observer)
    ahead = np.diff(shown.coordinates[:, 0, 0], axis=0)
    moved = shown.coordinates[1:, 0, 0] - case.log.measured[:-1, 0]
    rate = 0.5 * (shown.rates[1:, 0, 0] + shown.rates[:-1, 0, 0])
    np.testing.assert_allclose(moved, rate * np.diff(case.log.inputs.t, axis=0), atol=1e-9)
    assert not np.allclose(ahead, moved, atol=1e-9)


def test_a_recording_that_is_left_out_does_not_count():
    case = bench("linear_axis", {}, seed=2, duration=1.0)
    without = replace(case.log, left_out=1)
    assert without.counted[:, 0].any()
    assert not without.counted[:, 1].any()
