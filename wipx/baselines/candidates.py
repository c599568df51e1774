"""Candidate terms: the torque residual's answer to a small dose of every effect of the vocabulary.

An effect that grows in proportion to some of its parameters is one column for each value of the others (a place, a
Stribeck velocity, a number of ripples per turn); a threshold is a column that is taken whole or not at all.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from wipx.baselines.case import Problem
from wipx.baselines.torque import TorqueData
from wipx.core.effect import Effect
from wipx.effects.catalogue import effect_of

# These drives have states of their own, which no function of the recorded signals gives.
WITHOUT_TERM = ("backlash", "elasticity")
PHASES = (0.0, 0.5 * np.pi)  # of a ripple; the opposite ones are negative sizes
LONG = 15  # values; of two grids that are longer every second value is looked at


@dataclass(frozen=True)
class Candidate:
    """An effect at one position of its grid.

    Attributes:
        name: "site/kind".
        values: Its parameters [SI].
        linear: Those in proportion to which it grows, with their neutral values; empty for a threshold.
        signed: Whether its size may be negative.
        column: Change of the residual acceleration that it makes, shape (rows, joints) [m/s^2, rad/s^2].
    """

    name: str
    values: Mapping[str, float]
    linear: Mapping[str, float]
    signed: bool
    column: np.ndarray

    def sized(self, size: float) -> dict[str, float]:
        """Its parameters at `size` times the dose."""
        neutral = self.linear
        values = {s: neutral[s] + size * (v - neutral[s]) if s in neutral else v for s, v in self.values.items()}
        if size < 0.0 and "phase" in values:
            values |= {"A": -values["A"], "phase": values["phase"] - np.pi}
        return values


def candidates(case: Problem, data: TorqueData) -> tuple[Candidate, ...]:
    """All candidates that change the torque residual at all."""
    base = data.residual(case.nominal)
    found = []
    for name in case.vocabulary:
        effect = effect_of(name, case.nominal.plant)
        if effect.kind in WITHOUT_TERM:
            continue
        linear = {s: effect.neutral[s] for s in effect.linear_in}
        signed = "phase" in effect.neutral or any(p.low < p.neutral for p in effect.parameters if p.name in linear)
        for values in _doses(effect, name, case):
            column = data.residual(case.nominal.with_effects({name: values})) - base
            if np.abs(column).max() > 0.0:
                found.append(Candidate(name, values, linear, signed, column))
    return tuple(found)


def _doses(effect: Effect, name: str, case: Problem) -> Iterator[dict[str, float]]:
    """Values of the grid [SI]; one dose of parameters in proportion to which the effect grows."""
    scales = case.scales[name.partition("/")[0]]
    axes = []
    for p in effect.parameters:
        size = scales.of(p.dimension)
        grid = p.grid or (p.start,)
        if p.name in effect.linear_in and len(effect.linear_in) == 1:
            grid = grid[:1]
        axes.append([value * size for value in (PHASES if p.name == "phase" else grid)])
    if sum(len(axis) > LONG for axis in axes) > 1:
        axes = [axis[::2] for axis in axes]
    for values in product(*axes):
        dose = dict(zip((p.name for p in effect.parameters), values, strict=True))
        if dose.get("lo", 0.0) < dose.get("hi", 1.0) and dose.get("F_c", 0.0) <= dose.get("F_s", np.inf):
            yield dose
