"""What every objective of conf/objective promises."""

import re

import numpy as np
import pytest
import yaml
from emulated_robot import FAST, RATE, SIMULATOR, Robot, complete, controller, nominal_model, sensor_deviations

from wipx.app import configuration_folder
from wipx.config import build
from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.objectives import FitData, Objective, PaperTrajectories
from wipx.identify.parameter_space import parameter_space, scales_of

OPTIONS = sorted(path.stem for path in (configuration_folder() / "objective").glob("*.yaml"))
PENDULUM = nominal_model("pendulum")
HIDDEN = {"pitch/coulomb": {"F_c": 0.05}}
ROBOT = Robot(PENDULUM.with_effects(HIDDEN))


@pytest.fixture(scope="module")
def recordings() -> tuple[Recording, ...]:
    return ROBOT.record(np.random.default_rng(21))


@pytest.fixture(params=OPTIONS)
def objective(request: pytest.FixtureRequest) -> Objective:
    path = configuration_folder() / "objective" / f"{request.param}.yaml"
    return build(yaml.safe_load(path.read_text()), "objective")


def problem_of(objective: Objective, recordings: tuple[Recording, ...], *, closed: bool = True):
    model = ROBOT.model
    scales = scales_of(model, recordings)
    space = parameter_space(model, tuple(HIDDEN), {}, {}, {}, scales)
    feedback = (controller("pendulum"), RATE) if closed else None
    speeds = (scales["pitch"].velocity,)
    return objective.problem(
        FitData(recordings, PENDULUM, SIMULATOR, sensor_deviations(PENDULUM), speeds, feedback), space
    )


def test_a_known_parameter_is_found(objective: Objective, recordings: tuple[Recording, ...]):
    found = complete(PENDULUM, recordings, tuple(HIDDEN), objective=objective, optimizer=FAST)
    # The paper's objective sees 80 samples of three closed-loop runs, in which the noise feeds back.
    tolerance = 0.3 if isinstance(objective, PaperTrajectories) else 0.1
    assert found.estimates[0].value == pytest.approx(0.05, rel=tolerance)


def test_the_loss_is_lowest_near_the_truth(objective: Objective, recordings: tuple[Recording, ...]):
    problem = problem_of(objective, recordings)
    values = np.array([0.0, 0.025, 0.05, 0.1, 0.2])
    losses = problem.losses(problem.space.to_cube(values[:, None]))
    assert losses.shape == (5,)
    assert np.argmin(losses) == 2


def test_losses_and_residuals_agree(objective: Objective, recordings: tuple[Recording, ...]):
    problem = problem_of(objective, recordings)
    cube = problem.space.to_cube(np.array([0.08]))
    ratio = np.sum(problem.residuals(cube) ** 2) / problem.losses(cube)[0]
    again = problem.space.to_cube(np.array([0.12]))
    # The same mean up to where the estimates of the states stop (1e-3 of their own squares).
    assert np.sum(problem.residuals(again) ** 2) / problem.losses(again)[0] == pytest.approx(ratio, rel=0.01)


def test_slopes_are_those_of_the_residuals(objective: Objective, recordings: tuple[Recording, ...]):
    problem = problem_of(objective, recordings).smoothed(0.1)
    cube, step = problem.space.to_cube(np.array([0.08])), 2e-3
    slopes = problem.jacobian(cube, np.array([step]))[:, 0]
    change = (problem.residuals(cube + step) - problem.residuals(cube - step)) / (2.0 * step)
    assert np.corrcoef(slopes, change)[0, 1] > 0.98
    assert np.linalg.norm(slopes) == pytest.approx(np.linalg.norm(change), rel=0.1)


def test_a_candidate_that_falls_over_has_a_high_finite_loss(objective: Objective, recordings: tuple[Recording, ...]):
    problem = problem_of(objective, recordings)
    far = problem.losses(np.ones((1, 1)))[0]
    assert np.isfinite(far)
    assert far > 10.0 * problem.losses(problem.space.to_cube(np.array([[0.05]])))[0]


def test_it_describes_itself_in_one_line(objective: Objective):
    assert re.fullmatch(r"[^\n]{20,120}", objective.describe())


def test_the_paper_objective_needs_the_controller(recordings: tuple[Recording, ...]):
    with pytest.raises(InputError, match=r"^objective=paper .* add `controller` to robot\.yaml$"):
        problem_of(PaperTrajectories(), recordings, closed=False)


def test_the_paper_objective_refuses_a_recording_that_is_too_short(recordings: tuple[Recording, ...]):
    short = Recording("short.csv", dict(recordings[0].between(0.0, 1.0).columns), "folder/short.csv")
    with pytest.raises(InputError, match=r"folder/short\.csv: 0\.996 s long, expected 1\.185 s; leave it out"):
        problem_of(PaperTrajectories(), (short,))


def test_the_paper_objective_averages_recordings_of_a_class():
    same = ROBOT.record(np.random.default_rng(22), 2)
    twice = tuple(Recording(f"release_{i}.csv", dict(r.columns)) for i, r in enumerate(same))
    mean = mean_trajectories(PaperTrajectories(classes=r"(\w+)_\d"), twice)
    assert mean.shape == (80, 1, 1)
    alone = [mean_trajectories(PaperTrajectories(), (r,)) for r in twice]
    np.testing.assert_allclose(mean, np.mean(alone, axis=0))


def mean_trajectories(objective: PaperTrajectories, recordings: tuple[Recording, ...]) -> np.ndarray:
    problem = problem_of(objective, recordings)
    assert isinstance(problem, ClosedLoopProblem)
    return problem.target
