"""First-order lag of the actuator (current loop, motor inductance)."""

import numpy as np

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

FASTEST = 1e-30  # [s]; a lag of zero is one that settles at once


def rate_of(time):
    """Rate at which a lag of a time constant [s] settles [1/s]."""
    return 1.0 / np.maximum(time, FASTEST)


EFFECT = Effect(
    kind="lag",
    words="first-order lag of {place}",
    sites=("actuator",),
    parameters=(Parameter("tau", "time constant", "time", 0.0, 0.0, 0.3, 0.003, grid=(0.003, 0.01, 0.03)),),
    law="tau F' + F = u",
    linear_in=("tau",),
    source="activation filter of actuators, MuJoCo documentation",
    rows={"LAG_RATE": lambda p, body: rate_of(p["tau"])},
    parts=("LAG",),
)
