"""Payload: an extra mass on the body, at a height above the wheel axis."""

from wipx.core.effect import Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="payload",
    words="payload on the body",
    sites=("geometry",),
    parameters=(
        Parameter("mass", "of the payload", "mass", 0.0, 0.0, 1.0, 0.05, grid=(0.05,)),
        Parameter("height", "above the wheel axis", "length", 1.0, 0.0, 4.0, 1.0, grid=(0.3, 1.0, 2.0), signed=True),
    ),
    law="m_b + m; L and I_b about the new centre of mass (parallel axes)",
    linear_in=("mass",),
    source="Atkeson, An, Hollerbach 1986, Estimation of inertial parameters, IJRR 5(3)",
    needs=("body_mass",),
    linear_at_rest="payload",
)


def loaded(body_mass, com_height, body_inertia, mass, height):
    """Mass, height of the centre of mass and inertia about it of a body with a payload."""
    total = body_mass + mass
    com = (body_mass * com_height + mass * height) / total
    inertia = body_inertia + body_mass * (com_height - com) ** 2 + mass * (height - com) ** 2
    return total, com, inertia
