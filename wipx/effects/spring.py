"""A spring on the carriage: cable, hose or bumper."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="spring",
    sites=("environment",),
    parameters=(
        Parameter("k", "stiffness", "stiffness", 0.0, 0.0, 3.0, 0.02, grid=(0.05,)),
        Parameter("x0", "where it is relaxed", "coordinate", 0.0, -2.0, 2.0, 0.0, grid=(-1.0, 0.0, 1.0)),
    ),
    law="-k (x - x0)",
    linear_in=("k",),
    source="rigid-body mechanics",
    needs=("translation",),
)
