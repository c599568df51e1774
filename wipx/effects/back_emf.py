"""Back-EMF of a voltage-driven motor: the force falls with speed.

The same equation as `viscous` at the driven joint, but part of the motor's force: it counts as
load for `load_friction` and is absent when the motor's leads are open.
"""

from wipx.core.effect import Effect, Steady
from wipx.core.parameters import Parameter


def _steady(rate, p, body):
    return -p["k_e"] * rate


EFFECT = Effect(
    kind="back_emf",
    words="back-EMF of {place}",
    sites=("actuator", "drive"),
    parameters=(
        Parameter("k_e", "force lost per speed, k_t^2/R at the joint", "damping", 0.0, 0.0, 3.0, 0.02, grid=(0.02,)),
    ),
    law="F = u - k_e v",
    linear_in=("k_e",),
    source="DC motor equation; Duclusaud, Passault 2025, arXiv:2410.08650",
    outside_vocabulary=True,
    steady=Steady("rate", _steady),
    rows={"BACK_EMF": "k_e"},
    parts=("BACK_EMF",),
    linear_at_rest="back_emf",
)
