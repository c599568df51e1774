"""Payload: an extra point mass that is fixed to a link."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="payload",
    words="payload on {place}",
    sites=("link",),
    parameters=(
        Parameter("mass", "of the payload", "mass", 0.0, 0.0, 1.0, 0.05, grid=(0.05,)),
        *(
            Parameter(axis, f"its place along {axis} of the body's frame", "length", 0.0, -3.0, 3.0, 0.0)
            for axis in ("x", "y", "z")
        ),
    ),
    law="m + mass; centre of mass and inertia with a point mass at (x, y, z)",
    linear_in=("mass",),
    scan="point_masses",
    source="Atkeson, An, Hollerbach 1986, Estimation of inertial parameters, IJRR 5(3)",
)
