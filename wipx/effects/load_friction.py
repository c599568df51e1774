"""Load-dependent gear friction: the level grows with the torques that the teeth carry.

Model M5 of the extended friction models without its Stribeck part; that is the effect `stribeck`.
"""

from wipx.core.effect import JOINT_SITES, Effect
from wipx.core.law import law
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="load_friction",
    words="load-dependent gear friction on {place}",
    sites=JOINT_SITES,
    parameters=(
        Parameter("K_motor", "friction per force of the motor", "ratio", 0.0, 0.0, 1.0, 0.05, grid=(0.0, 0.1)),
        Parameter("K_external", "friction per force of the load", "ratio", 0.0, 0.0, 1.0, 0.05, grid=(0.0, 0.1)),
    ),
    law="-s(v) abs(K_external F_load - K_motor F_motor), sticking at v = 0",
    linear_in=(
        "K_motor",
        "K_external",
    ),
    source="Duclusaud, Passault 2025, Extended friction models for servo actuators, arXiv:2410.08650",
    outside_vocabulary=True,
    rows={"LOAD_MOTOR": "K_motor", "LOAD_EXTERNAL": "K_external"},
    parts=("LOAD", "FRICTION"),
    on_machines=lambda site, plant: True,
)


@law
def level(motor, load, k_motor, k_external):
    """Friction level for a `motor` force and the `load` of gravity and environment [N or N m]."""
    return abs(k_external * load - k_motor * motor)
