"""Eccentric encoder: its error comes back with every turn of what it sits on."""

from wipx.core.effect import SENSOR_SITES, Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="eccentricity",
    words="eccentricity of {place}",
    sites=SENSOR_SITES,
    parameters=(
        Parameter("s", "relative error of the rate that the sine makes at most", "ratio", 0.0, -0.2, 0.2, 0.0),
        Parameter("c", "relative error of the rate that the cosine makes at most", "ratio", 0.0, -0.2, 0.2, 0.0),
        Parameter("n", "periods per turn of the joint (or per 2 pi m)", "per_coordinate", 1.0, 0.1, 1000.0, 1.0),
    ),
    law="recorded = q + (s sin(n q) + c cos(n q)) / n",
    linear_in=("s", "c"),
    source="Ellin, Dolsak 2008, The design and application of rotary encoders, Sensor Review 28(2)",
    outside_vocabulary=True,
    tolerance={"s": 0.01, "c": 0.01},
    rows={"ECCENTRIC_SINE": "s", "ECCENTRIC_COSINE": "c", "ECCENTRIC_NUMBER": "n"},
    parts=("ECCENTRICITY",),
)
