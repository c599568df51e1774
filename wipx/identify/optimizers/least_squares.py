"""Bounded Gauss-Newton with several starts and smoothing continuation (SciPy's TRF method).

A joint that sticks answers to its parameters in jumps, in which Gauss-Newton gets stuck. Each
search therefore begins with friction that builds up over a wide range of speed, follows the
minimum while that range shrinks, and ends with true sticking.
"""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy import optimize

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import BudgetSpentError, Log, Minimum, Watcher, unwatched
from wipx.identify.problem import Problem

SECANT = 0.02  # finite-difference step relative to the distance from the neutral value


@dataclass(frozen=True)
class LeastSquares:
    """Least squares from the model's own start and from the best of a random sample.

    Attributes:
        starts: How many searches are made.
        sample: Random positions among which the further starts are chosen.
        iterations: Steps at each level of smoothing, at most.
        smoothing: Successive levels, in shares of the joints' speeds; ends with 0.
        tolerance: Relative change of the loss or of a parameter that ends a level.
        evaluations: Budget of loss evaluations, those of slopes included.
        seconds: Budget of time [s].
    """

    starts: int = 2
    sample: int = 32
    iterations: int = 30
    smoothing: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01, 0.003, 0.0)
    tolerance: float = 1e-5
    evaluations: int = 20_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C

    def __post_init__(self) -> None:
        check_positive(starts=self.starts, sample=self.sample, iterations=self.iterations)
        check_positive(tolerance=self.tolerance, evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best of the searches; ends early within the budget."""
        log = Log("least_squares", self.evaluations, self.seconds, watcher)
        try:
            for start in self._starts(problem, rng, log):
                self._follow(problem, start, log)
        except BudgetSpentError:
            return log.minimum(log.spent())
        return log.minimum("converged")

    def _starts(self, problem: Problem, rng: np.random.Generator, log: Log) -> np.ndarray:
        own = np.stack([problem.space.start, problem.space.neutral])
        log.add(own, problem.losses(own))
        if self.starts == 1:
            return own[:1]
        cube = problem.space.sample(self.sample, rng)
        losses = problem.losses(cube)
        log.add(cube, losses)
        best = cube[np.argsort(losses, kind="stable")[: self.starts - 1]]
        return np.concatenate([own[:1], best])

    def _follow(self, problem: Problem, start: np.ndarray, log: Log) -> None:
        """Follow the minimum from wide smoothing to none."""
        for level in self.smoothing:
            start = self._search(problem.smoothed(level), start, log)
            log.share += 1.0 / (self.starts * len(self.smoothing))
            log.add(start[None], problem.losses(start[None]))

    def _search(self, problem: Problem, start: np.ndarray, log: Log) -> np.ndarray:
        # The start is about as far from the neutral value as the effect is large.
        reach = np.abs(problem.space.start - problem.space.neutral)

        def residuals(cube: np.ndarray) -> np.ndarray:
            log.tick(1)
            return problem.residuals(cube)

        def jacobian(cube: np.ndarray) -> np.ndarray:
            log.tick(2 * len(cube))
            return problem.jacobian(cube, SECANT * np.maximum(np.abs(cube - problem.space.neutral), reach))

        result = optimize.least_squares(
            residuals,
            np.clip(start, 1e-9, 1.0 - 1e-9),
            jac=cast(Any, jacobian),  # SciPy's annotation knows the names of its own schemes only
            bounds=(0.0, 1.0),
            xtol=self.tolerance,
            ftol=self.tolerance,
            gtol=1e-12,
            max_nfev=self.iterations,
            x_scale="jac",
        )
        return result.x
