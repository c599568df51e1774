"""Torque-speed limit: the driving force falls to zero at the motor's free speed."""

from wipx.core.effect import Contains, Effect, FittedEffect
from wipx.core.law import above, law, maximum
from wipx.core.parameters import Parameter

OUT_OF_REACH = 3.0  # times the largest speed, a free speed that is never felt


def _is_out_of_reach(fitted: FittedEffect) -> bool:
    return fitted.values["v_free"] > OUT_OF_REACH * fitted.top_speed


EFFECT = Effect(
    kind="speed_limit",
    words="torque-speed limit of {place}",
    sites=("actuator", "drive"),
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
    rows={"STALL": "F_stall", "FREE_SPEED": "v_free"},
    parts=("SPEED_LIMIT",),
    scan="speed_limits",
    contains=Contains("saturation", when=_is_out_of_reach, symbols={"F_stall": "F_max"}),
)


@law
def limited(force, v, stall, free, spread):
    """Mean of what the motor can give of forces scattered by up to `spread`, at joint velocity `v` [N or N m]."""
    driving = stall * maximum(1.0 - abs(v) / free, 0.0)
    high = driving if v > 0.0 else stall
    low = stall if v > 0.0 else driving
    return force - above(force - high, spread) + above(-force - low, spread)
