"""Objectives: what "agrees with the recordings" means."""

import re
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from wipx.core.errors import InputError, check_positive
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.identify.closed_loop import ClosedLoopProblem, Sampling, closed_loop_problem
from wipx.identify.parameter_space import ParameterSpace
from wipx.identify.prediction import Predictor
from wipx.identify.problem import WindowProblem
from wipx.identify.windows import Windows, cut
from wipx.sim.simulator import Simulator, StateFeedback

SHORT = 0.1  # [s] of the windows with which a search begins
FEWEST_ROWS = 8  # that they have


@dataclass(frozen=True)
class FitData:
    """What an objective judges a model by.

    Attributes:
        recordings: Recordings to fit.
        model: The nominal model.
        simulator: The engine.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        speeds: What each joint reaches, shape (joints,) [m/s or rad/s].
        feedback: The controller that closed the loop, and its rate [Hz]; None if unknown.
        loads: Known load on the body in each recording; empty where there was none in any.
        classes: Class of each recording; empty where the objective tells them apart.
    """

    recordings: tuple[Recording, ...]
    model: Model
    simulator: Simulator
    noise: np.ndarray
    speeds: tuple[float, ...]
    feedback: tuple[StateFeedback, float] | None
    loads: tuple[Load | None, ...] = ()
    classes: tuple[str, ...] = ()


class Objective(Protocol):
    """A way to judge candidate models."""

    def problem(self, data: FitData, space: ParameterSpace) -> WindowProblem | ClosedLoopProblem:
        """The loss over a parameter space."""
        ...

    def describe(self) -> str:
        """What is minimised, in words."""
        ...


@dataclass(frozen=True)
class Windowed:
    """The contract's prediction error: from states smoothed up to 0.05 s after a window's start.

    Attributes:
        horizon: Length of a prediction [s].
        lead: Time before a window's start from which its state is estimated [s].
    """

    horizon: float = 0.5
    lead: float = 0.3

    def __post_init__(self) -> None:
        check_positive(horizon=self.horizon, lead=self.lead)

    def problem(self, data: FitData, space: ParameterSpace) -> WindowProblem:
        """Errors of all windows of the recordings."""
        windows = cut(data.recordings, data.model.plant, horizon=self.horizon, lead=self.lead)
        return _window_problem(data, space, windows, self.horizon)

    def describe(self) -> str:
        """What is minimised, in words."""
        return f"error of {self.horizon:g} s predictions, each from a state smoothed over the {self.lead:g} s before it"


@dataclass(frozen=True)
class MultiStep:
    """Multiple shooting: the state at each window's start is the one that fits the window best.

    What remains is sensor noise if the model is right; the most efficient of the objectives
    (Bock 1981; Ribeiro et al. 2020, Automatica 121).

    Attributes:
        horizon: Length of a window [s].
    """

    horizon: float = 0.5

    def __post_init__(self) -> None:
        check_positive(horizon=self.horizon)

    def problem(self, data: FitData, space: ParameterSpace) -> WindowProblem:
        """Errors of all windows of the recordings."""
        windows = cut(data.recordings, data.model.plant, horizon=self.horizon, lead=0.0, shooting=True)
        return _window_problem(data, space, windows, self.horizon)

    def describe(self) -> str:
        """What is minimised, in words."""
        return f"error over windows of {self.horizon:g} s, each from the state that fits it best (multiple shooting)"


def _window_problem(data: FitData, space: ParameterSpace, windows: Windows, horizon: float) -> WindowProblem:
    """Errors of windows, with the problem of shorter ones that leads to its minimum.

    A wrong model's prediction of half a second may be anywhere; its error after a tenth is nearly linear in what is
    wrong with it.
    """
    problem = WindowProblem(space, Predictor(data.simulator, windows, data.noise), data.speeds)
    interval = max(float(np.median(np.diff(recording.t))) for recording in data.recordings)
    length = max(SHORT, FEWEST_ROWS * interval)
    if 2.0 * length > horizon:
        return problem
    short = cut(data.recordings, data.model.plant, horizon=length, lead=0.0, shooting=True)
    return replace(problem, short=replace(problem, predictor=replace(problem.predictor, windows=short)))


@dataclass(frozen=True)
class PaperTrajectories:
    """The paper's Eq. 7: closed-loop trajectories from the recorded start, mean of each class.

    Attributes:
        samples: Samples of a trajectory L (paper: 80).
        period: Time between them [s] (paper: 80 samples in about 1.2 s).
        classes: Regular expression whose first group, searched in a recording's name, is its
            class; recordings of one class are averaged. Empty: each recording is a class.
        at_rest: Whether the robot was released from rest at a recording's first row. The simulation then
            starts at rest too; rates read off the first rows would be those of a robot that falls already.
    """

    samples: int = 80
    period: float = 0.015
    classes: str = ""
    at_rest: bool = False

    def __post_init__(self) -> None:
        check_positive(samples=self.samples, period=self.period)

    def problem(self, data: FitData, space: ParameterSpace) -> ClosedLoopProblem:
        """Errors of the mean trajectories.

        Raises:
            InputError: the controller is unknown, a recording is too short, or the loads do not fit the classes
                or the free numbers.
        """
        if data.feedback is None:
            raise InputError(
                "objective=paper closes the loop and needs the robot's controller: add `controller` to robot.yaml"
            )
        feedback, rate = data.feedback
        return closed_loop_problem(
            data.recordings,
            data.classes or [self._class_of(r.name) for r in data.recordings],
            data.loads or [None] * len(data.recordings),
            space,
            data.simulator,
            feedback,
            Sampling(np.arange(self.samples) * self.period, rate, self.at_rest),
            noise=data.noise,
            speeds=data.speeds,
        )

    def describe(self) -> str:
        """What is minimised, in words."""
        return f"closed-loop trajectories of {self.samples} samples every {1e3 * self.period:g} ms (paper, Eq. 7)"

    def _class_of(self, name: str) -> str:
        found = re.search(self.classes, name) if self.classes else None
        return found.group(1) if found else name
