"""Classical estimators find the balance from physics: right without noise, calibrated with it, stops left out."""

import pickle
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from learn.network_robots import REGULATOR, SIMULATOR, WIP, rmse

from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.model import Model, ModelBatch
from wipx.learn.dataset import ObservationNoise, Watch, generate
from wipx.learn.estimator import Estimator, PitchEstimate, Recipe, Workshop
from wipx.learn.fall import Fall
from wipx.learn.least_squares import LeastSquares
from wipx.learn.loaded_body import LoadedBody
from wipx.learn.momentum_observer import MomentumObserver
from wipx.learn.observed import Viewing
from wipx.learn.training_set import PARTS, TrainingSet

JOINTS = {
    "translation/lagged_stribeck": {"F_s": 1.0, "F_c": 0.6, "v_s": 0.1, "sigma": 1.0, "epsilon": 0.005, "alpha": 0.7},
    "pitch/lagged_stribeck": {"F_s": 0.05, "F_c": 0.03, "v_s": 0.1, "sigma": 0.05, "epsilon": 0.005, "alpha": 0.7},
}
ROBOT = WIP.with_effects(JOINTS)  # the paper's joint model, Eq. 5
NOISE = ObservationNoise()  # the paper's, Eq. 6
QUIET = ObservationNoise(amplitude=0.0)
RECIPES: dict[str, Recipe] = {"least_squares": LeastSquares(), "momentum_observer": MomentumObserver(60, 4)}
RAIL = 1.8  # m


def made(seed: int, model: Model = ROBOT, noise: ObservationNoise = NOISE, rail: float = RAIL) -> TrainingSet:
    """400 robots, of which half are for training, and a quarter each for validation and test."""
    watch = Watch(samples=400, noise=noise, rail=rail)
    robots = generate(ModelBatch(model), REGULATOR, SIMULATOR, watch, np.random.default_rng(seed))
    parts = [PARTS.index(part) for part in ("train", "train", "validation", "test")]
    return replace(robots, part=np.tile(parts, 100))


def prepared(recipe: Recipe, training: TrainingSet, model: Model = ROBOT) -> Estimator:
    return recipe.prepare(Workshop(training, model, SIMULATOR, REGULATOR, 0, Path()), lambda stage, share: None)


def coverage(estimate: PitchEstimate, pitch: np.ndarray) -> float:
    return float(np.mean((estimate.low <= pitch) & (pitch <= estimate.high)))


def regression(training: TrainingSet) -> np.ndarray:
    """Errors on the test part of a linear regression on all samples of the training part."""
    train, test = training.of("train"), training.of("test")
    seen, new = (np.c_[part.windows.reshape(len(part.pitch), -1), np.ones(len(part.pitch))] for part in (train, test))
    return new @ np.linalg.lstsq(seen, train.pitch, rcond=None)[0] - test.pitch


@pytest.fixture(scope="module")
def training() -> TrainingSet:
    return made(seed=21)


@pytest.fixture(scope="module")
def ready(training: TrainingSet) -> dict[str, Estimator]:
    return {name: prepared(recipe, training) for name, recipe in RECIPES.items()}


def test_least_squares_without_noise_is_right_to_a_milliradian():
    quiet = made(seed=22, noise=QUIET)
    test = quiet.of("test")
    errors = np.abs(prepared(LeastSquares(), quiet).estimate(test.windows).pitch - test.pitch)
    # The paper's friction sets in with a jump: a robot that hardly moves gives a fit no slope to follow.
    assert np.median(errors) < 1e-6
    assert np.quantile(errors, 0.98) < 1e-3


def test_least_squares_finds_all_that_a_quiet_window_tells():
    smooth = WIP.with_effects({"translation/viscous": {"sigma": 2.0}, "pitch/viscous": {"sigma": 0.05}})
    quiet = made(seed=23, noise=QUIET, model=smooth)
    test = quiet.of("test")
    estimator = LeastSquares().prepare(Workshop(quiet, smooth, SIMULATOR, REGULATOR, 0, Path()), lambda *_: None)
    numbers = estimator.fitted(test.windows)
    assert np.abs(numbers[:, 0] - test.pitch).max() < 1e-4
    sideways = np.abs(test.pitch) > 0.05  # a load on the axis has hardly an effect that tells its mass
    masses = estimator.fall.loads(numbers)[sideways, 0]
    np.testing.assert_allclose(masses, test.loads[sideways, 0], atol=0.02)  # kg; of float32 windows


@pytest.mark.slow
@pytest.mark.parametrize("name", RECIPES)
@pytest.mark.parametrize("length", [40, 80])
def test_physics_beats_a_regression_on_few_robots(name: str, length: int, training: TrainingSet, ready):
    seen = training.first(length)
    estimator = ready[name] if length == 80 else prepared(RECIPES[name], seen)
    test = seen.of("test")
    # 200 robots teach a regression on 80 or 160 numbers little; with 1200 it comes close.
    assert rmse(estimator.estimate(test.windows).pitch - test.pitch) < 0.8 * rmse(regression(seen))


@pytest.mark.parametrize("name", RECIPES)
def test_estimates_under_the_papers_noise_are_right_to_some_milliradians(name: str, training: TrainingSet, ready):
    test = training.of("test")
    # 5 mrad on 80 samples; the fit leaves about 0.8 mrad, the filter 1 mrad.
    assert rmse(ready[name].estimate(test.windows).pitch - test.pitch) < 1.5e-3


@pytest.mark.statistical(allowed=0.005)
@pytest.mark.parametrize("name", RECIPES)
def test_nine_of_ten_fresh_robots_lie_in_their_intervals(name: str, ready, fresh_seed: int):
    fresh = made(seed=fresh_seed)
    # Calibrated on 100 robots and counted on 400: standard deviation sqrt(0.09 / 100 + 0.09 / 400) = 0.034.
    assert coverage(ready[name].estimate(fresh.windows), fresh.pitch) == pytest.approx(0.9, abs=0.1)


