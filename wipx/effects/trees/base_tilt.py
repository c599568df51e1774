"""A base that is not level: gravity has another direction in the robot's frame."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="base_tilt",
    words="tilt of the base",
    sites=("base",),
    parameters=(
        Parameter("roll", "about x of the base", "angle", 0.0, -0.3, 0.3, 0.0, grid=(0.01,)),
        Parameter("pitch", "about y of the base", "angle", 0.0, -0.3, 0.3, 0.0, grid=(0.01,)),
    ),
    law="gravity in the base's frame is R' g, R = Ry(pitch) Rx(roll)",
    linear_in=("roll", "pitch"),
    superposes=True,
    source="rigid-body mechanics",
)
