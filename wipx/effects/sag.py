"""Sagging drive: it gives less when its battery empties or its magnets warm, and less where much is asked.

What it loses stays bounded where nothing was recorded: later than all recordings, and under larger forces.
"""

from math import sqrt

from wipx.core.effect import Effect
from wipx.core.law import law, minimum
from wipx.core.parameters import Parameter

# Gauss quadrature with three nodes of a triangular distribution over +-1, exact up to the fifth power.
NODE, WEIGHT = sqrt(0.4), 5.0 / 24.0
TINY = 1e-200  # [N or N m] added to forces by which something is divided

EFFECT = Effect(
    kind="sag",
    words="sag of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter("d", "share of the force that is lost per second", "per_time", 0.0, -0.05, 0.05, 0.0),
        Parameter("l", "share that is lost of twice the force u_0", "ratio", 0.0, 0.0, 0.25, 0.0),
        Parameter(
            "t_0", "time at which nothing is lost; half of that after which no more is", "moment", 0.0, 0.0, 1.0, 0.5
        ),
        Parameter("u_0", "force at which nothing is lost", "load", 0.0, 0.0, 4.0, 1.0),
        Parameter("u_1", "force beyond which no larger share is lost", "limit", 0.0, 0.0, 2.0, 1.0),
    ),
    law="F = u (1 - d (min(t, 2 t_0) - t_0) - l (min(abs(u), u_1) / u_0 - 1))",
    linear_in=("d", "l"),
    source="Krishnan 2010, Permanent Magnet Synchronous and Brushless DC Motor Drives, ch. 1",
    outside_vocabulary=True,
    tolerance={"d": 0.005, "l": 0.07},
    rows={"SAG_TIME": "d", "SAG_MIDDLE": "t_0", "SAG_LOAD": "l", "SAG_USUAL": "u_0", "SAG_MOST": "u_1"},
    parts=("SAG",),
)


@law
def force(u, emptied, load, usual, most, spread):
    """Mean force of commands scattered by up to `spread` about `u`, with a share `emptied` lost by time."""
    aside = NODE * spread
    outer = _lost(u - aside, usual, most) + _lost(u + aside, usual, most)
    return u * (1.0 - emptied) - load * ((1.0 - 2.0 * WEIGHT) * _lost(u, usual, most) + WEIGHT * outer)


@law
def _lost(u, usual, most):
    """What one command loses by its size, over the share l."""
    return u * (minimum(abs(u), most) / (usual + TINY) - 1.0)
