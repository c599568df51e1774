"""Viscous friction: a force against the motion, proportional to speed."""

from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.parameters import Parameter


def _steady(rate, p, body):
    return -p["sigma"] * rate


EFFECT = Effect(
    kind="viscous",
    words="viscous friction on {place}",
    sites=JOINT_SITES,
    parameters=(Parameter("sigma", "viscous coefficient", "damping", 0.0, 0.0, 3.0, 0.02, grid=(0.02, 0.1)),),
    law="-sigma v",
    linear_in=("sigma",),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30(7)",
    steady=Steady("rate", _steady),
    rows={"VISCOUS": "sigma"},
    parts=("DAMPING",),
    linear_at_rest="viscous",
    built_in="damping",
    usual=True,
)