@pytest.mark.parametrize("name", RECIPES)
def test_what_follows_a_stop_changes_nothing(name: str, training: TrainingSet, ready):
    moving = Viewing.of(training).moving(training.windows)
    stopped = training.windows[~moving[:, -1]].astype(float)
    assert len(stopped) > 10
    other = stopped.copy()
    other[~moving[~moving[:, -1]]] = [0.3, 0.1]
    np.testing.assert_array_equal(ready[name].estimate(other).pitch, ready[name].estimate(stopped).pitch)


def test_no_sample_of_a_stopped_robot_counts_and_few_others_are_lost():
    short, long = (made(seed=25, noise=QUIET, rail=rail) for rail in (0.5, 50.0))
    held = np.any(short.windows != long.windows, axis=2)  # from the first sample that was not shown
    moving = Viewing.of(short).moving(short.windows)
    fallen = np.any(np.abs(long.windows[:, :, 1]) >= 1.0, axis=1)
    assert np.any(held)
    assert not np.any(moving & held)
    lost = np.sum(~moving & ~held, axis=1)
    assert lost[~fallen].max() <= 3


@pytest.mark.parametrize("name", RECIPES)
def test_a_mirrored_robot_balances_at_the_mirrored_pitch(name: str, training: TrainingSet, ready):
    windows = training.of("test").windows[:40]
    pitch, mirrored = (ready[name].estimate(sign * windows).pitch for sign in (1.0, -1.0))
    # Loads of a training set are not quite symmetric, which prior and line show.
    np.testing.assert_allclose(mirrored, -pitch, atol=1e-3)


@pytest.mark.parametrize("name", RECIPES)
def test_many_windows_at_once_are_as_one_by_one(name: str, training: TrainingSet, ready):
    windows = training.of("test").windows[:5]
    alone = np.concatenate([ready[name].estimate(window[None]).pitch for window in windows])
    np.testing.assert_allclose(ready[name].estimate(windows).pitch, alone, atol=1e-5)  # where fits count as settled


@pytest.mark.parametrize("name", RECIPES)
def test_an_estimator_travels_to_other_processes(name: str, training: TrainingSet, ready):
    windows = training.of("test").windows[:3]
    copy = pickle.loads(pickle.dumps(ready[name]))
    assert (copy.length, copy.period) == (80, 0.015)
    np.testing.assert_array_equal(copy.estimate(windows).low, ready[name].estimate(windows).low)


@pytest.mark.parametrize("name", RECIPES)
def test_windows_that_cannot_be_read_get_one_line(name: str, ready):
    with pytest.raises(InputError, match=r"windows of shape \(1, 40, 2\), expected \(N, 80, 2\)"):
        ready[name].estimate(np.zeros((1, 40, 2)))
    gap = np.zeros((2, 80, 2))
    gap[1, 7, 1] = np.nan
    with pytest.raises(InputError, match="theta of window 1, sample 7 is nan, expected a finite number"):
        ready[name].estimate(gap)


@pytest.mark.parametrize("name", RECIPES)
def test_a_window_that_no_robot_shows_gets_a_finite_answer(name: str, ready):
    rng = np.random.default_rng(26)
    wild = 0.3 * rng.normal(size=(20, 80, 2))
    still = np.full((1, 80, 2), [1.0, 0.5])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(ready[name].estimate(np.concatenate([wild, still])).pitch).all()


@pytest.mark.parametrize("name", RECIPES)
def test_a_training_set_that_does_not_suffice_gets_one_line(name: str, training: TrainingSet):
    with pytest.raises(InputError, match=r"no rail \[m\]"):
        prepared(RECIPES[name], replace(training, card={}))
    with pytest.raises(InputError, match="0 robots to learn from"):
        prepared(RECIPES[name], training.of("validation"))
    with pytest.raises(InputError, match="calibrate the 90 % interval"):
        prepared(RECIPES[name], training.of("train"))


def test_the_observers_body_moves_as_the_simulators():
    """Bare robots that carry loads at the typical place fall alike; only the integrators differ."""
    loads = np.array([[0.6, 0.45, 0.0], [1.8, 0.45, 0.0]])
    body = LoadedBody.of(WIP, loads, REGULATOR[0])
    viewing = Viewing(20, 0.015, (RAIL, 1.0), (1e-3, 1e-3))
    fall = Fall(WIP, SIMULATOR, *REGULATOR, viewing)
    numbers = np.array([[0.0, mass, 0.45, 0.0, 0.02] for mass in loads[:, 0]])
    states = np.zeros((6, 2))
    states[1], states[5] = 0.02, loads[:, 0]
    for seen in np.moveaxis(fall.seen(numbers), 1, 0):
        # The controller's command is held for 1.5 ms there, and is continuous here.
        np.testing.assert_allclose(states[:2].T, seen, atol=5e-4)
        states = body.moved(states, viewing.period)


def test_numbers_and_loads_are_two_names_of_one_robot():
    fall = Fall(WIP, SIMULATOR, *REGULATOR, Viewing(2, 0.015, (RAIL, 1.0), (1e-3, 1e-3)))
    loads = np.array([[0.5, 0.4, 0.2], [1.5, 0.6, -0.3]])
    numbers = fall.numbers(loads)
    np.testing.assert_allclose(fall.loads(numbers), loads, rtol=1e-12)
    assert numbers[:, 0] == pytest.approx([Load(*load).equilibrium(WIP) for load in loads.tolist()], rel=1e-12)
