"""MuJoCo's own system identification toolbox (`mujoco.sysid`), fitted to short windows of the recordings.

The toolbox estimates built-in parameters of an MJCF by Gauss-Newton within bounds. It names nothing: which of the
fitted numbers are missing physics is read off the fit by the rule of the other baselines. It needs the extra `mujoco`;
predictions do not.
"""

import importlib
import io
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from wipx.baselines.case import Answer, Found, Problem
from wipx.baselines.mujoco_problem import DIFFERENCE, Toolbox, ToolboxProblem, is_expressible
from wipx.baselines.mujoco_selection import MujocoSelection
from wipx.baselines.prediction_search import PredictionSearch, at
from wipx.core.errors import InputError, check_positive
from wipx.effects.catalogue import alike

FIRST_SHARE = 0.5  # of the time, for all numbers; the rest for those that are kept
ROUND = 2  # Gauss-Newton steps between two looks at the clock
SETTLED = 1e-3  # relative fall of the loss below which a round was the last one


@dataclass(frozen=True)
class MujocoSysid:
    """Damping, friction loss, gear, inertia, delays and sensor errors, fitted by MuJoCo's toolbox.

    Attributes:
        seconds: Budget of time [s].
        windows: That are predicted; of more, an even choice.
    """

    of_trees: ClassVar[bool] = False

    seconds: float = 10.0
    windows: int = 16

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, windows=self.windows)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Fit all numbers, keep the effects that the predictions need, fit again."""
        toolbox = _toolbox()
        search = PredictionSearch.of(case)
        begun = time.monotonic()  # the simulator is compiled by now
        names = tuple(name for name in case.vocabulary if is_expressible(name))
        with _silent(toolbox):
            problem = self._problem(search, names, toolbox)
            fit = _fitted(problem, problem.space.neutral, begun + FIRST_SHARE * self.seconds)
            selection = MujocoSelection.of(fit.problem, fit.cube, names)
            if not selection.growth:
                return Answer(case.nominal, (), mismatch=False, notes=_notes(case))
            lean = self._problem(search, tuple(selection.growth), toolbox)
            values = dict(zip(problem.space.names, problem.space.to_values(selection.cube), strict=True))
            start = lean.space.to_cube(np.array([values[name] for name in lean.space.names]))
            fit = _fitted(lean.about(start), start, begun + self.seconds)
            selection = MujocoSelection.of(fit.problem, fit.cube, tuple(selection.growth))
        model = at(lean.space, selection.cube)
        found = tuple(_found(case, name, dict(model.effects[name]), g) for name, g in selection.growth.items())
        return Answer(model, found, bool(found), notes=_notes(case))

    def _problem(self, search: PredictionSearch, names: tuple[str, ...], toolbox: Toolbox) -> ToolboxProblem:
        count = search.predictor.windows.count
        chosen = np.unique(np.linspace(0, count - 1, min(count, self.windows)).astype(int))
        return ToolboxProblem.of(search.problem(names), search.case.noise, chosen, toolbox)


@dataclass(frozen=True)
class _Fit:
    """Where a search ended.

    Attributes:
        problem: About the states that belong to it.
        cube: Position, shape (D,).
    """

    problem: ToolboxProblem
    cube: np.ndarray


def _fitted(problem: ToolboxProblem, start: np.ndarray, deadline: float) -> _Fit:
    """Rounds of the toolbox's optimizer, each about the states of the model before, until they gain nothing.

    At least one round; the deadline is looked at between them.
    """
    best = _Fit(problem, start)
    lowest = float(problem.losses(start)[0])
    while True:
        parameters, _ = best.problem.toolbox.sysid.optimize(
            best.problem.parameters(best.cube),
            best.problem.toolbox_residuals,
            optimizer="mujoco",
            verbose=False,
            max_iters=ROUND,
            eps=DIFFERENCE,
            x_scale="jac",
            output=io.StringIO(),
        )
        cube = parameters.as_vector()
        moved = _Fit(best.problem.about(cube), cube)
        loss = float(moved.problem.losses(cube)[0])
        if loss > (1.0 - SETTLED) * lowest:
            return best
        best, lowest = moved, loss
        if time.monotonic() > deadline:
            return best


def _found(case: Problem, name: str, values: dict[str, float], weight: float) -> Found:
    same = alike(case.nominal.plant).get(name, ())
    return Found(name, values, weight, tuple(other for other in same if other in case.vocabulary))


def _notes(case: Problem) -> tuple[str, ...]:
    """What of the owner's model the toolbox cannot have."""
    lost = [name for name in case.nominal.effects if not is_expressible(name)]
    return (f"MuJoCo's toolbox fitted without {', '.join(lost)}, which it lacks.",) if lost else ()


def _toolbox() -> Toolbox:
    """MuJoCo's modules.

    Raises:
        InputError: they are not installed.
    """
    try:
        importlib.import_module("mujoco.sysid.report.defaults")  # mujoco.sysid itself hides which package it misses
        names = ("mujoco", "mujoco.sysid", "mujoco.minimize")
        return Toolbox(*(importlib.import_module(name) for name in names))
    except ModuleNotFoundError as error:
        raise InputError(
            f"baseline=mujoco_sysid needs MuJoCo's toolbox ({error.name or error} is missing); "
            'pip install "mujoco>=4.0,<5" absl-py colorama plotly tabulate'
        ) from error


@contextmanager
def _silent(toolbox: Toolbox) -> Iterator[None]:
    """Candidates that blow up or rest at a bound are scored, not written about to files and to the screen."""
    toolbox.mujoco.set_mju_user_warning(lambda _: None)
    logger = logging.getLogger("absl")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)
        toolbox.mujoco.set_mju_user_warning(None)
