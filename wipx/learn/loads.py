"""Loads drawn at random, and many robots that carry one each."""

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np

from wipx.core.errors import InputError
from wipx.core.load import BALANCE, BODY, Load, loaded_body, with_lean
from wipx.core.model import Model, ModelBatch

POOL = 100  # loads that are drawn for each that is taken
BINS = 40  # of equilibrium pitch, over which those that are taken are spread evenly


@dataclass(frozen=True)
class LoadRanges:
    """Intervals from which loads are drawn; see `wipx.core.load.Load` for what they mean.

    The defaults move the equilibrium of the paper's robot by up to 0.25 rad to either side.

    Attributes:
        mass: [kg].
        height: Above the wheel axis [m].
        side: Beside the body's axis, towards +x [m].
    """

    mass: tuple[float, float] = (0.2, 2.0)
    height: tuple[float, float] = (0.3, 0.65)
    side: tuple[float, float] = (-0.3, 0.3)

    def __post_init__(self) -> None:
        for name, (low, high), unit in (
            ("mass", self.mass, "kg"),
            ("height", self.height, "m"),
            ("side", self.side, "m"),
        ):
            if not (low <= high and isfinite(low) and isfinite(high)):
                raise InputError(
                    f"{name} is [{low:g}, {high:g}] {unit}, expected [from, to] with from <= to; correct it"
                )
            if low < 0.0 and name != "side":
                raise InputError(f"{name} begins at {low:g} {unit}, expected zero or more; correct it")

    def draw(self, body: Model, count: int, rng: np.random.Generator) -> np.ndarray:
        """Loads whose equilibrium pitches are spread evenly over all that these ranges reach.

        Mass, height and side are drawn uniformly, many more than are needed. Most of them hardly move the
        equilibrium: only what is heavy and far out does. Those that are taken are therefore drawn with a probability
        inverse to how many fell into their bin of pitch; none is taken twice, so that numbers decline towards the
        outermost pitches, which few loads reach.

        Args:
            body: The robot without load.
            count: How many.
            rng: Source of the random numbers.

        Returns:
            Mass, height and side of each, shape (count, 3) [kg, m, m], in random order.

        Raises:
            InputError: the robot cannot carry a load.
        """
        low, high = np.array([self.mass, self.height, self.side]).T
        pool = rng.uniform(low, high, size=(POOL * count, 3))
        pitch = equilibria(carrying(ModelBatch(body), pool))
        place = (pitch - pitch.min()) / max(float(np.ptp(pitch)), 1e-12)
        bins = np.minimum((BINS * place).astype(int), BINS - 1)
        rarity = 1.0 / np.bincount(bins, minlength=BINS)[bins]
        taken = rng.choice(len(pool), size=count, replace=False, p=rarity / rarity.sum())
        return pool[rng.permutation(taken)]


def carrying(robots: ModelBatch, loads: np.ndarray) -> ModelBatch:
    """The robots with loads on their bodies: `Load.on` for many at once.

    Args:
        robots: P models without load.
        loads: Mass, height and side of each load, shape (N, 3) [kg, m, m].

    Returns:
        N models; load i is on robot i modulo P.

    Raises:
        InputError: as of `Load.on`.
    """
    Load(0.0, 0.0, 0.0).on(robots.model)  # refuses a robot that cannot carry one
    carrier = np.arange(len(loads)) % robots.size
    leaning = replace(robots, model=with_lean(robots.model))
    body = np.stack([leaning.column(name)[carrier] for name in BODY])
    kept = [name for name in robots.names if name not in BODY]
    values = [*(robots.column(name)[carrier] for name in kept), *loaded_body(body, loads.T)]
    return ModelBatch(leaning.model, (*kept, *BODY), np.column_stack(values))


def equilibria(robots: ModelBatch) -> np.ndarray:
    """Pitch at which each of these loaded robots balances, shape (N,) [rad]; the paper's theta_lin."""
    return robots.column(f"{BALANCE}.theta_eq")


def some_of(robots: ModelBatch, which: slice | np.ndarray) -> ModelBatch:
    """Some of many robots; of a single one it is that one."""
    return robots if robots.values is None else ModelBatch(robots.model, robots.names, robots.values[which])
