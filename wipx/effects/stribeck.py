"""Stribeck friction: a level that falls from static to Coulomb as the speed rises."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.law import decay, law, maximum
from wipx.core.parameters import Parameter


def steady(rate, p, body):
    """Force of sliding [N or N m], at a rate (N,)."""
    return -np.sign(rate) * (p["F_c"] + np.vectorize(bump)(rate, p["F_s"], p["F_c"], p["v_s"]))


EFFECT = Effect(
    kind="stribeck",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_c", "Coulomb level", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.02,)),
        Parameter("F_s", "static level, above F_c", "force", 0.0, 0.0, 1.0, 0.03, grid=(0.03, 0.06)),
        Parameter("v_s", "Stribeck velocity", "velocity", 1.0, 2e-3, 1.0, 0.05, grid=(0.02, 0.1, 0.4)),
    ),
    law="-s(v) [F_c + (F_s - F_c) exp(-(v/v_s)^2)], sticking below F_s at v = 0",
    linear_in=(
        "F_c",
        "F_s",
    ),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
    excludes=("coulomb", "asymmetric_coulomb"),
    steady=Steady("rate", steady),
)


@law
def bump(speed, static, coulomb, v_s):
    """What the level exceeds Coulomb by at a `speed` [N or N m]; zero where static < coulomb."""
    ratio = speed / v_s
    return maximum(static - coulomb, 0.0) * decay(ratio * ratio)
