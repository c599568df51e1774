"""Saturation of the actuator's force."""

import numpy as np

from wipx.core.effect import Effect, Steady
from wipx.core.law import above, law
from wipx.core.parameters import Parameter


def _steady(command, p, body):
    return np.vectorize(force)(command, p["F_max"], 0.0) - command


EFFECT = Effect(
    kind="saturation",
    words="saturation of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter(
            "F_max",
            "largest force",
            "force",
            1e9,
            0.05,
            2.0,
            0.8,
        ),
    ),
    law="F = clip(u, -F_max, F_max)",
    source="force range of actuators, MuJoCo documentation",
    steady=Steady("command", _steady, stage=3),
    rows={"FORCE_MAX": "F_max"},
    parts=("SATURATION",),
    scan="force_limits",
)


@law
def force(u, limit, spread):
    """Mean force of commands scattered by up to `spread` about `u`; spread 0 is the plain law."""
    return u - above(u - limit, spread) + above(-u - limit, spread)
