"""Scale error of a sensor."""

from wipx.core.effect import SENSOR_SITES, Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="scale",
    words="scale error of {place}",
    sites=SENSOR_SITES,
    parameters=(Parameter("e", "relative error", "ratio", 0.0, -0.3, 0.3, 0.0, grid=(0.02,)),),
    law="recorded = (1 + e) true",
    linear_in=("e",),
    source="Woodman 2007, An introduction to inertial navigation, UCAM-CL-TR-696",
    rows={"SCALE": "e"},
)
