"""Zero offset of an angle sensor."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="bias",
    words="constant error (bias) of {place}",
    sites=("sensor_theta", "sensor_theta1", "sensor_theta2"),
    parameters=(Parameter("b", "recorded minus true angle", "angle", 0.0, -0.5, 0.5, 0.0, grid=(0.01,)),),
    law="recorded = theta + b",
    linear_in=("b",),
    source="Woodman 2007, An introduction to inertial navigation, UCAM-CL-TR-696",
    rows={"BIAS": "b"},
    constant_force=True,
)
