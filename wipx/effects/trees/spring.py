"""A spring on a joint: a cable, a counterbalance, a bumper."""

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(place, p, body):
    return -p["k"] * (place - p["q0"])


EFFECT = Effect(
    kind="spring",
    words="spring on {place}",
    sites=("joint",),
    parameters=(
        Parameter("k", "stiffness", "stiffness", 0.0, 0.0, 3.0, 0.02, grid=(0.05,)),
        Parameter("q0", "where it is relaxed", "coordinate", 0.0, -2.0, 2.0, 0.0, grid=(-1.0, 0.0, 1.0)),
    ),
    law="-k (q - q0)",
    linear_in=("k",),
    source="rigid-body mechanics",
    steady=Steady("coordinate", _steady),
    rows={"SPRING": "k", "SPRING_REST": "q0"},
    parts=("SPRING",),
)
