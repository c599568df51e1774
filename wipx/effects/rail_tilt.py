"""A rail that is not level: gravity pulls along it."""

import numpy as np

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(place, p, body):
    weight = (body.get("body_mass", 0.0) + body["wheel_mass"]) * body["gravity"]
    return np.full_like(place, -weight * np.sin(p["angle"]))


EFFECT = Effect(
    kind="rail_tilt",
    words="tilt of the rail",
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
    steady=Steady("coordinate", _steady),
    rows={"TILT": "angle"},
    parts=("TILT",),
    linear_at_rest="rail_tilt",
    constant_force=True,
)
