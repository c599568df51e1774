"""Coulomb friction: a constant level against the motion, sticking at rest."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.parameters import Parameter


def steady(rate, p, body):
    """Force of sliding [N or N m], at a rate (N,)."""
    return -p["F_c"] * np.sign(rate)


EFFECT = Effect(
    kind="coulomb",
    words="Coulomb friction on {place}",
    sites=JOINT_SITES,
    parameters=(Parameter("F_c", "Coulomb level", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.01, 0.05)),),
    law="-F_c s(v), any force in [-F_c, F_c] at v = 0",
    linear_in=("F_c",),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
    steady=Steady("rate", steady),
    rows={"LEVEL_PLUS": "F_c", "LEVEL_MINUS": "F_c"},
    parts=("FRICTION",),
    built_in="frictionloss",
    usual=True,
)
