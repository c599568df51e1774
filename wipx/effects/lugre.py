"""LuGre friction: a damped bristle whose sliding level has a Stribeck peak.

Canudas de Wit, Olsson, Astrom and Lischinsky (1995); its viscous term is the effect `viscous`.
The bristle's laws are those of `presliding`.
"""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.parameters import Parameter
from wipx.effects.presliding import held
from wipx.effects.stribeck import steady

EFFECT = Effect(
    kind="lugre",
    words="LuGre friction (damped bristle with a Stribeck peak) on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_c", "Coulomb level", "force", 0.0, 0.0, 1.0, 0.02),
        Parameter("F_s", "static level, above F_c", "force", 0.0, 0.0, 1.0, 0.03),
        Parameter("v_s", "Stribeck velocity", "velocity", 1.0, 2e-3, 1.0, 0.05),
        Parameter("stiffness", "of the bristle", "stiffness", 1.0, 1e-2, 1e5, 100.0),
        Parameter("damping", "of the bristle", "damping", 0.0, 0.0, 3.0, 0.01),
    ),
    law="-(stiffness z + damping z'), z' = v - stiffness abs(v) z / g(v), g = F_c + (F_s - F_c) exp(-(v/v_s)^2)",
    linear_in=(
        "F_c",
        "F_s",
        "stiffness",
    ),
    source="Canudas de Wit, Olsson, Astrom, Lischinsky 1995, IEEE TAC 40(3)",
    excludes=("coulomb", "asymmetric_coulomb", "stribeck", "presliding"),
    outside_vocabulary=True,
    steady=Steady("rate", steady),
    rows={
        "SLIDING": "F_c",
        "PEAK": "F_s",
        "PEAK_SPEED": "v_s",
        "BRISTLE": lambda p, body: held(p["stiffness"], np.maximum(p["F_c"], p["F_s"])),
        "BRISTLE_DAMPING": lambda p, body: held(p["damping"], np.maximum(p["F_c"], p["F_s"])),
    },
    parts=("BRISTLE", "DAMPING"),
)
