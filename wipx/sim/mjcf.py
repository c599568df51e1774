"""A mechanism as MuJoCo's XML (MJCF).

Effects on the signals (delays, scales, biases) are not in it, and friction only where it is asked for.
"""

from wipx.core.model import Model
from wipx.sim.mechanism import LEAST, Link, Part, mechanism, value

BUILT_IN = ("viscous", "coulomb", "gain")  # what MuJoCo has as damping, frictionloss and gear


def mjcf(model: Model, step: float, *, built_in: tuple[str, ...] = ()) -> str:
    """The rigid body of a model as MuJoCo's XML.

    Args:
        model: Rigid body, geometry and environment.
        step: Of the integrator [s].
        built_in: Kinds of `BUILT_IN` that the joints and motors shall have as MuJoCo's own; others, and all by
            default, are left to whoever steps the engine.
    """
    plant = model.plant
    gain = value(model, "actuator/gain", "k", 1.0) if "gain" in built_in else 1.0
    gear = model.parameters["input_gain"] * gain
    motors = "".join(
        f'<motor name="{command}" joint="{joint}" gear="{gear!r}"/>'
        for command, joint in zip(plant.commands, plant.actuated, strict=True)
    )
    sensors = "".join(
        f'<jointpos name="{column}" joint="{joint}"/>'
        for joint, column in zip(plant.joints, plant.coordinates, strict=True)
    )
    bodies = ""
    for link in reversed(mechanism(model)):
        bodies = f'<body pos="0 0 {link.up!r}">{_joint(model, link, built_in)}{_masses(link)}{bodies}</body>'
    return (
        f'<mujoco><size memory="64K"/><option timestep="{step!r}" gravity="0 0 {-model.parameters["gravity"]!r}" '
        f'tolerance="1e-10"><flag contact="disable"/></option><worldbody>{bodies}</worldbody>'
        f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


def _joint(model: Model, link: Link, built_in: tuple[str, ...]) -> str:
    axis = " ".join(repr(x) for x in link.axis)
    damping = value(model, f"{link.joint}/viscous", "sigma", 0.0) if "viscous" in built_in else 0.0
    friction = value(model, f"{link.joint}/coulomb", "F_c", 0.0) if "coulomb" in built_in else 0.0
    return (
        f'<joint name="{link.joint}" type="{"slide" if link.slides else "hinge"}" axis="{axis}" '
        f'armature="{link.rotor!r}" damping="{damping!r}" frictionloss="{friction!r}"/>'
    )


def _masses(link: Link) -> str:
    fixed = "".join(f'<body name="{part.name}">{_inertial(part)}</body>' for part in link.parts[1:])
    return _inertial(link.parts[0]) + fixed


def _inertial(part: Part) -> str:
    about = max(part.inertia, LEAST)
    return (
        f'<inertial pos="{part.across!r} 0 {part.up!r}" mass="{max(part.mass, LEAST)!r}" '
        f'diaginertia="{about!r} {about!r} {about!r}"/>'
    )
