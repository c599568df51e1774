"""Pre-sliding friction (Dahl, damped as in LuGre): a bristle bends before the joint slides, and remembers it."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Coefficient, Contains, Effect, FittedEffect, MadeOf, Steady
from wipx.core.law import law, maximum, relaxing
from wipx.core.parameters import Parameter
from wipx.effects.coulomb import steady

INVISIBLE = 0.3  # of a sensor's resolution, a deflection that cannot be seen
HARDLY = 0.1  # of a joint's travel, bent by which a bristle hardly slips


def held(number, level):
    """A number of a bristle, zero without a `level`: it then slides at once, where from rest it would be a spring."""
    return number * (level > 0.0)


BRISTLE_ROWS: dict[str, Coefficient] = {
    "SLIDING": "F_c",
    "BRISTLE": lambda p, body: held(p["stiffness"], p["F_c"]),
    "BRISTLE_DAMPING": lambda p, body: held(p["damping"], p["F_c"]),
}


def _bends_invisibly(fitted: FittedEffect) -> bool:
    return fitted.values["F_c"] < INVISIBLE * fitted.resolution * fitted.values["stiffness"]


def _hardly_slips(fitted: FittedEffect) -> bool:
    return fitted.values["F_c"] > HARDLY * float(np.ptp(fitted.positions)) * fitted.values["stiffness"]


EFFECT = Effect(
    kind="presliding",
    words="pre-sliding (bristle) friction on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_c", "level in steady sliding", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.02, 0.1, 0.5)),
        Parameter("stiffness", "of the bristle", "stiffness", 1.0, 1e-2, 1e5, 100.0, grid=(1.0, 10.0, 100.0)),
        Parameter("damping", "of the bristle", "damping", 0.0, 0.0, 3.0, 0.0, default=0.0),
    ),
    law="-(stiffness z + damping z'), z' = v - stiffness abs(v) z / F_c",
    linear_in=(
        "F_c",
        "stiffness",
    ),
    source="Dahl 1968, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1; Canudas de Wit et al. 1995",
    excludes=("coulomb", "asymmetric_coulomb", "stribeck", "lugre"),
    steady=Steady("rate", steady),
    rows=BRISTLE_ROWS,
    parts=("BRISTLE", "DAMPING"),
    contains=Contains("coulomb", when=_bends_invisibly, comes_to_rest=True),
    # A bristle that does not slip is a spring with its damping.
    made_of=MadeOf(
        "translation", {"environment/spring.k": "stiffness", "translation/viscous.sigma": "damping"}, _hardly_slips
    ),
)


@law
def bristle_rate(speed, stiffness, level):
    """How fast the bristle forgets, stiffness |v| / level [1/s]."""
    return stiffness * speed / maximum(level, 1e-12)


@law
def bristle(step_rate):
    """How a bristle moves in one step at constant speed: z' = v - a z, `step_rate` = a h [1].

    Returns:
        Weight of z in the deflection at the end, weight of v h in it (also of z in the mean
        deflection), and weight of v h in the mean deflection.
    """
    kept, mean = relaxing(step_rate)
    small = 1 / 2 - step_rate * (1 / 6 - step_rate * (1 / 24 - step_rate * (1 / 120)))
    return kept, mean, small if step_rate < 0.02 else (1.0 - mean) / maximum(step_rate, 1e-4)
