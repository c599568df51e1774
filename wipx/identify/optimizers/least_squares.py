"""Bounded Gauss-Newton with several starts and smoothing continuation (SciPy's TRF method).

A joint that sticks answers to its parameters in jumps, in which Gauss-Newton gets stuck. Each
search therefore begins with friction that builds up over a wide range of speed, follows the
minimum while that range shrinks, and ends with true sticking. Slopes are secants that begin as wide: a law
with a dead zone in speed, as the paper's, makes the loss jagged where no smoothing of friction helps.
"""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy import optimize

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import BudgetSpentError, Log, Minimum, Watcher, unwatched
from wipx.identify.problem import Problem

SECANT = 0.02  # finite-difference step relative to the distance from the neutral value
WIDER = 50.0  # growth of that step with the smoothing: sixteenfold at a smoothing of 0.3
FEWEST = 2  # starts that are followed to the end, or a quarter of all
SHORT_SMOOTHING = (0.1, 0.01)  # levels of smoothing for short windows
NEAR = 0.1  # largest level near the minimum
BETTER = 0.002  # share by which the loss must fall for the best minimum to be followed again


@dataclass(frozen=True)
class _Place:
    """The current state of a search.

    Attributes:
        cube: Position, shape (D,).
        loss: There, without smoothing.
    """

    cube: np.ndarray
    loss: float


@dataclass(frozen=True)
class LeastSquares:
    """Least squares from the model's own start, or where shorter windows lead to, and from the best of a random sample.

    Attributes:
        starts: How many searches are made; None for as many as the problem has `valleys`.
        sample: Random positions per further start, among which they are chosen.
        iterations: Steps at each level of smoothing, at most.
        smoothing: Successive levels, in shares of the joints' speeds; ends with 0.
        tolerance: Relative change of the loss or of a parameter that ends a level.
        evaluations: Budget of loss evaluations, those of slopes included.
        seconds: Budget of time [s].
    """

    starts: int | None = None
    sample: int = 32
    iterations: int = 30
    smoothing: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01, 0.003, 0.0)
    tolerance: float = 1e-5
    evaluations: int = 50_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C

    def __post_init__(self) -> None:
        check_positive(starts=1 if self.starts is None else self.starts)
        check_positive(sample=self.sample, iterations=self.iterations)
        check_positive(tolerance=self.tolerance, evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best of the searches; ends early within the budget.

        The first level of smoothing shows which starts lead to a low minimum; the others are not followed further.
        """
        log = Log("least_squares", self.evaluations, self.seconds, watcher)
        try:
            starts = self._starts(problem, rng, log)
            wide, narrow = self.smoothing[:1], self.smoothing[1:]
            if problem.near:
                wide, narrow = (), tuple(level for level in self.smoothing if level <= NEAR)
            kept = min(max(FEWEST, len(starts) // 4), len(starts))
            share = 1.0 / (len(starts) * len(wide) + kept * len(narrow))
            reached = [self._follow(problem, start, wide, share, log) for start in starts]
            reached.sort(key=lambda place: place.loss)
            ends = [self._follow(problem, place.cube, narrow, share, log) for place in reached[:kept]]
            if kept < len(starts):
                self._settle(problem, min(ends, key=lambda place: place.loss), log)
        except BudgetSpentError:
            return log.minimum(log.spent())
        return log.minimum("converged")

    def _starts(self, problem: Problem, rng: np.random.Generator, log: Log) -> np.ndarray:
        own = np.stack([problem.space.start, problem.space.neutral])
        if problem.short is not None:
            own = np.stack([self._brought_near(problem.short, problem.space.start, log), *own])
            own = own[np.argsort(log.evaluate(problem, own), kind="stable")]
        else:
            log.evaluate(problem, own)
        further = (self.starts or problem.valleys) - 1
        if further == 0:
            return own[:1]
        cube = problem.space.sample(self.sample * further, rng)
        losses = log.evaluate(problem, cube)
        best = cube[np.argsort(losses, kind="stable")[:further]]
        return np.concatenate([own[:1], best])

    def _brought_near(self, short: Problem, start: np.ndarray, log: Log) -> np.ndarray:
        """The minimum of short windows."""
        for level in SHORT_SMOOTHING:
            start = self._search(short.smoothed(level), start, SECANT * (1.0 + WIDER * level), log)
        return start

    def _follow(
        self, problem: Problem, start: np.ndarray, levels: tuple[float, ...], share: float, log: Log
    ) -> "_Place":
        """Follow the minimum through levels of smoothing, each a `share` of all work."""
        for level in levels:
            start = self._search(problem.smoothed(level), start, SECANT * (1.0 + WIDER * level), log)
            log.share += share
        return _Place(start, float(log.evaluate(problem, start[None])[0]))

    def _settle(self, problem: Problem, best: "_Place", log: Log) -> None:
        """Repeat the search from the best minimum as long as that helps: a loss with many minima is also jagged."""
        before = np.inf
        while best.loss < (1.0 - BETTER) * before:
            before = best.loss
            best = self._follow(problem, best.cube, self.smoothing, 0.0, log)

    def _search(self, problem: Problem, start: np.ndarray, secant: float, log: Log) -> np.ndarray:
        # The start is about as far from the neutral value as the effect is large.
        reach = np.abs(problem.space.start - problem.space.neutral)

        def residuals(cube: np.ndarray) -> np.ndarray:
            log.tick(1)
            return problem.residuals(cube)

        def jacobian(cube: np.ndarray) -> np.ndarray:
            log.tick(problem.differences * len(cube))
            return problem.jacobian(cube, secant * np.maximum(np.abs(cube - problem.space.neutral), reach))

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
