"""Stribeck friction: a level that falls from static to Coulomb as the speed rises."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Contains, Effect, FittedEffect, Steady
from wipx.core.law import decay, law, maximum
from wipx.core.parameters import Parameter


def steady(rate, p, body):
    """Force of sliding [N or N m], at a rate (N,)."""
    return -np.sign(rate) * (p["F_c"] + np.vectorize(bump)(rate, p["F_s"], p["F_c"], p["v_s"]))


CERTAIN = 2.0  # standard deviations by which the static level must exceed Coulomb's


def _has_no_certain_peak(fitted: FittedEffect) -> bool:
    peak = fitted.values["F_s"] - fitted.values["F_c"]
    return not peak > CERTAIN * fitted.deviation({"F_s": 1.0, "F_c": -1.0})


EFFECT = Effect(
    kind="stribeck",
    words="Stribeck friction on {place}",
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
    rows={
        "LEVEL_PLUS": "F_c",
        "LEVEL_MINUS": "F_c",
        "STATIC": "F_s",
        "COULOMB": "F_c",
        "STRIBECK_SPEED": "v_s",
    },
    parts=("FRICTION", "STRIBECK"),
    contains=Contains("coulomb", when=_has_no_certain_peak),
)


@law
def bump(speed, static, coulomb, v_s):
    """What the level exceeds Coulomb by at a `speed` [N or N m]; zero where static < coulomb."""
    ratio = speed / v_s
    return maximum(static - coulomb, 0.0) * decay(ratio * ratio)
