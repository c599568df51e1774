"""A spring on the carriage: cable, hose or bumper."""

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(place, p, body):
    return -p["k"] * (place - p["x0"])


EFFECT = Effect(
    kind="spring",
    words="spring or cable that pulls on the carriage",
    sites=("environment",),
    parameters=(
        Parameter("k", "stiffness", "stiffness", 0.0, 0.0, 3.0, 0.02, grid=(0.05,)),
        Parameter("x0", "where it is relaxed", "coordinate", 0.0, -2.0, 2.0, 0.0, grid=(-1.0, 0.0, 1.0)),
    ),
    law="-k (x - x0)",
    linear_in=("k",),
    source="rigid-body mechanics",
    needs=("translation",),
    steady=Steady("coordinate", _steady),
    rows={"SPRING": "k", "SPRING_REST": "x0"},
    parts=("SPRING",),
    linear_at_rest="spring",
)
