"""Torque-speed limit: the driving force falls to zero at the motor's free speed."""

from wipx.core.effect import Effect
from wipx.core.law import above, law, maximum
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="speed_limit",
    sites=("actuator",),
    parameters=(
        Parameter(
            "F_stall",
            "largest force at rest",
            "limit",
            1e9,
            0.02,
            5.0,
            1.0,
        ),
        Parameter("v_free", "speed without load", "velocity", 1e9, 0.3, 20.0, 2.0),
    ),
    law="driving: abs(F) <= F_stall (1 - abs(v)/v_free); braking: abs(F) <= F_stall",
    source="torque-speed line of a DC motor, BAM documentation, github.com/Rhoban/bam",
)


@law
def limited(force, v, stall, free, spread):
    """Mean of what the motor can give of forces scattered by up to `spread`, at joint velocity `v` [N or N m]."""
    driving = stall * maximum(1.0 - abs(v) / free, 0.0)
    high = driving if v > 0.0 else stall
    low = stall if v > 0.0 else driving
    return force - above(force - high, spread) + above(-force - low, spread)
