"""Bounded Gauss-Newton with several starts (SciPy's trust-region reflective method)."""

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from wipx.identify.optimizers.search import BudgetSpent, Log, Minimum, Watcher, unwatched
from wipx.identify.problem import ResidualProblem


@dataclass(frozen=True)
class LeastSquares:
    """Least squares from the best of the model's own start, the neutral one and a random sample.

    Attributes:
        starts: How many searches are made.
        sample: Random positions among which the starts are chosen.
        iterations: Steps of one search at most.
        secants: Finite-difference steps of successive searches, relative to the distance from the
            neutral value: wide ones see past the jumps of sticking joints, narrow ones end precisely.
        tolerance: Relative change of the loss or of a parameter that ends one.
        evaluations: Budget of loss evaluations, those of slopes included.
        seconds: Budget of time [s].
    """

    starts: int = 3
    sample: int = 48
    iterations: int = 30
    secants: tuple[float, ...] = (0.2, 0.02)
    tolerance: float = 1e-6
    evaluations: int = 20_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C

    def minimise(self, problem: ResidualProblem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best of the searches; ends early within the budget."""
        log = Log("least_squares", self.evaluations, self.seconds, watcher)
        try:
            for start in self._starts(problem, rng, log):
                for secant in self.secants:
                    start = self._search(problem, start, secant, log)
        except BudgetSpent:
            return log.minimum(log.spent())
        return log.minimum("converged")

    def _starts(self, problem: ResidualProblem, rng: np.random.Generator, log: Log) -> np.ndarray:
        own = np.stack([problem.space.start, problem.space.neutral])
        cube = own if self.starts == 1 else np.concatenate([own, problem.space.sample(self.sample, rng)])
        losses = problem.losses(cube)
        log.add(cube, losses)
        return cube[np.argsort(losses, kind="stable")[: self.starts]]

    def _search(self, problem: ResidualProblem, start: np.ndarray, secant: float, log: Log) -> np.ndarray:
        neutral = problem.space.neutral

        def residuals(cube: np.ndarray) -> np.ndarray:
            values = problem.residuals(cube)
            log.add(cube[None], np.array([np.mean(values**2)]))
            return values

        def jacobian(cube: np.ndarray) -> np.ndarray:
            log.count += 2 * len(cube)
            return problem.jacobian(cube, secant * np.abs(cube - neutral))

        result = optimize.least_squares(
            residuals,
            np.clip(start, 1e-9, 1.0 - 1e-9),
            jacobian,
            bounds=(0.0, 1.0),
            xtol=self.tolerance,
            ftol=self.tolerance,
            gtol=None,
            max_nfev=self.iterations,
            x_scale="jac",
        )
        return result.x
