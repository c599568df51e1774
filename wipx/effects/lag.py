"""First-order lag of the actuator (current loop, motor inductance)."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="lag",
    sites=("actuator",),
    parameters=(Parameter("tau", "time constant", "time", 0.0, 0.0, 0.3, 0.003, grid=(0.003, 0.01, 0.03)),),
    law="tau F' + F = u",
    linear_in=("tau",),
    source="activation filter of actuators, MuJoCo documentation",
)
