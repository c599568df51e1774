"""What every optimizer of conf/optimizer promises."""

import logging
import os
import pickle
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from emulated_robot import nominal_model

from wipx.app import configuration_folder
from wipx.config import build
from wipx.core.parameters import FreeParameter
from wipx.identify.optimizers.least_squares import LeastSquares
from wipx.identify.optimizers.pso import ParticleSwarm
from wipx.identify.optimizers.search import Log, Progress, unwatched
from wipx.identify.parameter_space import ParameterSpace

OPTIONS = sorted(path.stem for path in (configuration_folder() / "optimizer").glob("*.yaml"))
BEST = np.array([0.7, 0.2, 0.45])


@dataclass(frozen=True)
class CurvedValley:
    """Residuals with one minimum, at `BEST` with loss zero; some positions may have no loss."""

    hole: float = 0.0
    pause: float = 0.0
    calls: list[int] = field(default_factory=list, compare=False)
    lost: list[int] = field(default_factory=list, compare=False)
    valleys: int = 2
    differences: int = 2
    near: bool = False
    short: None = None

    @property
    def space(self) -> ParameterSpace:
        model = nominal_model("pendulum")
        names = ("body_mass", "com_height", "body_inertia")
        return ParameterSpace(model, tuple(FreeParameter(name, "1", 0.0, 1.0, 0.1, 0.05) for name in names))

    def smoothed(self, level: float) -> "CurvedValley":
        return self

    def losses(self, cube: np.ndarray) -> np.ndarray:
        self.calls.append(len(cube))
        time.sleep(self.pause)
        values = np.array([np.mean(self.residuals(row) ** 2) for row in cube])
        fallen = cube[:, 0] < self.hole
        self.lost.append(int(fallen.sum()))
        return np.where(fallen, [np.inf, np.nan][len(self.calls) % 2], values)

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        d = cube - BEST
        return np.array([d[0], 3.0 * d[1] + d[0] ** 2, 0.3 * d[2] + d[1], d[2] * d[0]])

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        steps = 1e-6 * np.eye(3)
        return np.array([(self.residuals(cube + s) - self.residuals(cube - s)) / 2e-6 for s in steps]).T


@pytest.fixture(params=OPTIONS)
def optimizer(request: pytest.FixtureRequest) -> LeastSquares | ParticleSwarm:
    path = configuration_folder() / "optimizer" / f"{request.param}.yaml"
    return build(yaml.safe_load(path.read_text()), "optimizer")


def test_the_minimum_is_found(optimizer):
    minimum = optimizer.minimise(CurvedValley(), np.random.default_rng(1))
    # A swarm with an inertia of 0.9 is still moving after 100 generations.
    np.testing.assert_allclose(minimum.cube, BEST, atol=0.15)
    assert minimum.loss == pytest.approx(np.mean(CurvedValley().residuals(minimum.cube) ** 2))
    assert minimum.loss < 3e-3
    assert minimum.failed == 0


def test_the_same_seed_gives_the_same_result(optimizer):
    first, second = (optimizer.minimise(CurvedValley(), np.random.default_rng(2)) for _ in range(2))
    np.testing.assert_array_equal(first.cube, second.cube)
    np.testing.assert_array_equal(first.history.best_loss, second.history.best_loss)


def test_the_best_loss_never_rises_and_effort_never_falls(optimizer, fresh_seed: int):
    shares: list[float] = []

    def watch(progress: Progress) -> None:
        shares.append(progress.share)

    history = optimizer.minimise(CurvedValley(), np.random.default_rng(fresh_seed), watch).history
    assert np.all(np.diff(shares) >= 0.0)
    assert 0.0 <= shares[0] <= shares[-1] <= 1.0 + 1e-9  # a sum of fractions
    assert np.all(np.diff(history.best_loss) <= 0.0)
    assert np.all(np.diff(history.evaluations) >= 0)
    assert np.all(np.diff(history.seconds) >= 0.0)
    assert len(history.best_loss) == len(history.evaluations) == len(history.seconds)


@pytest.mark.parametrize("budget", [1, 60, 120])
def test_the_budget_of_evaluations_ends_the_search(optimizer, budget: int):
    problem = CurvedValley()
    minimum = replace(optimizer, evaluations=budget).minimise(problem, np.random.default_rng(3))
    assert minimum.history.stopped in (f"budget of {budget} evaluations", "converged")
    assert minimum.history.evaluations[-1] < budget + 10  # slopes may be under way
    assert sum(problem.calls) <= budget + 2
    assert np.isfinite(minimum.loss)


def test_the_budget_of_time_ends_the_search(optimizer):
    began = time.monotonic()
    minimum = replace(optimizer, seconds=0.05).minimise(CurvedValley(pause=0.03), np.random.default_rng(4))
    assert minimum.history.stopped == "budget of 0.05 s"
    assert time.monotonic() - began < 5.0  # the first import of the swarm library takes its time


