"""A mechanism as MuJoCo's XML (MJCF).

Effects on the signals (delays, scales, biases) are not in it, and friction only where it is asked for.
"""

from wipx.core.model import Model
from wipx.effects.catalogue import kind_of
from wipx.sim.mechanism import LEAST, Link, Part, mechanism

BUILT_IN = ("damping", "frictionloss", "gear")  # parameters of MuJoCo's that effects may be (`Effect.built_in`)


def mjcf(model: Model, step: float, *, built_in: tuple[str, ...] = ()) -> str:
    """The rigid body of a model as MuJoCo's XML.

    Args:
        model: Rigid body, geometry and environment.
        step: Of the integrator [s].
        built_in: Those of `BUILT_IN` that the joints and motors shall have; effects that are others, and all by
            default, are left to whoever steps the engine.
    """
    plant = model.plant
    gear = model.parameters["input_gain"] * (_own(model, "actuator", "gear", 1.0) if "gear" in built_in else 1.0)
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
    damping = _own(model, link.joint, "damping", 0.0) if "damping" in built_in else 0.0
    friction = _own(model, link.joint, "frictionloss", 0.0) if "frictionloss" in built_in else 0.0
    return (
        f'<joint name="{link.joint}" type="{"slide" if link.slides else "hinge"}" axis="{axis}" '
        f'armature="{link.rotor!r}" damping="{damping!r}" frictionloss="{friction!r}"/>'
    )


def _own(model: Model, site: str, parameter: str, absent: float) -> float:
    """What an effect at a site is as a parameter of MuJoCo's; `absent` where there is no such effect."""
    for name, values in model.effects.items():
        effect = kind_of(name)
        if name.startswith(f"{site}/") and effect.built_in == parameter:
            return values[effect.parameters[0].name]
    return absent


def _masses(link: Link) -> str:
    fixed = "".join(f'<body name="{part.name}">{_inertial(part)}</body>' for part in link.parts[1:])
    return _inertial(link.parts[0]) + fixed


def _inertial(part: Part) -> str:
    about = max(part.inertia, LEAST)
    return (
        f'<inertial pos="{part.across!r} 0 {part.up!r}" mass="{max(part.mass, LEAST)!r}" '
        f'diaginertia="{about!r} {about!r} {about!r}"/>'
    )
