"""The paper's own way: its friction model on every joint, fitted by particle swarm (Baek et al. 2024, Eqs. 5 and 8).

The paper names nothing but friction; which of its terms are there is read off the fit. Its loss (Eq. 7) compares
closed-loop trajectories from one start; here it is the prediction error of contract section 4, which needs neither
the controller's references nor repeated runs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from wipx.baselines.case import Answer, Found, Problem
from wipx.baselines.prediction_search import LOSS_WITHOUT, PredictionSearch, at
from wipx.core.errors import check_positive
from wipx.core.model import Model
from wipx.effects.catalogue import effect_of
from wipx.identify.optimizers.pso import ParticleSwarm
from wipx.identify.problem import WindowProblem

KIND = "lagged_stribeck"
LEVELS = 0.05  # of the usual search intervals


@dataclass(frozen=True)
class PaperFriction:
    """Lagged Stribeck friction on every joint.

    Attributes:
        seconds: Budget of time [s].
        particles: Size of the swarm.
        iterations: Generations, at most.
        c1: Pull towards a particle's own best (paper, Eq. 8).
        c2: Pull towards the swarm's best.
        w: Inertia of a particle's velocity.
    """

    of_trees: ClassVar[bool] = False

    seconds: float = 10.0
    particles: int = 50
    iterations: int = 400
    c1: float = 0.5
    c2: float = 0.2
    w: float = 0.9

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, particles=self.particles, iterations=self.iterations)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Fit the friction, then ask of each term whether the predictions need it."""
        bare, owners = _without_friction(case.nominal)
        problem = _narrowed(
            PredictionSearch.of(case).problem(tuple(f"{joint}/{KIND}" for joint in bare.plant.joints), bare)
        )
        swarm = ParticleSwarm(self.particles, self.iterations, self.c1, self.c2, self.w, seconds=self.seconds)
        cube = swarm.minimise(problem, rng).cube
        model = at(problem.space, cube)
        found = tuple(f for joint in bare.plant.joints for f in _terms(problem, model, joint, owners[joint]))
        return Answer(model, found, bool(found))


def _narrowed(problem: WindowProblem) -> WindowProblem:
    """The same problem over the lower part of its friction levels and coefficients.

    A swarm spreads evenly over its intervals; over the usual ones nearly all its robots would be stuck.
    """
    space = problem.space
    narrow = tuple(
        replace(p, high=LEVELS * p.high) if p.name.rpartition(".")[2] in ("F_s", "F_c", "sigma") else p
        for p in space.free
    )
    return replace(problem, space=replace(space, free=narrow))


def _without_friction(nominal: Model) -> tuple[Model, dict[str, float]]:
    """The nominal model without the friction that the paper's replaces, and the owner's viscous coefficients."""
    owners, replaced = {}, set()
    for joint in nominal.plant.joints:
        kinds = effect_of(f"{joint}/{KIND}", nominal.plant).excludes
        replaced |= {f"{joint}/{kind}" for kind in (*kinds, KIND)}
        owners[joint] = nominal.effects.get(f"{joint}/viscous", {"sigma": 0.0})["sigma"]
    kept = {name: values for name, values in nominal.effects.items() if name not in replaced}
    return Model(nominal.plant, nominal.parameters, kept), owners


def _terms(problem: WindowProblem, model: Model, joint: str, owners_sigma: float) -> list[Found]:
    """The terms of one joint without which the squared error grows."""
    values = model.effects[f"{joint}/{KIND}"]
    dry = _growth(problem, model, joint, {"F_c": 0.0, "F_s": 0.0})
    peak = _growth(problem, model, joint, {"F_s": values["F_c"]})
    viscous = _growth(problem, model, joint, {"sigma": owners_sigma})
    found = []
    if dry > LOSS_WITHOUT and peak > LOSS_WITHOUT and values["F_s"] > values["F_c"]:
        found.append(Found(f"{joint}/stribeck", {s: values[s] for s in ("F_c", "F_s", "v_s")}, dry))
    elif dry > LOSS_WITHOUT:
        found.append(Found(f"{joint}/coulomb", {"F_c": values["F_c"]}, dry))
    if viscous > LOSS_WITHOUT:
        found.append(Found(f"{joint}/viscous", {"sigma": values["sigma"] - owners_sigma}, viscous))
    return found


def _growth(problem: WindowProblem, model: Model, joint: str, absent: Mapping[str, float]) -> float:
    """Share by which the loss grows with some values of a joint's friction replaced."""
    space = problem.space
    changed = model.with_values({f"{joint}/{KIND}.{symbol}": value for symbol, value in absent.items()})
    cubes = space.to_cube(np.array([[m.value(name) for name in space.names] for m in (model, changed)]))
    before, after = problem.losses(cubes)
    return float(after / before - 1.0)
