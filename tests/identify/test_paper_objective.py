"""The paper's objective: closed-loop trajectories, means of classes, known loads."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from loaded_robot import (
    FEEDBACK,
    FRICTION,
    LOADS,
    NOISE,
    NOMINAL,
    OBJECTIVE,
    RATE,
    SIMULATOR,
    Releases,
    paper_robot,
    release,
)

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.objectives import FitData
from wipx.identify.parameter_space import parameter_space
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts, StateFeedback

TRUTH = paper_robot()


def at(problem: ClosedLoopProblem, model: Model) -> np.ndarray:
    """Position of a model in the unit cube, shape (D,)."""
    return problem.space.to_cube(np.array([model.value(name) for name in problem.space.names]))


@pytest.fixture(scope="module")
def releases() -> Releases:
    return release(TRUTH, np.random.default_rng(1), trials=3)


@pytest.fixture(scope="module")
def quiet() -> Releases:
    return release(TRUTH, np.random.default_rng(2), trials=2, noisy=False)


def test_the_true_model_with_its_loads_repeats_noiseless_trajectories(quiet: Releases):
    problem = quiet.problem()
    # Of the start only the mean of 10 ms is known, in which the robot has moved by up to 1e-5 rad.
    assert np.sqrt(problem.losses(at(problem, TRUTH))[0] / len(problem.rows)) < 2e-4
    errors = problem.trajectories(at(problem, TRUTH))[:, :, 0] - problem.target
    assert np.max(np.abs(errors)) < 2e-3


def test_without_its_loads_it_does_not(quiet: Releases):
    problem = quiet.problem()
    bare = replace(quiet, loads=(None,) * len(quiet.recordings)).problem()
    assert bare.losses(at(bare, TRUTH))[0] > 1e3 * problem.losses(at(problem, TRUTH))[0]


def test_trajectories_with_loads_are_those_of_each_robot_alone(releases: Releases):
    problem = releases.problem()
    cubes = np.stack([at(problem, TRUTH), problem.space.start])
    together = problem.trajectories(cubes)
    (trials,) = problem.trials
    values = problem.space.to_values(cubes)
    alone = np.zeros_like(together)
    for r, load in enumerate(releases.loads):
        robots = ModelBatch(load.on(problem.space.model), problem.space.names, values)
        start = np.repeat(trials.initial[:, None, r : r + 1], len(cubes), axis=1)
        run = problem.simulator.close_loop(robots, trials.inputs, start, FEEDBACK, trials.references)
        alone[..., trials.classes[r]] += run.coordinates[problem.rows, :, :, 0] * trials.weights[r].max()
    np.testing.assert_allclose(together, alone, atol=1e-12)


def test_loss_residuals_and_class_losses_agree(releases: Releases, fresh_seed: int):
    problem = releases.problem()
    cubes = problem.space.sample(3, np.random.default_rng(fresh_seed))
    losses = problem.losses(cubes)
    np.testing.assert_allclose(losses, [np.sum(problem.residuals(cube) ** 2) for cube in cubes])
    by_class = problem.class_losses(cubes)
    assert by_class.shape == (3, len(LOADS))
    assert problem.labels == tuple(f"load{i}" for i in range(len(LOADS)))
    np.testing.assert_allclose(by_class.mean(axis=1), losses)


def test_uneven_and_missing_rows_do_not_move_the_trajectories(quiet: Releases, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)

    def worn(recording: Recording) -> Recording:
        kept = rng.random(len(recording)) < 0.8
        kept[[0, -1]] = True
        return Recording(recording.name, {name: column[kept] for name, column in recording.columns.items()})

    problem = replace(quiet, recordings=tuple(worn(r) for r in quiet.recordings)).problem()
    # Straight lines over a few rows: 5 ms at 10 rad/s^2.
    np.testing.assert_allclose(problem.target, quiet.problem().target, atol=2e-4)


def test_a_start_from_rest_is_not_taken_for_a_moving_one(releases: Releases):
    moving = replace(OBJECTIVE, at_rest=False)
    scales = releases.problem()
    data = FitData(releases.recordings, NOMINAL, SIMULATOR, NOISE, scales.speeds, (FEEDBACK, RATE), releases.loads)
    wrong = moving.problem(data, scales.space)
    right = releases.problem()
    assert all(np.all(trials.initial[2:] == 0.0) for trials in right.trials)
    assert right.losses(at(right, TRUTH))[0] < 0.3 * wrong.losses(at(wrong, TRUTH))[0]


@pytest.mark.statistical(allowed=1e-3)
def test_the_noise_floor_is_what_the_true_model_is_left_with(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    shares = []
    for _ in range(5):
        truth = paper_robot(rng)
        problem = release(truth, rng).problem()
        shares.append(problem.losses(at(problem, truth))[0] / problem.noise_floor(at(problem, truth)))
    # Errors of the start last as long as a trajectory: eight classes are about as many independent numbers, so that
    # one share is off by 40 % and the mean of five by 20 %.
    assert 0.5 < np.mean(shares) < 2.0


def test_there_is_no_noise_floor_without_a_second_trial():
    assert np.isnan(release(TRUTH, np.random.default_rng(4), trials=1).problem().noise_floor())


@dataclass(frozen=True)
class OtherEngine:
    """An engine of which nothing but the closed loop is used."""

    smoothing: tuple[float, ...] = ()

    def close_loop(
        self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, feedback: StateFeedback, references: np.ndarray
    ) -> Rollouts:
        return SIMULATOR.close_loop(batch, inputs, initial, feedback, references)


def test_any_engine_that_closes_the_loop_will_do(releases: Releases):
    own = releases.problem()
    other = replace(own, simulator=OtherEngine())
    np.testing.assert_array_equal(other.losses(own.space.start), own.losses(own.space.start))


def test_classes_that_mix_loads_are_refused(releases: Releases):
    mixed = replace(releases, loads=(None, *releases.loads[1:]))
    with pytest.raises(
        InputError, match=r"^objective\.classes: the recordings of class load0 had different loads; [^\n]*$"
    ):
        mixed.problem()


def test_a_body_that_loads_change_cannot_be_free(releases: Releases):
    scales = releases.problem()
    model = NOMINAL.with_effects({name: dict(TRUTH.effects[name]) for name in FRICTION})
    space = parameter_space(model, (), {"body_inertia": 0.1}, {}, {}, {})
    data = FitData(releases.recordings, NOMINAL, SIMULATOR, NOISE, scales.speeds, (FEEDBACK, RATE), releases.loads)
    with pytest.raises(InputError, match=r"^body_inertia is free or uncertain, but known loads change it; [^\n]*$"):
        OBJECTIVE.problem(data, space)


def test_priors_pull_as_strongly_as_the_noise_allows(releases: Releases):
    """One standard deviation off costs as much as one sample that is off by the noise."""
    scales = releases.problem()
    space = parameter_space(NOMINAL.with_effects(TRUTH.effects), (), {"wheel_mass": 0.01}, {}, {}, {})
    data = FitData(releases.recordings, NOMINAL, SIMULATOR, NOISE, scales.speeds, (FEEDBACK, RATE), releases.loads)
    problem = OBJECTIVE.problem(data, space)
    off = space.to_cube(np.array([np.exp(0.01) * NOMINAL.parameters["wheel_mass"]]))
    prior = problem.losses(off)[0] - problem.class_losses(off).mean()
    assert prior == pytest.approx(np.mean(NOISE**2) / problem.target[0].size)
