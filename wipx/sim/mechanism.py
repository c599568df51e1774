"""The rigid body of a model as a tree: what physics engines are told (`wipx.sim.mjcf`, `wipx.sim.urdf`).

Geometry and environment act here: payloads and shifted centres of mass are part of their links, a rail that is not
level has a tilted joint, a tilted base turns gravity, reflected rotor inertia is an inertia of the joint. A payload
that comes during a recording stays a mass of its own. The ground has z up; the plants of the contract's section 2 move
in its x-z plane, so that a hinge about -y turns an upright body towards -x.
"""

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link, Tree
from wipx.sim.tree.inertias import gravity, inertial_numbers, lumped

LEAST = 1e-12  # [kg, kg m^2]; engines refuse bodies without mass or inertia
ROUNDED = 1e-9  # relative; by so much moments of inertia may be wrong
EVENT = "payload_event"  # effect whose mass comes during a recording


@dataclass(frozen=True, eq=False)
class ComingLoad:
    """A point mass that is fixed to a link during a recording.

    Attributes:
        link: Number of the link.
        mass: [kg].
        place: In the body's own frame, shape (3,) [m].
    """

    link: int
    mass: float
    place: np.ndarray


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Links of a model with what geometry and environment make of them.

    Attributes:
        tree: Masses, inertias and gravity as the model has them; armature with reflected rotor inertia.
        coming: The payload of a payload event; None without one.
    """

    tree: Tree
    coming: ComingLoad | None = None


def mechanism(model: Model) -> Mechanism:
    """The links of a model from the ground on."""
    plant = model.plant
    if plant.tree is not None:
        return _robot(model, plant.tree)
    if plant.kind == "double_pendulum":
        return Mechanism(_tree(model, _double_pendulum(model)))
    links = {"pendulum": (_pole,), "linear_axis": (_carriage,)}.get(plant.kind, (_carriage, _pole))
    return Mechanism(
        _tree(model, tuple(link(model, i - 1) for i, link in enumerate(links))), _coming(model, len(links))
    )


def check_possible(model: Model, who: str, otherwise: str) -> None:
    """Refuse what is no rigid body.

    Args:
        model: To be simulated.
        who: Cannot do it, e.g. "sim=mujoco".
        otherwise: What to do where the number is right, e.g. ", or use sim=analytic".

    Raises:
        InputError: a mass is negative, or an inertia is that of no body.
    """
    if model.plant.tree is not None:
        for link in mechanism(model).tree.links:
            _check_link(link, who, otherwise)
        return
    for name in ("geometry/payload", f"geometry/{EVENT}"):
        mass = value(model, name, "mass", 0.0)
        if mass < 0.0:
            raise InputError(
                f"{who} cannot do {name} with mass = {mass:g} kg, expected none or more; "
                f"lower body_mass instead{otherwise}"
            )
    for link in mechanism(model).tree.links if model.plant.kind == "double_pendulum" else ():
        lacking = -float(link.inertia[0, 0])
        if lacking > 0.0:
            raise InputError(
                f"{who} cannot do a double_pendulum whose {link.body} is lighter to turn than a point mass "
                f"({link.body}_inertia lacks {lacking:g} kg m^2); correct {link.body}_inertia{otherwise}"
            )


def _check_link(link: Link, who: str, otherwise: str) -> None:
    """Refuse a link of a robot from a model file that is no rigid body."""
    least, middle, most = np.linalg.eigvalsh(link.inertia)
    allowed = ROUNDED * max(most, LEAST)
    if link.mass < 0.0 or least < -allowed or least + middle < most - allowed:
        raise InputError(
            f"{who} cannot do link {link.body} with a mass of {link.mass:g} kg and moments of inertia of "
            f"{least:.3g}, {middle:.3g} and {most:.3g} kg m^2, which no rigid body has; correct {link.body}.mass, "
            f"{link.body}.inertia or link_{link.body}/payload{otherwise}"
        )


def value(model: Model, effect: str, symbol: str, neutral: float) -> float:
    """A number of an effect, or what amounts to its absence."""
    return model.effects.get(effect, {}).get(symbol, neutral)


def _robot(model: Model, tree: Tree) -> Mechanism:
    """A robot from a model file with the numbers and the effects of a model."""
    batch = ModelBatch(model)
    links = []
    for link in tree.links:
        mass, com, inertia = lumped(inertial_numbers(batch, link)[:, 0])
        armature = model.value(f"{link.joint}.armature") + value(model, f"{link.joint}/rotor_inertia", "J", 0.0)
        links.append(replace(link, mass=mass, com=com, inertia=inertia, armature=armature))
    return Mechanism(Tree(tuple(links), gravity(batch, tree)[:, 0]))


def _tree(model: Model, links: tuple[Link, ...]) -> Tree:
    """A tree of links that are given relative to axes parallel to the ground's."""
    chained = []
    for link in links:
        below = links[link.parent].body_rotation if link.parent >= 0 else np.eye(3)
        chained.append(replace(link, rotation=below @ link.rotation, place=below @ link.place))
    return Tree(tuple(chained), np.array([0.0, 0.0, -model.parameters["gravity"]]))


