"""Reflected rotor inertia: the motor's inertia times the square of the gear ratio, at the joint."""

from wipx.core.effect import JOINT_SITES, Effect
from wipx.core.parameters import Parameter

EFFECT = Effect(
    kind="rotor_inertia",
    words="reflected rotor inertia on {place}",
    sites=JOINT_SITES,
    parameters=(Parameter("J", "reflected inertia", "inertia", 0.0, 0.0, 10.0, 0.1, grid=(0.05,)),),
    law="-J v'",
    linear_in=("J",),
    source="Spong 1987, Modeling and control of elastic joint robots, ASME JDSMC 109(4)",
    outside_vocabulary=True,
    rows={"ROTOR": "J"},
    linear_at_rest="rotor_inertia",
    built_in="armature",
    on_machines=lambda site, plant: len(plant.joints) > 1 and site != "pitch",  # elsewhere a mass or inertia as well
)
