"""SciPy's minimisers of a smooth function: local methods, each from one start."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import optimize

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import (
    BudgetSpentError,
    Log,
    Minimum,
    Start,
    Watcher,
    first_position,
    unwatched,
)
from wipx.identify.problem import Problem

Method = Literal["nelder_mead", "powell", "cg", "bfgs", "slsqp"]
NAMES = {"nelder_mead": "Nelder-Mead", "powell": "Powell", "cg": "CG", "bfgs": "BFGS", "slsqp": "SLSQP"}
KNOW_BOUNDS = ("nelder_mead", "powell", "slsqp")
USE_SLOPES = ("cg", "bfgs", "slsqp")
STEP = float(np.sqrt(np.finfo(float).eps))  # of the slopes' forward differences, as in SciPy
OUTSIDE = 100.0  # times the squared distance from the cube: a tenth beyond costs as much as the model's own start


@dataclass(frozen=True)
class ScipyMinimise:
    """One of SciPy's methods with its default settings.

    SciPy's tolerances are absolute, for losses of about one: it is given multiples of the loss of the model's own
    start. Slopes are the forward differences that SciPy would take, all of them in one call. Methods
    without bounds see, outside of the cube, the loss at the nearest position within, and a penalty that grows with
    the square of the distance, so that it joins smoothly and leads back.

    Attributes:
        method: Which.
        start: Where it begins: anywhere in the cube, or at the model's start.
        evaluations: Budget of loss evaluations, those of slopes included.
        seconds: Budget of time [s].
    """

    method: Method
    start: Start = "random"
    evaluations: int = 1_000_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C

    def __post_init__(self) -> None:
        check_positive(evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best position that is met; ends early within the budget."""
        log = Log(self.method, self.evaluations, self.seconds, watcher)
        bounded = self.method in KNOW_BOUNDS
        try:
            first = first_position(problem, self.start, rng)
            losses = problem.losses(np.stack([first, problem.space.start]))
            log.add(first[None], losses[:1])
            log.tick(1)  # the model's own start gives the size of a loss and is no candidate
            size = losses[1] if np.isfinite(losses[1]) and losses[1] > 0.0 else 1.0
            seen = _Scaled(problem, log, float(size))
            done = optimize.minimize(
                seen.value,
                first,
                method=NAMES[self.method],
                jac=seen.slopes if self.method in USE_SLOPES else None,
                bounds=[(0.0, 1.0)] * len(problem.space.free) if bounded else None,
            )
        except BudgetSpentError:
            return log.minimum(log.spent())
        return log.minimum("converged" if done.success else f"SciPy: {done.message}")


@dataclass(frozen=True)
class _Scaled:
    """The loss as SciPy sees it.

    Attributes:
        problem: What is minimised.
        log: Counts the evaluations.
        size: Loss that counts as one.
    """

    problem: Problem
    log: Log
    size: float

    def value(self, position: np.ndarray) -> float:
        """Loss at a position (D,)."""
        return float(self._values(position[None])[0])

    def slopes(self, position: np.ndarray) -> np.ndarray:
        """Its forward differences, shape (D,); backward at the cube's upper end."""
        steps = np.where((position <= 1.0) & (position + STEP > 1.0), -STEP, STEP)
        values = self._values(np.concatenate([position[None], position + np.diag(steps)]))
        return (values[1:] - values[0]) / steps

    def _values(self, positions: np.ndarray) -> np.ndarray:
        inside = np.clip(positions, 0.0, 1.0)
        beyond = np.sum((positions - inside) ** 2, axis=1)
        return self.log.evaluate(self.problem, inside) / self.size + OUTSIDE * beyond
