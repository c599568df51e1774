"""Coulomb friction with one level per direction of motion."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Contains, Effect, FittedEffect, Steady, WithConstant
from wipx.core.parameters import Parameter


def _steady(rate, p, body):
    return np.where(rate > 0.0, -p["F_plus"], 0.0) + np.where(rate < 0.0, p["F_minus"], 0.0)


CERTAIN = 2.0  # standard deviations by which the levels must differ


def _is_alike_both_ways(fitted: FittedEffect) -> bool:
    difference = fitted.values["F_plus"] - fitted.values["F_minus"]
    return not abs(difference) > CERTAIN * fitted.deviation({"F_plus": 1.0, "F_minus": -1.0})


EFFECT = Effect(
    kind="asymmetric_coulomb",
    words="Coulomb friction that differs by direction on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("F_plus", "level while v > 0", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.0, 0.03)),
        Parameter("F_minus", "level while v < 0", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.0, 0.03)),
    ),
    law="-F_plus for v > 0, F_minus for v < 0, any force in [-F_plus, F_minus] at v = 0",
    linear_in=(
        "F_plus",
        "F_minus",
    ),
    source="Bona, Indri 2005, Friction compensation in robotics: an overview, CDC",
    excludes=("coulomb",),
    outside_vocabulary=True,
    on_machines=lambda site, plant: plant.tree is not None,
    steady=Steady("rate", _steady),
    rows={"LEVEL_PLUS": "F_plus", "LEVEL_MINUS": "F_minus"},
    parts=("FRICTION",),
    contains=Contains("coulomb", when=_is_alike_both_ways, symbols={"F_plus": "F_c", "F_minus": "F_c"}),
    with_constant=WithConstant("coulomb", {"F_plus": "F_c", "F_minus": "F_c"}),
)
