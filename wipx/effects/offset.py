"""Actuator offset: a constant force beside the command (current-sensor zero, amplifier bias)."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="offset",
    sites=("actuator",),
    parameters=(Parameter("F_0", "force at zero command", "force", 0.0, -0.5, 0.5, 0.0, grid=(0.02,)),),
    law="F = u + F_0",
    linear_in=("F_0",),
    source="Wiebe et al. 2022, Torque-limited simple pendulum, JOSS 7(74)",
    beyond=True,
)