def test_a_watcher_sees_the_progress_and_can_cancel(optimizer):
    seen: list[tuple[int, float]] = []

    def cancel_late(progress: Progress) -> None:
        seen.append((progress.evaluations, progress.best_loss))
        if len(seen) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        optimizer.minimise(CurvedValley(), np.random.default_rng(5), cancel_late)
    assert len(seen) == 3
    assert seen[0][0] < seen[2][0]


def test_candidates_that_fell_over_are_counted_and_never_chosen(optimizer):
    problem = CurvedValley(hole=0.3)
    minimum = optimizer.minimise(problem, np.random.default_rng(6))
    assert minimum.cube[0] >= 0.3
    # SciPy's methods look at the model's own start too, which is no candidate of theirs.
    assert sum(problem.lost) > 0
    assert minimum.failed in (sum(problem.lost) - 1, sum(problem.lost))
    assert np.isfinite(minimum.loss)


def test_global_state_is_left_alone(optimizer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    np.random.seed(7)
    before, environment, level = np.random.get_state(), dict(os.environ), logging.getLogger().level
    optimizer.minimise(CurvedValley(), np.random.default_rng(7))
    np.testing.assert_equal(np.random.get_state(), before)
    assert logging.getLogger().level == level
    assert dict(os.environ) == environment
    assert list(tmp_path.iterdir()) == []


def test_global_state_is_left_alone_by_a_search_that_is_cancelled(optimizer):
    def cancel(progress: Progress) -> None:
        raise KeyboardInterrupt

    np.random.seed(8)
    before = np.random.get_state()
    with pytest.raises(KeyboardInterrupt):
        optimizer.minimise(CurvedValley(), np.random.default_rng(8), cancel)
    np.testing.assert_equal(np.random.get_state(), before)
    assert "LOG_CFG" not in os.environ


def test_it_pickles(optimizer):
    assert pickle.loads(pickle.dumps(optimizer)) == optimizer


def test_a_swarm_evaluates_every_particle_in_every_generation():
    problem = CurvedValley()
    minimum = ParticleSwarm(particles=8, iterations=5).minimise(problem, np.random.default_rng(9))
    assert problem.calls == [8] * 5
    assert minimum.history.stopped == "5 generations"


def test_least_squares_tries_as_many_starts_as_it_is_told():
    one = LeastSquares(starts=1, smoothing=(0.0,)).minimise(CurvedValley(), np.random.default_rng(10))
    four = LeastSquares(starts=4, smoothing=(0.0,)).minimise(CurvedValley(), np.random.default_rng(10))
    assert four.loss <= one.loss
    assert four.history.evaluations[-1] > 2 * one.history.evaluations[-1]


@dataclass(frozen=True)
class Bowl:
    """A smooth bowl in twelve dimensions, ten times as steep one way as another."""

    valleys: int = 1
    differences: int = 1
    near: bool = False
    short: None = None

    @property
    def space(self) -> ParameterSpace:
        names = (f"geometry/payload.p{i}" for i in range(12))
        return ParameterSpace(nominal_model("wip"), tuple(FreeParameter(n, "1", 0.0, 1.0, 0.1, 0.05) for n in names))

    def smoothed(self, level: float) -> "Bowl":
        return self

    def losses(self, cube: np.ndarray) -> np.ndarray:
        return np.mean(((cube - BOTTOM) @ STEEPNESS) ** 2, axis=1)

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        return STEEPNESS.T @ (cube - BOTTOM)

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        return STEEPNESS.T


BOTTOM = np.random.default_rng(0).uniform(0.2, 0.8, 12)
STEEPNESS = np.linalg.qr(np.random.default_rng(1).normal(size=(12, 12)))[0] * np.geomspace(0.1, 1.0, 12)
BUDGET = 6_000
# Share of the loss at the model's start that may be left. Populations without a model of the valley converge slowly
# along it, a swarm with an inertia of 0.9 is still moving, and a simplex shrinks slowly in twelve dimensions.
LEFT = {"ga": 0.1, "pso": 0.1, "nelder_mead": 0.1}


@pytest.mark.parametrize("name", OPTIONS)
def test_the_bottom_of_a_bowl_in_twelve_dimensions_is_found(name: str, fresh_seed: int):
    optimizer = build(yaml.safe_load((configuration_folder() / "optimizer" / f"{name}.yaml").read_text()), "optimizer")
    minimum = replace(optimizer, evaluations=BUDGET).minimise(Bowl(), np.random.default_rng(fresh_seed))
    assert minimum.loss < LEFT.get(name, 1e-4) * Bowl().losses(Bowl().space.start[None])[0]


def test_the_course_of_a_long_search_is_thinned():
    log = Log("test", 100_000, 1e9, unwatched)
    for i in range(50_000):
        log.add(np.zeros((1, 1)), np.array([1.0 / (1 + i)]))
    history = log.minimum("converged").history
    assert len(history.evaluations) <= 2000
    assert history.evaluations[-1] == 50_000
    assert history.best_loss[-1] == 1.0 / 50_000
    assert np.max(np.diff(history.evaluations)) <= 64
