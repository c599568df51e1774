"""Covariance matrix adaptation with restarts (package cma; Hansen 2016, arXiv:1604.00772)."""

from dataclasses import dataclass

import numpy as np

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import (
    HOPELESS,
    BudgetSpentError,
    Log,
    Minimum,
    Start,
    Watcher,
    first_position,
    own_randomness,
    unwatched,
)
from wipx.identify.problem import Problem

NEGLIGIBLE = 1e-9  # share of the first loss below which there is nothing left to find


@dataclass(frozen=True)
class CmaEs:
    """CMA-ES within the cube; restarted with twice the population until that no longer helps.

    Restarts are those of IPOP (Auger and Hansen 2005, IEEE CEC): a larger population finds wider valleys.

    Attributes:
        population: Candidates of a generation, before the first restart.
        sigma: Spread of the first candidates, a share of the search intervals.
        better: Share by which a restart must lower the loss for another one to be made.
        evaluations: Budget of loss evaluations.
        seconds: Budget of time [s].
        start: Where it begins; restarts begin anywhere.
    """

    population: int = 24
    sigma: float = 0.3
    better: float = 0.01
    evaluations: int = 1_000_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C
    start: Start = "random"

    def __post_init__(self) -> None:
        check_positive(population=self.population, sigma=self.sigma, better=self.better)
        check_positive(evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best candidate of all restarts; ends early within the budget."""
        log = Log("cma_es", self.evaluations, self.seconds, watcher)
        population, start, before = self.population, first_position(problem, self.start, rng), np.inf
        try:
            while True:
                with own_randomness(rng) as seed:
                    self._evolve(problem, start, population, seed, log)
                if log.best_loss > (1.0 - self.better) * before or log.best_loss <= NEGLIGIBLE * log.course[0][2]:
                    return log.minimum("converged")
                population, start, before = 2 * population, first_position(problem, "random", rng), log.best_loss
        except BudgetSpentError:
            return log.minimum(log.spent())

    def _evolve(self, problem: Problem, start: np.ndarray, population: int, seed: int, log: Log) -> None:
        """One run, until its own tests of convergence end it."""
        import cma

        options = {"bounds": [0.0, 1.0], "popsize": population, "seed": seed, "verbose": -9}
        evolution = cma.CMAEvolutionStrategy(np.clip(start, 1e-6, 1.0 - 1e-6), self.sigma, options)
        while not evolution.stop():
            candidates = np.array(evolution.ask())
            losses = log.evaluate(problem, candidates)
            evolution.tell(list(candidates), losses.tolist())
            if losses.min() >= HOPELESS:
                return
