"""Pre-sliding friction (Dahl, damped as in LuGre): a bristle bends before the joint slides, and remembers it."""

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.law import law, maximum, relaxing
from wipx.core.parameters import Parameter
from wipx.effects.coulomb import steady

EFFECT = Effect(
    kind="presliding",
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
