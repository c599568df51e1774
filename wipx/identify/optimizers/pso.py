"""Particle swarm optimisation (pyswarms), the paper's choice."""

import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.errors import check_positive
from wipx.identify.optimizers.search import (
    BudgetSpentError,
    Log,
    Minimum,
    Start,
    Watcher,
    own_randomness,
    unwatched,
)
from wipx.identify.problem import Problem


@dataclass(frozen=True)
class ParticleSwarm:
    """Global-best particle swarm.

    Attributes:
        particles: Size of the swarm.
        iterations: Generations.
        c1: Pull towards a particle's own best (paper, Eq. 8).
        c2: Pull towards the swarm's best.
        w: Inertia of a particle's velocity.
        evaluations: Budget of loss evaluations.
        seconds: Budget of time [s].
        start: Where the first particle is: "random" like the others (paper), or at the "model"'s start.
    """

    particles: int = 50
    iterations: int = 100
    c1: float = 0.5
    c2: float = 0.2
    w: float = 0.9
    evaluations: int = 1_000_000
    seconds: float = 1800.0  # the paper's cap, Sec. VI-C
    start: Start = "model"

    def __post_init__(self) -> None:
        check_positive(particles=self.particles, iterations=self.iterations)
        check_positive(evaluations=self.evaluations, seconds=self.seconds)

    def minimise(self, problem: Problem, rng: np.random.Generator, watcher: Watcher = unwatched) -> Minimum:
        """The best particle; ends early within the budget."""
        log = Log("pso", self.evaluations, self.seconds, watcher)
        dimension = len(problem.space.free)
        first = rng.random((self.particles, dimension))
        if self.start == "model":
            first[0] = problem.space.start

        def losses(cube: np.ndarray) -> np.ndarray:
            log.share += 1.0 / self.iterations
            return log.evaluate(problem, cube)

        try:
            with own_randomness(rng), _unlogged():
                from pyswarms.single.global_best import GlobalBestPSO

                swarm = GlobalBestPSO(
                    n_particles=self.particles,
                    dimensions=dimension,
                    options={"c1": self.c1, "c2": self.c2, "w": self.w},
                    bounds=(np.zeros(dimension), np.ones(dimension)),
                    bh_strategy="nearest",
                    init_pos=first,
                )
                swarm.optimize(losses, iters=self.iterations, verbose=False)
        except BudgetSpentError:
            return log.minimum(log.spent())
        return log.minimum(f"{self.iterations} generations")


@contextmanager
def _unlogged() -> Iterator[None]:
    """Keep pyswarms from opening a log file where it runs, and from setting the level of all logging."""
    configured = os.environ.get("LOG_CFG")
    level = logging.getLogger().level
    with tempfile.TemporaryDirectory() as folder:
        quiet = Path(folder, "logging.yaml")
        quiet.write_text("version: 1\ndisable_existing_loggers: false\n")
        os.environ["LOG_CFG"] = str(quiet)
        try:
            yield
        finally:
            logging.getLogger().setLevel(level)
            os.environ.pop("LOG_CFG")
            if configured is not None:
                os.environ["LOG_CFG"] = configured
