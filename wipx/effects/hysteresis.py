"""Hysteresis (Bouc, Wen): a force that follows the motion within a loop whose shape is free.

With exponent 1 and asymmetry 0 it is the Dahl friction of `presliding`, whose bristle it shares.
"""

from wipx.core.effect import JOINT_SITES, Effect, Extends, Steady
from wipx.core.law import law, minimum
from wipx.core.parameters import Parameter
from wipx.effects.coulomb import steady
from wipx.effects.presliding import BRISTLE_ROWS

EFFECT = Effect(
    kind="hysteresis",
    words="hysteresis (Bouc-Wen) on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_c", "level when it is fully built up", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.1, 0.5)),
        Parameter("stiffness", "where nothing is bent", "stiffness", 1.0, 1e-2, 1e5, 100.0, grid=(1.0, 10.0)),
        Parameter("damping", "of the same", "damping", 0.0, 0.0, 3.0, 0.0, default=0.0),
        Parameter("n", "exponent, how suddenly it yields", "ratio", 1.0, 1.0, 8.0, 2.0, grid=(2.0,)),
        Parameter(
            "gamma",
            "stiffness of the way back: 1/2 as at rest, 0 up to twice that, -1/2 three times",
            "ratio",
            0.0,
            -0.5,
            0.5,
            0.0,
            grid=(0.0,),
        ),
    ),
    law="-F_c z - damping F_c z' / stiffness, "
    "z' = (stiffness / F_c) (v - (1 - gamma) abs(v) abs(z)^(n - 1) z - gamma v abs(z)^n)",
    linear_in=(
        "F_c",
        "stiffness",
    ),
    source="Bouc 1967; Wen 1976, Method for random vibration of hysteretic systems, ASCE J. Eng. Mech. 102(2)",
    excludes=("presliding", "lugre"),
    outside_vocabulary=True,
    steady=Steady("rate", steady),
    rows={**BRISTLE_ROWS, "EXPONENT": "n", "GAMMA": "gamma"},
    parts=("HYSTERESIS", "BRISTLE", "DAMPING"),
    extends=Extends("presliding", ({"n": 2.0}, {"n": 2.0, "gamma": 0.4}, {"n": 2.0, "gamma": -0.4})),
)


@law
def yielding(z, v, exponent, gamma):
    """How fast the bristle forgets at deflection `z` (share of the largest), over how fast that of Dahl does [1]."""
    size = minimum(abs(z), 1.0)
    towards = (1.0 - gamma) + (gamma if z * v > 0.0 else -gamma)
    return towards * size ** (exponent - 1.0)
