"""Torque ripple (cogging): a force periodic in the motor's angle."""

import numpy as np

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(place, p, body):
    return p["A"] * np.cos(p["n"] * place / body.get("wheel_radius", 1.0) + p["phase"])


EFFECT = Effect(
    kind="ripple",
    words="torque ripple (cogging) of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter("A", "amplitude", "force", 0.0, 0.0, 0.5, 0.02),
        # At least one period on the recorded way: less of a wave may be any force that depends on the place.
        Parameter(
            "n",
            "periods per turn of the wheel (or of the joint, where it turns)",
            "periods",
            1.0,
            1.0,
            1000.0,
            6.0,
        ),
        Parameter("phase", "angle of the first crest", "angle", 0.0, -6.3, 6.3, 0.0),
    ),
    law="+ A cos(n x/r + phase)",
    linear_in=("A",),
    source="Holtz, Springob 1996, Identification and compensation of torque ripple, IEEE TIE 43(2)",
    steady=Steady("coordinate", _steady),
    rows={
        "RIPPLE": "A",
        "RIPPLE_PERIODS": lambda p, body: p["n"] / body.get("wheel_radius", 1.0),
        "RIPPLE_PHASE": "phase",
    },
    parts=("RIPPLE",),
    scan="periods",
)