def _link(body: str, joint: str, axis: np.ndarray, *, slides: bool, parent: int = -1, up: float = 0.0) -> Link:
    """A link without mass whose body stands parallel to the ground, `up` [m] above the body below it.

    Its frame turns z to the joint's axis, which lies in the x-z plane or along y.
    """
    across = np.array([axis[2], 0.0, -axis[0]]) if abs(axis[1]) < 1.0 else np.array([1.0, 0.0, 0.0])
    turn = np.stack([across, np.cross(axis, across), axis], axis=1)
    zero = np.zeros(3)
    place = np.array([0.0, 0.0, up])
    return Link(joint, body, parent, slides, turn, place, 0.0, zero, np.zeros((3, 3)), turn.T, zero)


def _filled(link: Link, points: tuple[tuple[float, float, float], ...], inertia: float) -> Link:
    """A link with point masses (mass, across, up) in its body's frame, and an inertia about their common centre."""
    turn = link.body_rotation
    masses = np.array([mass for mass, _, _ in points])
    places = np.array([turn @ (across, 0.0, up) for _, across, up in points])
    total = float(masses.sum())
    com = masses @ places / total if total else np.zeros(3)
    about = inertia * np.eye(3)
    for mass, place in zip(masses, places - com, strict=True):
        about += mass * (place @ place * np.eye(3) - np.outer(place, place))
    return replace(link, mass=total, com=com, inertia=about)


def _carriage(model: Model, parent: int) -> Link:
    """What moves along the rail; the wheels' turning resists like a mass I_w / r^2 on which no weight acts."""
    p = model.parameters
    tilt = value(model, "environment/rail_tilt", "angle", 0.0)
    rolling = p["wheel_inertia"] / p["wheel_radius"] ** 2 + value(model, "translation/rotor_inertia", "J", 0.0)
    link = _link("wheel", "translation", np.array([cos(tilt), 0.0, sin(tilt)]), slides=True, parent=parent)
    masses = [(p["wheel_mass"], 0.0, 0.0)]
    if model.plant.kind == "linear_axis":
        masses += [(p["body_mass"], 0.0, 0.0), *_payload(model)]
    return replace(_filled(link, tuple(masses), 0.0), armature=rolling)


def _pole(model: Model, parent: int) -> Link:
    p = model.parameters
    inertia = p["body_inertia"] * value(model, "geometry/inertia", "scale", 1.0)
    balance = value(model, "geometry/com_offset", "theta_eq", 0.0)
    link = _link("pole", "pitch", np.array([0.0, -1.0, 0.0]), slides=False, parent=parent)
    own = (p["body_mass"], p["com_height"] * sin(balance), p["com_height"] * cos(balance))
    rotor = value(model, "pitch/rotor_inertia", "J", 0.0)
    return replace(_filled(link, (own, *_payload(model)), inertia), armature=rotor)


def _payload(model: Model) -> tuple[tuple[float, float, float], ...]:
    """A point mass on the axis of the pole's centre of mass, or on the carriage where there is no pole."""
    name = "geometry/payload"
    return ((model.effects[name]["mass"], *_load_place(model, name)),) if name in model.effects else ()


def _load_place(model: Model, name: str) -> tuple[float, float]:
    balance = value(model, "geometry/com_offset", "theta_eq", 0.0)
    height = model.effects[name]["height"] if "com_height" in model.parameters else 0.0
    return height * sin(balance), height * cos(balance)


def _coming(model: Model, links: int) -> ComingLoad | None:
    name = f"geometry/{EVENT}"
    if name not in model.effects:
        return None
    across, up = _load_place(model, name)
    return ComingLoad(links - 1, model.effects[name]["mass"], np.array([across, 0.0, up]))


def _double_pendulum(model: Model) -> tuple[Link, ...]:
    """Two links that hang; their inertias are given about their joints."""
    p = model.parameters
    links = []
    for i, up in ((1, 0.0), (2, -p["link1_length"])):
        mass, com = p[f"link{i}_mass"], p[f"link{i}_com"]
        link = _link(f"link{i}", f"joint{i}", np.array([0.0, -1.0, 0.0]), slides=False, parent=i - 2, up=up)
        own = _filled(link, ((mass, 0.0, -com),), p[f"link{i}_inertia"] - mass * com**2)
        links.append(replace(own, armature=value(model, f"joint{i}/rotor_inertia", "J", 0.0)))
    return tuple(links)
