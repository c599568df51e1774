"""Everything at once: all parameters of all effects of the vocabulary, fitted to prediction errors by CMA-ES.

What PACE (arXiv:2509.06342) and similar tools do with a shorter list; the search is that of Hansen 2016,
arXiv:1604.00772.
"""

import time
from dataclasses import dataclass
from typing import ClassVar

import cma
import numpy as np

from wipx.baselines.case import Answer, Found, Problem, excluded
from wipx.baselines.prediction_search import PredictionSearch, at, needed
from wipx.core.errors import check_positive
from wipx.effects.catalogue import alike, effect_of, kind_of
from wipx.identify.parameter_space import ParameterSpace
from wipx.identify.problem import WindowProblem

DRY_FRICTION = "stribeck"  # of a joint's dry frictions only one can act; Stribeck's contains Coulomb's
FIRST_SHARE = 0.6  # of the time, for all effects; the rest for those that are kept
SPREAD = (0.02, 0.2)  # of the first candidates, shares of the search intervals
NO_PEAK = 0.2  # share by which the static level may exceed Coulomb's and still be called Coulomb friction


@dataclass(frozen=True)
class AllAtOnce:
    """One search over all effects, and one over those without which the predictions get worse.

    Attributes:
        seconds: Budget of time [s], for each joint of a robot from a model file.
        population: Candidates of a generation.
    """

    of_trees: ClassVar[bool] = True

    seconds: float = 15.0
    population: int = 24

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, population=self.population)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Search, keep what the predictions need, search again."""
        search = PredictionSearch.of(case)
        begun, budget = time.monotonic(), case.budget(self.seconds)  # the simulator is compiled by now
        names = _all_together(case)
        problem = search.problem(names)
        cube = self._minimise(problem, _undisturbed(problem.space), begun + FIRST_SHARE * budget, rng)
        kept = needed(problem, cube, names)
        if not kept:
            return Answer(case.nominal, (), mismatch=False)
        lean = search.problem(tuple(kept))
        values = dict(zip(problem.space.names, problem.space.to_values(cube), strict=True))
        start = lean.space.to_cube(np.array([values[name] for name in lean.space.names]))
        cube = self._minimise(lean, start, begun + budget, rng)
        model = at(lean.space, cube)
        weights = needed(lean, cube, kept)
        same = alike(model.plant)
        found = tuple(
            _named(name, dict(model.effects[name]), weight, same.get(name, ())) for name, weight in weights.items()
        )
        return Answer(model, found, bool(found))

    def _minimise(
        self, problem: WindowProblem, start: np.ndarray, deadline: float, rng: np.random.Generator
    ) -> np.ndarray:
        """The best position that is met until the deadline, shape (D,)."""
        reach = np.abs(problem.space.start - start)
        options = {
            "bounds": [0.0, 1.0],
            "CMA_stds": np.clip(reach, *SPREAD),
            "popsize": self.population,
            "seed": int(rng.integers(1, 2**31)),
            "verbose": -9,
        }
        evolution = cma.CMAEvolutionStrategy(np.clip(start, 1e-6, 1.0 - 1e-6), 1.0, options)
        best, lowest = start, float(problem.losses(start)[0])
        while not evolution.stop() and time.monotonic() < deadline:
            cubes = np.array(evolution.ask())
            losses = problem.losses(cubes)
            evolution.tell(list(cubes), losses.tolist())
            if losses.min() < lowest:
                best, lowest = cubes[np.argmin(losses)], float(losses.min())
        return best


def _all_together(case: Problem) -> tuple[str, ...]:
    """Effects that can act together, as many as possible; one for those that no recording tells apart."""
    names, plant = case.vocabulary, case.nominal.plant
    frictions = tuple(name for name in names if kind_of(name).kind == DRY_FRICTION)
    same = {other for name in names for other in kind_of(name).indistinguishable}
    return tuple(name for name in names if name not in same and not excluded(name, frictions, plant))


def _undisturbed(space: ParameterSpace) -> np.ndarray:
    """The nominal model: sizes neutral, places and speeds where a search usually begins, shape (D,)."""
    start, neutral = space.start, space.neutral
    return np.array([neutral[i] if _is_size(p.name, space) else start[i] for i, p in enumerate(space.free)])


def _is_size(name: str, space: ParameterSpace) -> bool:
    effect, _, symbol = name.rpartition(".")
    linear = effect_of(effect, space.model.plant).linear_in if effect else ()
    return not linear or symbol in linear


def _named(name: str, values: dict[str, float], weight: float, equivalent: tuple[str, ...]) -> Found:
    site, _, kind = name.partition("/")
    if kind == "stribeck" and values["F_s"] < (1.0 + NO_PEAK) * values["F_c"]:
        return Found(f"{site}/coulomb", {"F_c": values["F_c"]}, weight)
    return Found(name, values, weight, equivalent)
