"""Inertia of a link that differs from the believed one."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="inertia",
    words="wrong moments of inertia of {place}",
    sites=("link",),
    parameters=(Parameter("scale", "true over believed moments", "ratio", 1.0, 0.1, 10.0, 1.0, grid=(1.2,)),),
    law="scale I about the centre of mass",
    linear_in=("scale",),
    source="Rucker, Wensing 2022, Smooth parameterization of rigid-body inertia, IEEE RA-L 7(2)",
)
