"""The observer is the Kalman filter of the robot: gains, innovations, and nothing added where it does nothing."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, recorded
from identify.emulated_robot import nominal_model
from scipy.linalg import solve_discrete_are
from sim.robots import unit_axis

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import _report_errors
from wipx.diagnosis.likelihood.observer import BEFORE, DIFFUSE, UNSETTLED, Gains, NoiseLevels, observer_gains
from wipx.diagnosis.likelihood.recording_batch import SETTLES, RecordingBatch
from wipx.identify.linearisation import Linearisation, linearise_along, transition_over
from wipx.sim.analytic import Observer
from wipx.sim.cache import AHEAD
from wipx.sim.inputs import Inputs

DT = 0.004  # [s]
LEVELS = NoiseLevels(np.array([0.02]), np.array([1e-4]))  # [N s^0.5, m]
FOLLOW = """
import sys
from diagnosis.recorded import bench
from wipx.diagnosis.residuals.residual_tests import residual_tests, shapes_of
case = bench(sys.argv[1], {}, 0, duration=0.2)
fit = case.fit()
residual_tests(case.fitter, fit, shapes_of(case.fitter, fit))
print(fit.white.tobytes().hex())
"""


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
    gains = case.fitter.innovations_model.gains(LEVELS, case.nominal)
    shown = case.fitter.innovations_model.innovations(ModelBatch(case.nominal), (gains,), np.zeros(1, int))
    series = shown[0, 0, 0, case.data.counted[:, 0]]
    n = len(series)
    assert np.mean(series**2) == pytest.approx(1.0, abs=4.5 * np.sqrt(2.0 / n))  # 4.5 standard deviations
    for lag in (1, 2, 5, 20):
        assert abs(correlation(series, lag)) < 4.5 / np.sqrt(n)


def test_innovations_of_a_wrong_model_are_not(fresh_seed: int):
    case = pushed_carriage(np.random.default_rng(fresh_seed))
    wrong = unit_axis({"translation/coulomb": {"F_c": 0.2}})
    gains = case.fitter.innovations_model.gains(LEVELS, wrong)
    shown = case.fitter.innovations_model.innovations(ModelBatch(wrong), (gains,), np.zeros(1, int))
    series = shown[0, 0, 0, case.data.counted[:, 0]]
    assert correlation(series, 1) > 10.0 / np.sqrt(len(series))


def test_innovations_after_missing_rows_are_no_larger_than_others(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = DT * np.arange(3000)
    command = 5.0 * np.sin(3.0 * t) + rng.normal(size=len(t))
    model = unit_axis({})
    run = SIMULATOR.replay(ModelBatch(model), Inputs.of([t], [command[:, None]], [0]), np.zeros((2, 1, 1)))
    x = run.coordinates[:, 0, 0, 0] + 1e-6 * rng.normal(size=len(t))
    kept = np.flatnonzero((np.arange(len(t)) % 40 > 0) | (np.arange(len(t)) == 0))
    recording = Recording("r1.csv", {"t": t[kept], "x": x[kept], "u": command[kept]})
    case = Bench(model, (recording,), {})
    levels = NoiseLevels(np.array([1e-3]), np.array([1e-6]))
    gains = case.fitter.innovations_model.gains(levels, model)
    shown = case.fitter.innovations_model.innovations(ModelBatch(model), (gains,), np.zeros(1, int))
    behind = np.flatnonzero(recording.missing) + 1
    for later in range(3):
        assert np.mean(shown[0, 0, 0, behind[1:-1] + later] ** 2) < 2.0


def test_reports_after_missing_rows_do_not_count(fresh_seed: int):
    """They answer to commands that are not in the log."""
    rng = np.random.default_rng(fresh_seed)
    t = DT * np.arange(2000)
    command = rng.normal(size=len(t))
    model = unit_axis({})
    run = SIMULATOR.replay(ModelBatch(model), Inputs.of([t], [command[:, None]], [0]), np.zeros((2, 1, 1)))
    late = np.concatenate([[0.0], command[:-1]]) + 0.01 * rng.normal(size=len(t))
    columns = {
        "t": t,
        "x": run.coordinates[:, 0, 0, 0] + 1e-6 * rng.normal(size=len(t)),
        "u": command,
        "u_measured": late,
    }
    kept = np.arange(len(t)) % 40 != 20
    recording = Recording("r1.csv", {name: values[kept] for name, values in columns.items()})
    case = Bench(model, (recording,), {})
    follower = case.fitter.innovations_model
    gains = follower.gains(NoiseLevels(np.array([1e-3]), np.array([1e-6])), model)
    reports = follower.innovations(ModelBatch(model), (gains,), np.zeros(1, int))[0, 0, 1]
    after = np.flatnonzero(recording.missing)[:, None] + 1 + np.arange(3)
    assert np.any(reports)
    assert not np.any(reports[after])
    (ahead,) = ([types] for kernel, types in AHEAD if kernel is _report_errors)
    assert _report_errors.signatures == ahead
    assert np.abs(reports[:-1]).max() < 10.0 * np.median(np.abs(reports[:-1]))


def test_noise_levels_come_back(fresh_seed: int):
    case = pushed_carriage(np.random.default_rng(fresh_seed))
    start = NoiseLevels(5.0 * LEVELS.force, LEVELS.sensor)
    fitter = InnovationFitter(case.fitter.innovations_model)
    levels = fitter.levels_of(fitter.fit(Hypothesis.of(case.setting, (), {}), start))
    # Recordings of this length tell the logarithm within a standard deviation of 0.14; the search ends within 0.2.
    assert np.log(levels.force[0] / LEVELS.force[0]) == pytest.approx(0.0, abs=0.2 + 4.5 * 0.14)


def followed(kind: str, **environment: str) -> str:
    """White innovations of a robot, in digits, by a process of its own."""
    search = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    command = [sys.executable, "-c", FOLLOW, kind]
    variables = {**os.environ, **environment, "PYTHONPATH": search}
    ended = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pendulum", pytest.param("double_pendulum", marks=pytest.mark.slow)])
def test_loops_stay_within_their_arrays(kind: str):
    """Compiled code does not check its indices; the same code does when it is not compiled."""
    assert followed(kind, NUMBA_DISABLE_JIT="1")


@pytest.mark.slow
def test_the_run_that_compiles_says_the_same_as_those_after_it(tmp_path: Path):
    folder = str(tmp_path)
    compiling, later = (followed("wip", XDG_CACHE_HOME=folder, NUMBA_CACHE_DIR=folder) for _ in range(2))
    assert compiling == later


@pytest.mark.parametrize("kind", ["linear_axis", "wip"])
def test_gains_settle_at_the_solution_of_the_riccati_equation(kind: str):
    model = nominal_model(kind)
    joints = len(model.plant.joints)
    t = DT * np.arange(2000)
    still = {name: np.zeros(len(t)) for name in (*model.plant.coordinates, *model.plant.commands)}
    data = RecordingBatch.of((Recording("still.csv", {"t": t, **still}),), model.plant)
    levels = NoiseLevels(np.array([0.05, 0.02])[:joints], np.array([1e-4, 3e-4])[:joints])
    linear = linearise_along(model, data.inputs, data.measured[:, : data.joints])
    (gains,) = observer_gains(linear, unmoved(data), data, (levels,))
    a = np.block([[np.zeros((joints, joints)), np.eye(joints)], [linear.a[0]]])
    drive = np.zeros((2 * joints, 2 * joints))
    drive[joints:, joints:] = linear.b[0] @ np.diag(levels.force**2) @ linear.b[0].T
    transition, noise = discretised(a, drive)
    h = np.eye(joints, 2 * joints)
    sensor = np.diag(levels.sensor**2)
    p = solve_discrete_are(transition.T, h.T, noise, sensor)
    s = h @ p @ h.T + sensor
    # To third order in the interval.
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


@pytest.mark.parametrize("kind", ["wip", "cartpole"])
def test_a_late_noisy_sensor_beside_a_precise_one_is_followed_from_the_first_row(kind: str, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    late, noise = 0.014, 3e-3  # [s], [rad]
    exact = recorded(kind, {"sensor_theta/delay": {"tau": late}}, fresh_seed)
    noisy = [{**r.columns, "theta": r["theta"] + noise * rng.normal(size=len(r))} for r in exact]
    recordings = tuple(Recording(r.name, columns, r.source) for r, columns in zip(exact, noisy, strict=True))
    case = Bench(nominal_model(kind), recordings, {})
    base = case.fit()
    likelihoods = [base.log_likelihood]
    for tau in (0.5 * late, late):
        hypothesis = Hypothesis.of(case.setting, ("sensor_theta/delay",), {"sensor_theta/delay.tau": tau})
        likelihoods.append(case.fitter.fit(hypothesis, base.levels, steps=0).log_likelihood)
    # What the sensor has not shown yet must not be read off the first errors of the other one.
    assert np.all(np.diff(likelihoods) > 10.0)


def uneven_log(kind: str, rng: np.random.Generator) -> RecordingBatch:
    """Recordings of different lengths with jitter and gaps, of which only times and places matter."""
    plant = nominal_model(kind).plant
    names = (*plant.coordinates, *plant.rates[-1:], *plant.commands)
    recordings = []
    for rows in (90, 140):
        t = np.cumsum(rng.choice((DT, 1.2 * DT, 5.0 * DT), rows, p=(0.6, 0.3, 0.1)))
        columns = {name: rng.normal(size=rows).cumsum() * 0.03 for name in names}
        recordings.append(Recording(f"r{rows}.csv", {"t": t, **columns}))
    return RecordingBatch.of(tuple(recordings), plant)


@pytest.mark.parametrize("kind", ["linear_axis", "wip", "double_pendulum"])
@pytest.mark.parametrize("late", [0.0, 0.02])
def test_gains_of_many_levels_are_those_of_a_plain_kalman_filter(kind: str, late: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    data = uneven_log(kind, rng)
    linear = linearise_along(nominal_model(kind), data.inputs, data.measured[:, : data.joints])
    delays = (late,) * data.joints
    sizes = np.exp(rng.uniform(-7.0, -3.0, (3, data.joints + len(data.channels))))
    levels = [NoiseLevels(size[: data.joints], size[data.joints :]) for size in sizes]
    roots = rng.normal(size=unmoved(data).shape) * 1e-3
    jolts = roots @ np.swapaxes(roots, 2, 3)
    for level, found in zip(levels, observer_gains(linear, jolts, data, levels, delays), strict=True):
        for r in range(2):
            plain = plain_filter(linear, jolts[:, r], data, level, np.array(delays), r)
            last = int(data.inputs.last[r]) + 1
            # A first state known 1e4 times worse than the sensors costs more than half of the digits.
            scale = np.abs(plain.gains).max()
            np.testing.assert_allclose(found.gains[:last, r], plain.gains, atol=2e-4 * scale)
            np.testing.assert_allclose(
                found.whitening[:last, r] / plain.whitening.max(), plain.whitening / plain.whitening.max(), atol=2e-4
            )
            assert not found.gains[last:, r].any()


def unmoved(data: RecordingBatch) -> np.ndarray:
    """The covariance by which the body moves unseen within each row where every command is in the log."""
    return np.zeros((*data.rows.shape, 2 * data.joints, 2 * data.joints))


def plain_filter(
    linear: Linearisation, jolts: np.ndarray, data: RecordingBatch, levels: NoiseLevels, late: np.ndarray, r: int
) -> Gains:
    """The recursion in matrices, one row of one recording at a time."""
    joints, t = data.joints, data.inputs.t[:, r] - data.inputs.t[0, r]
    h = np.eye(2 * joints)[data.channels]
    for c, channel in enumerate(data.channels):
        if channel < joints:
            h[c, channel + joints] = -late[channel]
    variance = levels.sensor**2
    first = 9.0 * np.diag(np.concatenate([variance[:joints], variance[:joints] / 0.02**2]))
    p, transition, gains, whitening = DIFFUSE * first, np.zeros_like(first), [], []
    for k in range(int(data.inputs.last[r]) + 1):
        if k > 0 and t[k - 1] <= SETTLES < t[k]:
            p = first
        unseen = [0.0 if c >= joints else max(late[c] - t[k], 0.0) for c in data.channels]
        heard = variance + (BEFORE * np.array(unseen)) ** 2
        s = h @ p @ h.T + np.diag(heard)
        gain = p @ h.T @ np.linalg.inv(s)
        gains.append(np.zeros((2 * joints, data.seen)))
        gains[-1][:, data.channels] = gain
        whitening.append(np.linalg.inv(np.linalg.cholesky(s)))
        dt = float(data.intervals[k, r]) if k < data.inputs.last[r] else 0.0
        place = linear.place[k, r]
        transition_over(linear.a[place], dt, transition, np.zeros((2 * joints, joints)), np.zeros_like(transition))
        drive = linear.b[place] @ np.diag(levels.force**2) @ linear.b[place].T
        drive = drive if t[k] > SETTLES else UNSETTLED * drive
        held = np.block([[dt**3 / 3.0 * drive, dt**2 / 2.0 * drive], [dt**2 / 2.0 * drive, dt * drive]])
        p = transition @ (p - gain @ s @ gain.T) @ transition.T + held
        p += jolts[k]
    return Gains(np.array(gains), np.array(whitening))


@pytest.mark.parametrize("kind", ["wip", "pendulum", "double_pendulum"])
def test_following_without_gains_is_replaying(kind: str):
    case = bench(kind, {}, seed=2, duration=1.0)
    joints = len(case.nominal.plant.joints)
    batch = ModelBatch(case.nominal)
    rows, recordings = case.data.rows.shape
    start = np.full((2 * joints, 1, recordings), 0.01)
    idle = np.zeros((1, rows, recordings, 2 * joints, 2 * joints))
    observer = Observer(case.data.measured, idle, np.zeros(1, dtype=np.int64))
    followed = SIMULATOR.follow(batch, case.data.inputs, start, observer)
    replayed = SIMULATOR.replay(batch, case.data.inputs, start)
    np.testing.assert_array_equal(followed.coordinates, replayed.coordinates)
    np.testing.assert_array_equal(followed.rates, replayed.rates)


def test_full_gains_put_the_state_on_the_recording():
    case = bench("linear_axis", {}, seed=2, duration=1.0)
    rows, recordings = case.data.rows.shape
    follow_x = np.zeros((1, rows, recordings, 2, 2))
    follow_x[..., 0, 0] = 1.0
    observer = Observer(case.data.measured, follow_x, np.zeros(1, dtype=np.int64))
    start = np.zeros((2, 1, recordings))
    shown = SIMULATOR.follow(ModelBatch(case.nominal), case.data.inputs, start, observer)
    ahead = np.diff(shown.coordinates[:, 0, 0], axis=0)
    moved = shown.coordinates[1:, 0, 0] - case.data.measured[:-1, 0]
    rate = 0.5 * (shown.rates[1:, 0, 0] + shown.rates[:-1, 0, 0])
    np.testing.assert_allclose(moved, rate * np.diff(case.data.inputs.t, axis=0), atol=1e-9)
    assert not np.allclose(ahead, moved, atol=1e-9)


def test_a_recording_that_is_left_out_does_not_count():
    case = bench("linear_axis", {}, seed=2, duration=1.0)
    without = replace(case.data, left_out=(1,))
    assert without.counted[:, 0].any()
    assert not without.counted[:, 1].any()
