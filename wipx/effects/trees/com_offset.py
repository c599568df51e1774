"""Centre of mass of a link beside where the model has it."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="com_offset",
    words="centre of mass of {place} beside its place in the model",
    sites=("link",),
    parameters=tuple(
        Parameter(axis, f"along {axis} of the body's frame", "length", 0.0, -1.0, 1.0, 0.0, grid=(0.1,))
        for axis in ("x", "y", "z")
    ),
    law="c + (x, y, z), the inertia about the centre of mass as it is",
    linear_in=("x", "y", "z"),
    superposes=True,
    source="Atkeson, An, Hollerbach 1986, Estimation of inertial parameters, IJRR 5(3)",
)
