"""Which effects a tree has: 0 to 3 for each joint, none twice of the same physics."""

from math import pi

import numpy as np

from wipx.proof.blind_robots.robots import log_uniform
from wipx.proof.blind_robots.trees.physics import UnmodelledPhysics
from wipx.proof.blind_robots.trees.robots import Robot
from wipx.proof.blind_robots.trees.sizes import Draw

PER_JOINT = (0.3, 0.35, 0.25, 0.1)  # share of the joints with 0, 1, 2 and 3 effects
COMMON = (
    0.12  # of the robots with effects that have a common delay of all drives; as many have a base that is not level
)
LIKELY = ("viscous", "coulomb", "stribeck", "load_friction", "rotor_inertia")  # drawn twice as often as others
AT_JOINT = (
    "viscous", "coulomb", "stribeck", "presliding", "asymmetric_coulomb", "quadratic_drag", "load_friction",
    "sticky_spot", "rotor_inertia", "spring",
)  # fmt: skip
AT_DRIVE = (
    "gain", "offset", "dead_zone", "delay", "lag", "saturation", "speed_limit", "ripple", "backlash", "elasticity",
)  # fmt: skip
AT_SERVO = ("kp", "kd")
BEFORE_THE_MOTOR = ("delay", "dead_zone", "lag", "saturation", "speed_limit")  # a log of the motor's force hides them
AT_SENSOR = ("bias", "scale", "delay")
AT_LINK = ("payload", "com_offset", "inertia")
FAMILIES = {
    "dry friction": (
        "coulomb", "stribeck", "presliding", "asymmetric_coulomb", "load_friction", "sticky_spot",
    ),
    "damping": ("viscous", "quadratic_drag", "kd"),
    "timing": ("delay", "lag"),
    "limit": ("saturation", "speed_limit"),
    "play": ("dead_zone", "backlash", "elasticity"),
    "constant": ("offset", "bias", "asymmetric_coulomb", "spring"),
    "mass": ("payload", "com_offset", "inertia", "rotor_inertia"),
    "scale": ("gain", "scale", "kp"),
    "place": ("ripple", "sticky_spot"),
}  # fmt: skip
UNMODELLED = ("cable", "flexible_link", "hysteresis", "slosh")


def effects_of(robot: Robot, j: int, known: frozenset[str]) -> tuple[str, ...]:
    """What can be hidden at a joint, its drive, its sensor and its link, "site/kind".

    Args:
        robot: The robot.
        j: Number of the joint.
        known: Kinds that those know who are to find them.
    """
    link, drive = robot.links[j], robot.drives[j]
    names = [f"{link.joint}/{kind}" for kind in AT_JOINT]
    if drive.kind != "none":
        kinds = AT_DRIVE + (AT_SERVO if drive.kind == "position" else ())
        hidden = BEFORE_THE_MOTOR if drive.logged == "motor" else ()
        barred = ("elasticity",) if drive.kind == "position" else ()
        names += [f"actuator_{link.joint}/{kind}" for kind in kinds if kind not in hidden + barred]
    names += [f"sensor_{link.joint}/{kind}" for kind in AT_SENSOR]
    names += [f"link_{link.body}/{kind}" for kind in AT_LINK]
    return tuple(name for name in names if name.partition("/")[2] in known)


def choose(robot: Robot, count: int | None, known: frozenset[str], rng: np.random.Generator) -> tuple[str, ...]:
    """Names of effects.

    Args:
        robot: The robot.
        count: How many in all; None for 0 to 3 for each joint.
        known: Kinds that those know who are to find them.
        rng: Of the choice.
    """
    joints = len(robot.links)
    if count is None:
        wanted = rng.choice(len(PER_JOINT), joints, p=PER_JOINT)
        wanted[rng.integers(joints)] = max(wanted.max(), 1)
    else:
        wanted = np.bincount(rng.integers(joints, size=count), minlength=joints)
    names: list[str] = []
    driven = [drive for drive in robot.drives if drive.kind != "none"]
    if count is None and joints > 1 and rng.random() < COMMON and all(drive.logged == "command" for drive in driven):
        names.append("actuator/delay")
    if count is None and rng.random() < COMMON:
        names.append("environment/base_tilt")
    for j, number in enumerate(wanted):
        taken = set().union(*(families(name) for name in names if name in ("actuator/delay", "environment/base_tilt")))
        pool = effects_of(robot, j, known)
        weights = np.array([2.0 if name.partition("/")[2] in LIKELY else 1.0 for name in pool])
        order = rng.choice(len(pool), len(pool), replace=False, p=weights / weights.sum())
        chosen = 0
        for name in (pool[i] for i in order):
            if chosen < number and not families(name) & taken:
                names.append(name)
                taken |= families(name)
                chosen += 1
    return tuple(names)


