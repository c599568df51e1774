"""Quadratic drag: a force against the motion, proportional to the square of the speed."""

import numpy as np

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.law import law
from wipx.core.parameters import Parameter


def _steady(rate, p, body):
    return np.vectorize(force)(rate, p["c"])


EFFECT = Effect(
    kind="quadratic_drag",
    words="quadratic drag on {place}",
    sites=JOINT_SITES,
    parameters=(Parameter("c", "drag coefficient", "drag", 0.0, 0.0, 3.0, 0.02, grid=(0.02, 0.1)),),
    law="-c v abs(v)",
    linear_in=("c",),
    source="Kaheman, Kaiser, Strom, Kutz, Brunton 2019, arXiv:1909.08574",
    steady=Steady("rate", _steady),
    rows={"DRAG": "c"},
    parts=("DRAG",),
)


@law
def force(v, c):
    """Drag on a joint of velocity `v` [N or N m]."""
    return -c * v * abs(v)
