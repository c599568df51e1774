"""Inertia of the body that differs from the believed one."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="inertia",
    words="wrong moment of inertia of the body",
    sites=("geometry",),
    parameters=(Parameter("scale", "true over believed I_b", "ratio", 1.0, 0.1, 10.0, 1.0, grid=(1.2,)),),
    law="scale I_b",
    linear_in=("scale",),
    source="Rucker, Wensing 2022, Smooth parameterization of rigid-body inertia, IEEE RA-L 7(2)",
    needs=("body_inertia",),
    linear_at_rest="inertia",
)
