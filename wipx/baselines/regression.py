"""Torque-residual regression with forward selection: the textbook way to identify a robot's dynamics.

Swevers, Verdonck, De Schutter 2007, Dynamic model identification for industrial robots, IEEE CSM 27(5); selection by
the Bayesian information criterion (Schwarz 1978), the rows' colour allowed for.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from wipx.baselines.candidates import Candidate, candidates
from wipx.baselines.case import Answer, Found, Problem, excluded
from wipx.baselines.torque import TorqueData
from wipx.baselines.torque_fit import TorqueFit, TorqueFitter
from wipx.core.errors import check_positive
from wipx.effects.catalogue import effect_of
from wipx.identify.motion import motions

TRIED = 3  # effects that are refined at each step
AS_GOOD = 0.01  # nats within which two effects explain the recordings equally well


@dataclass(frozen=True)
class TorqueRegression:
    """Least squares on the torque residual, effects added one by one.

    Attributes:
        seconds: Budget of time [s]; effects found until then are kept.
        effects: Named at most.
    """

    of_trees: ClassVar[bool] = False

    seconds: float = 10.0
    effects: int = 4

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, effects=self.effects)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Add the best effect as long as the criterion rises, then drop those that it does not need."""
        deadline = time.monotonic() + self.seconds
        data = TorqueData(motions(case.recordings, case.nominal.plant, case.noise))
        fitter = TorqueFitter(case, data)
        pool = candidates(case, data)
        best, twins = fitter.fit({}), {}
        while len(best.effects) < self.effects and time.monotonic() < deadline:
            trials = [fitter.fit(start, best.deviation) for start in _next(best, pool, case)]
            better = [t for t in trials if _criterion(t, best, case) > _criterion(best, best, case)]
            if not better:
                break
            chosen = max(better, key=lambda t: _criterion(t, best, case))
            twins[chosen.effects[-1]] = tuple(
                t.effects[-1] for t in trials if t is not chosen and abs(chosen.gain(t)) < AS_GOOD
            )
            best = chosen
        best = fitter.nameable(_pruned(best, fitter, case))
        found = tuple(
            Found(name, best.model.effects[name], weight, twins.get(name, ()))
            for name, weight in fitter.losses_without(best).items()
        )
        return Answer(best.model, found, bool(found))


def _criterion(fit: TorqueFit, current: TorqueFit, case: Problem) -> float:
    """Criterion of a fit, the number of independent rows being that of the `current` model."""
    parameters = sum(len(effect_of(name, case.nominal.plant).parameters) for name in fit.effects)
    return replace(fit, independent=current.independent).criterion(parameters)


def _next(fit: TorqueFit, pool: tuple[Candidate, ...], case: Problem) -> list[dict[str, Mapping[str, float]]]:
    """Effects from which the next fits begin: each with one more, the most promising ones."""
    present = {name: fit.model.effects[name] for name in fit.effects}
    allowed = [
        c for c in pool if c.name not in present and not excluded(c.name, tuple(fit.model.effects), case.nominal.plant)
    ]
    scored: dict[str, tuple[float, Mapping[str, float]]] = {}
    flat = (fit.residual / fit.deviation).ravel()
    basis = np.linalg.qr((fit.slopes / fit.deviation).reshape(len(fit.slopes), flat.size).T)[0]
    for candidate in allowed:
        column = (candidate.column / fit.deviation).ravel()
        column = column - basis @ (basis.T @ column)
        size = _size(candidate, column, flat)
        gain = float(flat @ flat - np.sum((flat + size * column) ** 2))
        if gain > scored.get(candidate.name, (0.0, {}))[0]:
            scored[candidate.name] = gain, candidate.sized(size)
    order = sorted(scored, key=lambda name: -scored[name][0])[:TRIED]
    return [{**present, name: scored[name][1]} for name in order]


def _size(candidate: Candidate, column: np.ndarray, residual: np.ndarray) -> float:
    if not candidate.linear:
        return 1.0
    size = -float(column @ residual) / max(float(column @ column), 1e-300)
    return size if candidate.signed else max(size, 0.0)


def _pruned(best: TorqueFit, fitter: TorqueFitter, case: Problem) -> TorqueFit:
    """Without the effects that the criterion no longer needs beside the later ones."""
    while len(best.effects) > 1:
        leanest = max(fitter.without_each(best).values(), key=lambda t: _criterion(t, best, case))
        if _criterion(leanest, best, case) <= _criterion(best, best, case):
            break
        best = leanest
    return best
