"""Torque ripple (cogging): a force periodic in the motor's angle."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="ripple",
    sites=("actuator",),
    parameters=(
        Parameter("A", "amplitude", "force", 0.0, 0.0, 0.5, 0.02),
        Parameter(
            "n",
            "periods per radian of the wheel (or of the joint, where it turns)",
            "ratio",
            1.0,
            1.0,
            200.0,
            6.0,
        ),
        Parameter("phase", "angle of the first crest", "angle", 0.0, -6.3, 6.3, 0.0),
    ),
    law="+ A cos(n x/r + phase)",
    linear_in=("A",),
    source="Holtz, Springob 1996, Identification and compensation of torque ripple, IEEE TIE 43(2)",
)
