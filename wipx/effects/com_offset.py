"""Centre of mass beside the body axis: the body balances at an angle."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="com_offset",
    words="centre of mass beside the body axis",
    sites=("geometry",),
    parameters=(Parameter("theta_eq", "pitch at which the body balances", "angle", 0.0, -0.5, 0.5, 0.0, grid=(0.01,)),),
    law="theta - theta_eq in place of theta",
    linear_in=("theta_eq",),
    source="Atkeson, An, Hollerbach 1986, Estimation of inertial parameters, IJRR 5(3)",
    needs=("com_height",),
    rows={"BALANCE": "theta_eq"},
    linear_at_rest="com_offset",
    constant_force=True,
    indistinguishable=("sensor_theta/bias",),
)
