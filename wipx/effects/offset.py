"""Actuator offset: a constant force beside the command (current-sensor zero, amplifier bias)."""

import numpy as np

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(command, p, body):
    return np.full_like(command, p["F_0"])


EFFECT = Effect(
    kind="offset",
    words="constant force offset of {place}",
    sites=("actuator",),
    parameters=(Parameter("F_0", "force at zero command", "force", 0.0, -0.5, 0.5, 0.0, grid=(0.02,)),),
    law="F = u + F_0",
    linear_in=("F_0",),
    source="Wiebe et al. 2022, Torque-limited simple pendulum, JOSS 7(74)",
    outside_vocabulary=True,
    steady=Steady("command", _steady),
    rows={"OFFSET": "F_0"},
    parts=("OFFSET",),
    constant_force=True,
    on_machines=lambda site, plant: True,
)
