"""Transport delay, in the actuator or in a sensor."""

from wipx.core.effect import SENSOR_SITES, Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="delay",
    words="delay of {place}",
    sites=("actuator", *SENSOR_SITES),
    parameters=(
        Parameter("tau", "delay", "time", 0.0, 0.0, 0.15, 0.003, grid=(0.003, 0.006, 0.01, 0.015, 0.022, 0.03)),
    ),
    law="F(t) = u(t - tau); recorded(t) = true(t - tau)",
    linear_in=("tau",),
    source="PACE 2025, arXiv:2509.06342; Furgale, Rehder, Siegwart 2013 for sensors",
    rows={"DELAY": "tau"},
    parts=("DELAY",),
)
