"""Genetic algorithm (pymoo; Blank and Deb 2020, IEEE Access 8)."""

from dataclasses import dataclass

import numpy as np

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import BudgetSpentError, Log, Minimum, Watcher, own_randomness, unwatched
from wipx.identify.problem import Problem


@dataclass(frozen=True)
class GeneticAlgorithm:
    """pymoo's GA with its defaults: tournaments, simulated binary crossover, polynomial mutation.

    It ends with pymoo's own test of convergence, or with the budget.

    Attributes:
        population: Candidates of a generation; the first is drawn evenly from the cube.
        evaluations: Budget of loss evaluations.
        seconds: Budget of time [s].
    """

    population: int = 100
    evaluations: int = 1_000_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C

    def __post_init__(self) -> None:
        check_positive(population=self.population, evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best candidate; ends early within the budget."""
        log = Log("ga", self.evaluations, self.seconds, watcher)
        try:
            with own_randomness(rng) as seed:
                self._evolve(problem, seed, log)
        except BudgetSpentError:
            return log.minimum(log.spent())
        return log.minimum("converged")

    def _evolve(self, problem: Problem, seed: int, log: Log) -> None:
        from pymoo.algorithms.soo.nonconvex.ga import GA
        from pymoo.core.evaluator import Evaluator
        from pymoo.core.problem import Problem as Box
        from pymoo.problems.static import StaticProblem

        box = Box(n_var=len(problem.space.free), n_obj=1, xl=0.0, xu=1.0)
        evolution = GA(pop_size=self.population)
        evolution.setup(box, seed=seed)
        while evolution.has_next():
            candidates = evolution.ask()
            if candidates is None:  # it finds no new ones
                return
            losses = log.evaluate(problem, np.asarray(candidates.get("X"), dtype=float))
            Evaluator().eval(StaticProblem(box, F=losses[:, None]), candidates)
            evolution.tell(infills=candidates)
