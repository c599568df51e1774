"""A rail that is not level: gravity pulls along it."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="rail_tilt",
    sites=("environment",),
    parameters=(
        Parameter(
            "angle", "of the rail, positive where it rises towards +x", "angle", 0.0, -0.3, 0.3, 0.0, grid=(0.005,)
        ),
    ),
    law="- (m_b + m_w) g sin(angle) on x; the coupling uses theta - angle",
    linear_in=("angle",),
    source="rigid-body mechanics",
    needs=("translation",),
)
