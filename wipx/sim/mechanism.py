"""The rigid body of a model as links and joints: what physics engines are told (`wipx.sim.mjcf`, `wipx.sim.urdf`).

Geometry and environment act here: payloads are masses of their own on the pole, a centre of mass beside the axis turns
the pole's masses, a rail that is not level has a tilted joint, reflected rotor inertia is an inertia of the joint.
The frame has z up and y into the page, so that a hinge about -y turns an upright body towards -x, as contract
section 2 has it.
"""

from dataclasses import dataclass
from math import cos, sin

from wipx.core.errors import InputError
from wipx.core.model import Model

LEAST = 1e-12  # [kg, kg m^2]; engines refuse bodies without mass or inertia
EVENT = "payload_event"  # part whose mass comes during a recording


@dataclass(frozen=True)
class Part:
    """A rigid piece of a link.

    Attributes:
        name: E.g. "pole".
        mass: [kg].
        inertia: About its centre of mass [kg m^2].
        across: Of its centre of mass in the link's frame, along x [m].
        up: Along z [m].
    """

    name: str
    mass: float
    inertia: float
    across: float = 0.0
    up: float = 0.0


@dataclass(frozen=True)
class Link:
    """A link and the joint that carries it.

    Attributes:
        joint: Site of the joint.
        slides: Whether it slides; else it turns.
        axis: Unit vector.
        up: Of the joint in the frame of the link below, along z [m].
        rotor: Inertia at the joint that gravity does not act on [kg or kg m^2].
        parts: The link itself, then what is fixed to it.
    """

    joint: str
    slides: bool
    axis: tuple[float, float, float]
    up: float
    rotor: float
    parts: tuple[Part, ...]


def mechanism(model: Model) -> tuple[Link, ...]:
    """The links of a model from the ground on, the payload of a payload event with all its mass."""
    kind = model.plant.kind
    if kind == "double_pendulum":
        return _double_pendulum(model)
    if kind == "pendulum":
        return (_pole(model),)
    if kind == "linear_axis":
        return (_carriage(model, (Part("body", model.parameters["body_mass"], LEAST), *_payloads(model))),)
    return _carriage(model, ()), _pole(model)


def check_possible(model: Model, engine: str) -> None:
    """Refuse what is no rigid body.

    Args:
        model: To be simulated.
        engine: As `sim=` names it.

    Raises:
        InputError: a mass is negative, or an inertia smaller than that of a point mass.
    """
    if model.plant.tree is not None:
        raise InputError(f"sim={engine} cannot step a robot from a model file yet; use sim=analytic")
    for name in ("geometry/payload", "geometry/payload_event"):
        mass = value(model, name, "mass", 0.0)
        if mass < 0.0:
            raise InputError(
                f"sim={engine} cannot do {name} with mass = {mass:g} kg, expected none or more; "
                f"lower body_mass instead, or use sim=analytic"
            )
    for link in mechanism(model):
        own = link.parts[0]
        if own.inertia < 0.0:
            raise InputError(
                f"sim={engine} cannot do a {model.plant.kind} whose {own.name} is lighter to turn than a point mass "
                f"({own.name}_inertia lacks {-own.inertia:g} kg m^2); correct {own.name}_inertia or use sim=analytic"
            )


def value(model: Model, effect: str, symbol: str, neutral: float) -> float:
    """A number of an effect, or what amounts to its absence."""
    return model.effects.get(effect, {}).get(symbol, neutral)


def _carriage(model: Model, loads: tuple[Part, ...]) -> Link:
    """What moves along the rail; the wheels' turning resists like a mass I_w / r^2 on which no weight acts."""
    p = model.parameters
    tilt = value(model, "environment/rail_tilt", "angle", 0.0)
    rolling = p["wheel_inertia"] / p["wheel_radius"] ** 2 + value(model, "translation/rotor_inertia", "J", 0.0)
    wheel = Part("wheel", p["wheel_mass"], LEAST)
    return Link("translation", True, (cos(tilt), 0.0, sin(tilt)), 0.0, rolling, (wheel, *loads))


def _pole(model: Model) -> Link:
    p = model.parameters
    inertia = p["body_inertia"] * value(model, "geometry/inertia", "scale", 1.0)
    balance = value(model, "geometry/com_offset", "theta_eq", 0.0)
    own = Part("pole", p["body_mass"], inertia, p["com_height"] * sin(balance), p["com_height"] * cos(balance))
    rotor = value(model, "pitch/rotor_inertia", "J", 0.0)
    return Link("pitch", False, (0.0, -1.0, 0.0), 0.0, rotor, (own, *_payloads(model)))


def _payloads(model: Model) -> tuple[Part, ...]:
    """Points on the axis of the pole's centre of mass, or on the carriage where there is no pole."""
    balance = value(model, "geometry/com_offset", "theta_eq", 0.0)
    parts = []
    for kind in ("payload", EVENT):
        name = f"geometry/{kind}"
        if name in model.effects:
            height = model.effects[name]["height"] if "com_height" in model.parameters else 0.0
            mass = model.effects[name]["mass"]
            parts.append(Part(kind, mass, LEAST, height * sin(balance), height * cos(balance)))
    return tuple(parts)


def _double_pendulum(model: Model) -> tuple[Link, ...]:
    """Two links that hang; their inertias are given about their joints."""
    p = model.parameters
    links = []
    for i, up in ((1, 0.0), (2, -p["link1_length"])):
        mass, com = p[f"link{i}_mass"], p[f"link{i}_com"]
        own = Part(f"link{i}", mass, p[f"link{i}_inertia"] - mass * com**2, 0.0, -com)
        rotor = value(model, f"joint{i}/rotor_inertia", "J", 0.0)
        links.append(Link(f"joint{i}", False, (0.0, -1.0, 0.0), up, rotor, (own,)))
    return tuple(links)
