"""Physics that the vocabulary lacks, drawn by its consequence for the robot at hand."""

from collections.abc import Callable
from math import pi

from wipx.proof.blind_robots.physics import DRIVEN, JOINT, MOVING, UnmodelledPhysics
from wipx.proof.blind_robots.robots import log_uniform
from wipx.proof.blind_robots.sizes import Draw


def unmodelled_names(kind: str) -> tuple[str, ...]:
    """What can be drawn for a plant."""
    everywhere = ("cubic_regeneration", "gain_drift", "asymmetric_friction", "hysteresis")
    return everywhere + {
        "wip": ("sloshing", "flexible_body", "pitch_cogging", "wheel_slip", "wavy_friction"),
        "cartpole": ("sloshing", "flexible_body", "pitch_cogging", "wavy_friction"),
        "pendulum": ("sloshing", "flexible_body"),  # its cogging would be the ripple of its motor
        "linear_axis": ("sloshing", "wavy_friction"),
        "double_pendulum": (),
    }.get(kind, ())


def draw_unmodelled(name: str, draw: Draw) -> UnmodelledPhysics:
    """That physics with random numbers."""
    unmodelled = _DRAWN[name](name, draw)
    return UnmodelledPhysics(name, {key: float(value) for key, value in unmodelled.values.items()}, unmodelled.joint)


def _moving_mass(name: str, draw: Draw) -> UnmodelledPhysics:
    """A mass that slides on a spring: sloshing of a liquid, or the first bending mode of a body that is not stiff."""
    p, rng = draw.robot.parameters, draw.rng
    bends = name == "flexible_body"
    frequency = log_uniform(rng, 4.0, 10.0) if bends else rng.uniform(0.7, 2.0)
    damping = rng.uniform(0.005, 0.02) if bends else rng.uniform(0.02, 0.1)
    mass = p["body_mass"] * (rng.uniform(0.3, 0.5) if bends else rng.uniform(0.12, 0.3))
    rate = 2.0 * pi * frequency
    values = {"aux_mass": mass, "aux_stiffness": mass * rate**2, "aux_damping": 2.0 * damping * mass * rate}
    if "com_height" in p:
        # its moment of inertia must stay below the body's own, from which it is taken
        highest = p["com_height"] + (0.5 * p["body_inertia"] / mass) ** 0.5
        values["aux_height"] = highest if bends else rng.uniform(0.5, 1.0) * highest
    return UnmodelledPhysics(name, values)


def _cubic(name: str, draw: Draw) -> UnmodelledPhysics:
    """Force a v - b v^3: it feeds energy in below the speed sqrt(a/b), and takes it above."""
    joint = DRIVEN[draw.robot.kind][0]
    speed = draw.doing.speed[joint]
    feed = draw.rng.uniform(0.06, 0.2) * draw.doing.force[joint] / speed
    values = {"regeneration": feed, "regeneration_cubic": feed / (draw.rng.uniform(0.5, 1.2) * speed) ** 2}
    return UnmodelledPhysics(name, values, joint)


def _cogging(name: str, draw: Draw) -> UnmodelledPhysics:
    """Torque A sin(n theta + phase) of magnets at the pitch joint, of several periods within the motion."""
    way = 4.0 * draw.doing.spread[1]
    values = {
        "cog_torque": draw.rng.uniform(0.15, 0.4) * draw.doing.force[1],
        "cog_number": 2.0 * pi / way * draw.rng.uniform(1.5, 3.0),
        "cog_phase": draw.rng.uniform(-pi, pi),
    }
    return UnmodelledPhysics(name, values, 1)


def _drift(name: str, draw: Draw) -> UnmodelledPhysics:
    """A gain that changes by 15 to 40 % over ten seconds, as a motor that warms up."""
    return UnmodelledPhysics(name, {"gain_drift": draw.rng.choice([-1.0, 1.0]) * draw.rng.uniform(0.015, 0.04)})


def _asymmetric(name: str, draw: Draw) -> UnmodelledPhysics:
    """Dry and viscous friction of one size forwards and another one backwards (Bona and Indri 2005).

    Dry friction alone would not do: of two levels it is Coulomb friction and a constant force, which have names.
    """
    joint = draw.rng.choice(MOVING[draw.robot.kind])
    level, damping = draw.rng.uniform(0.08, 0.25, size=2) * draw.doing.force[joint]
    damping /= draw.doing.speed[joint]
    uneven, uneven_damping = draw.rng.choice([-1.0, 1.0], size=2) * draw.rng.uniform(0.4, 0.9, size=2)
    values = {
        "kinetic": level,
        "static": level,
        "one_sided": uneven * level,
        "viscous_forward": (1.0 + uneven_damping) * damping,
        "viscous_backward": (1.0 - uneven_damping) * damping,
    }
    return UnmodelledPhysics(name, values, int(joint))


def _hysteresis(name: str, draw: Draw) -> UnmodelledPhysics:
    """Elements that slip one after the other, over ways as long as the motion, unlike bristles."""
    joint = DRIVEN[draw.robot.kind][0]
    values = {
        "hysteresis": draw.rng.uniform(0.15, 0.4) * draw.doing.force[joint],
        "hysteresis_length": draw.rng.uniform(0.3, 1.0) * draw.doing.spread[joint],
        "hysteresis_first": draw.rng.uniform(0.2, 0.8),
    }
    return UnmodelledPhysics(name, values, joint)


def _wheel_slip(name: str, draw: Draw) -> UnmodelledPhysics:
    """The wheel creeps on the ground, and slides where the force exceeds the traction."""
    p = draw.robot.parameters
    values = {
        "drive_mass": p["wheel_inertia"] / p["wheel_radius"] ** 2,
        "traction": draw.rng.uniform(0.6, 1.0) * draw.doing.peak,
        "creep": draw.doing.force[0] / draw.doing.speed[0] * log_uniform(draw.rng, 10.0, 40.0),
    }
    return UnmodelledPhysics(name, values)


def _wavy(name: str, draw: Draw) -> UnmodelledPhysics:
    """Dry friction F (1 + sin(k x + phase)) along the rail."""
    values = {
        "rail_level": draw.rng.uniform(0.08, 0.25) * draw.doing.force[JOINT["translation"]],
        "rail_wavenumber": 2.0 * pi / (draw.doing.spread[0] * draw.rng.uniform(0.8, 2.0)),
        "rail_phase": draw.rng.uniform(-pi, pi),
    }
    return UnmodelledPhysics(name, values)


_DRAWN: dict[str, Callable[[str, Draw], UnmodelledPhysics]] = {
    "sloshing": _moving_mass,
    "flexible_body": _moving_mass,
    "cubic_regeneration": _cubic,
    "pitch_cogging": _cogging,
    "gain_drift": _drift,
    "asymmetric_friction": _asymmetric,
    "hysteresis": _hysteresis,
    "wheel_slip": _wheel_slip,
    "wavy_friction": _wavy,
}