def families(name: str) -> set[str]:
    """What an effect has in common with those that must not be drawn beside it at the same joint."""
    kind = name.partition("/")[2]
    if kind == "base_tilt":
        return {"base_tilt", "constant"}
    return {group for group, kinds in FAMILIES.items() if kind in kinds} or {kind}


def draw_unmodelled(name: str, draw: Draw) -> UnmodelledPhysics:
    """That physics with random numbers."""
    j, values = _DRAWN[name](draw)
    return UnmodelledPhysics(name, j, {symbol: float(value) for symbol, value in values.items()})


def unmodelled_of(robot: Robot) -> tuple[str, ...]:
    """Physics outside the vocabulary that a robot can have."""
    return UNMODELLED if len(robot.links) > 1 else tuple(name for name in UNMODELLED if name != "cable")


def _cable(draw: Draw):
    """A hose or cable over two neighbouring joints, taut on one side of its middle."""
    j = int(draw.rng.integers(1, len(draw.robot.links)))
    i = draw.robot.links[j].parent if draw.robot.links[j].parent >= 0 else 0
    arms = draw.sign() / draw.doing.spread[i], draw.sign() / draw.doing.spread[j]  # stretch in standard deviations
    level = draw.rng.uniform(0.2, 0.5) * min(
        draw.doing.force[i] * draw.doing.spread[i], draw.doing.force[j] * draw.doing.spread[j]
    )
    slack = arms[0] * draw.doing.middle[i] + arms[1] * draw.doing.middle[j] + draw.rng.uniform(-1.0, 0.3)
    values = {"first": i, "second": j, "first_arm": arms[0], "second_arm": arms[1], "stiffness": level}
    return j, {**values, "damping": 0.02 * level, "slack": slack}


def _hysteresis(draw: Draw):
    """Elements that slip one after the other, over ways as long as the motion, unlike bristles."""
    j = int(draw.rng.integers(len(draw.robot.links)))
    size = draw.rng.uniform(0.15, 0.4) * draw.doing.force[j]
    return j, {"hysteresis": size, "hysteresis_way": draw.rng.uniform(0.5, 1.5) * draw.doing.spread[j]}


def _flexible_link(draw: Draw):
    """A link that bends in its middle, at 4 to 10 Hz with all that it carries."""
    j = int(draw.rng.integers(max(1, len(draw.robot.links) - 1)))
    link = draw.robot.links[j]
    carried = sum(one.mass * (0.5 * link.length) ** 2 for one in draw.robot.links[j + 1 :])
    inertia = carried + 0.5 * (float(np.trace(link.inertia)) / 3.0 + link.mass * (0.3 * link.length) ** 2)
    rate = 2.0 * pi * log_uniform(draw.rng, 4.0, 10.0)
    return j, {"stiffness": inertia * rate**2, "damping": 2.0 * draw.rng.uniform(0.01, 0.03) * inertia * rate}


def _slosh(draw: Draw):
    """A part of the last link that slides on a spring, as a liquid in the hand."""
    j = len(draw.robot.links) - 1
    mass = draw.rng.uniform(0.2, 0.45) * draw.robot.links[j].mass
    rate = 2.0 * pi * draw.rng.uniform(1.5, 4.0)
    axis = draw.rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    values = {"mass": mass, "stiffness": mass * rate**2, "damping": 2.0 * draw.rng.uniform(0.02, 0.1) * mass * rate}
    return j, values | dict(zip(("axis_x", "axis_y", "axis_z"), axis, strict=True))


_DRAWN = {"cable": _cable, "hysteresis": _hysteresis, "flexible_link": _flexible_link, "slosh": _slosh}
