"""What real machines have beside their laws, drawn by its consequence for the robot at hand.

Here is what changes the motion or what the encoders show; what only the log does to it is in `blemishes`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

import numpy as np
from scipy.signal import lfilter

from wipx.proof.blind_robots.physics import DRIVEN, JOINT, MOVING
from wipx.proof.blind_robots.robots import log_uniform
from wipx.proof.blind_robots.scenario import Scenario
from wipx.proof.blind_robots.sizes import Draw

Fields = Mapping[str, float | Mapping[int, float]]
FEWEST, MOST = 4, 7  # kinds of dirt on one robot
LARGEST = 1.25  # scale; sizes are drawn so that at this scale they reach the ends of the intervals that are told
WANDERING = (0.05, 0.1, 0.2, 0.35, 0.5)  # [Hz], of the sines that a wandering friction is made of
FRICTION = ("coulomb", "stribeck", "presliding", "viscous", "sticky_spot")  # laws whose level can wander


@dataclass(frozen=True)
class Belt:
    """A spring with damping between drive and link.

    Attributes:
        mass: Of the drive, part of the cart's [kg].
        frequency: At which the drive swings against the standing link [Hz].
        damping: Share of critical damping.
        motor_side: Whether the encoder sits on the drive.
    """

    mass: float
    frequency: float
    damping: float
    motor_side: bool

    def fields(self, scale: float) -> Fields:
        """Fields of the record; compliance grows with `scale`."""
        rate = 2.0 * pi * self.frequency / scale**0.5
        return {
            "drive_mass": self.mass,
            "belt_stiffness": self.mass * rate**2,
            "belt_damping": 2.0 * self.damping * self.mass * rate,
            "belt_motor_side": float(self.motor_side),
        }


@dataclass(frozen=True)
class Dirt:
    """Deviations of a robot from its laws, at a scale of 1.

    Attributes:
        names: What there is, in words.
        sizes: Fields of the record that grow with the scale; by joint where they have an entry for each.
        places: Fields that do not: wave numbers, phases, units.
        power: Power of the Stribeck curve by joint, 2 at a scale of 0.
        bump: Static over kinetic friction beyond 1, by joint, of friction that has one level only for its owner.
        levels: That friction's level by joint [N, N m].
        belt: Between drive and link; None for a stiff one.
        errors: Relative errors of nominal numbers that the owner takes for exact.
    """

    names: tuple[str, ...] = ()
    sizes: Fields = field(default_factory=dict)
    places: Fields = field(default_factory=dict)
    power: Mapping[int, float] = field(default_factory=dict)
    bump: Mapping[int, float] = field(default_factory=dict)
    levels: Mapping[int, float] = field(default_factory=dict)
    belt: Belt | None = None
    errors: Mapping[str, float] = field(default_factory=dict)

    def fields(self, scale: float) -> Fields:
        """Fields of the record at a scale."""
        grown: dict[str, float | Mapping[int, float]] = {
            name: {joint: scale * size for joint, size in value.items()}
            if isinstance(value, Mapping)
            else scale * value
            for name, value in self.sizes.items()
        }
        if self.power:
            grown["bump_power"] = {joint: 2.0 * (power / 2.0) ** scale for joint, power in self.power.items()}
        if self.bump:
            grown["static"] = {joint: self.levels[joint] * (1.0 + scale * size) for joint, size in self.bump.items()}
        return {**grown, **self.places, **({} if self.belt is None else self.belt.fields(scale))}

    def parameters(self, nominal: Mapping[str, float], scale: float) -> dict[str, float]:
        """The true rigid body [SI] of a robot whose owner has the nominal one."""
        return {name: value / (1.0 + scale * self.errors.get(name, 0.0)) for name, value in nominal.items()}


def draw_dirt(friction: Mapping[str, Mapping[str, float]], others: tuple[str, ...], draw: Draw) -> Dirt:
    """Several kinds of dirt.

    Args:
        friction: Effects with friction that the robot has, hidden or known, by "site/kind".
        others: Names of its other effects.
        draw: What sizes are drawn from.
    """
    rng = draw.rng
    frictions = {name: values for name, values in friction.items() if name.partition("/")[2] in FRICTION}
    kinds = {
        "wandering friction": lambda: _wandering(frictions, draw),
        "uneven friction": lambda: _uneven(frictions, draw),
        "Stribeck curve of another shape": lambda: _shape(frictions, draw),
        "forces from outside": lambda: _forces(draw),
        "belt": lambda: _belt(draw),
        "eccentric encoder": lambda: _eccentric(draw),
        "sagging drive": lambda: _sagging(draw),
        "nominal errors": lambda: _errors(draw),
    }
    if not frictions:
        del kinds["wandering friction"], kinds["uneven friction"]
    if not any(name.endswith(("/coulomb", "/stribeck")) for name in frictions):
        del kinds["Stribeck curve of another shape"]
    if draw.robot.kind not in ("wip", "cartpole", "linear_axis") or "actuator/backlash" in others:
        del kinds["belt"]
    count = min(int(rng.integers(FEWEST, MOST + 1)), len(kinds))
    return _together([kinds[name]() for name in sorted(rng.permutation(list(kinds))[:count])])


def _together(parts: list[Dirt]) -> Dirt:
    """All of them on one robot; no two set the same field."""
    return Dirt(
        tuple(name for part in parts for name in part.names),
        {name: value for part in parts for name, value in part.sizes.items()},
        {name: value for part in parts for name, value in part.places.items()},
        {joint: power for part in parts for joint, power in part.power.items()},
        {joint: size for part in parts for joint, size in part.bump.items()},
        {joint: level for part in parts for joint, level in part.levels.items()},
        next((part.belt for part in parts if part.belt is not None), None),
        {name: error for part in parts for name, error in part.errors.items()},
    )


def _joints(frictions: Mapping[str, Mapping[str, float]]) -> list[int]:
    return sorted({JOINT[name.partition("/")[0]] for name in frictions})


def _wandering(frictions: Mapping[str, Mapping[str, float]], draw: Draw) -> Dirt:
    """A friction level that wanders by 10 to 25 % with time, and as much with place or load."""
    rng, doing = draw.rng, draw.doing
    names, sizes, places = ["friction wanders with time"], {}, {}
    joints = _joints(frictions)
    driven = DRIVEN[draw.robot.kind]
    sizes["wander"] = {joint: rng.uniform(0.1, 0.25 / LARGEST) for joint in joints}
    if rng.random() < 0.6:
        names.append("friction wanders with place")
        sizes["wander_place"] = {joint: rng.uniform(0.1, 0.25 / LARGEST) for joint in joints}
        # one to four periods within the motion
        places["wander_number"] = {
            j: 2.0 * pi * rng.uniform(1.0, 4.0) / max(4.0 * doing.spread[j], 1e-6) for j in joints
        }
        places["wander_phase"] = {joint: rng.uniform(-pi, pi) for joint in joints}
    if rng.random() < 0.5:
        names.append("friction wanders with load")
        sizes["wander_load"] = {joint: rng.uniform(0.1, 0.25 / LARGEST) for joint in joints}
        places["usual_load"] = {joint: doing.force[joint if joint in driven else driven[0]] for joint in joints}
    return Dirt(tuple(names), sizes, places)


def _uneven(frictions: Mapping[str, Mapping[str, float]], draw: Draw) -> Dirt:
    """Friction that differs by 5 to 15 % between directions."""
    rng = draw.rng
    uneven = {joint: rng.choice([-0.5, 0.5]) * rng.uniform(0.05, 0.15 / LARGEST) for joint in _joints(frictions)}
    return Dirt(("friction uneven",), {"uneven": uneven})


def _shape(frictions: Mapping[str, Mapping[str, float]], draw: Draw) -> Dirt:
    """A Stribeck curve of another power than 2, and a small one where the owner's law or the hidden one has none."""
    rng = draw.rng
    power, bump, levels, speeds = {}, {}, {}, {}
    for name, values in frictions.items():
        joint = JOINT[name.partition("/")[0]]
        if name.endswith("/stribeck"):
            power[joint] = rng.uniform(0.5, 1.5)
        elif name.endswith("/coulomb"):
            power[joint] = rng.uniform(0.5, 1.5)
            bump[joint], levels[joint] = rng.uniform(0.1, 0.3 / LARGEST), values["F_c"]
            speeds[joint] = rng.uniform(0.1, 0.4) * draw.doing.speed[joint]
    places = {"bump_speed": speeds} if speeds else {}
    return Dirt(("Stribeck curve of another shape",), {}, places, power, bump, levels)


def _forces(draw: Draw) -> Dirt:
    """Coloured forces on every joint, 1 to 3 % of the command."""
    push = {
        joint: draw.rng.uniform(0.01, 0.03 / LARGEST) * draw.doing.force[joint] for joint in MOVING[draw.robot.kind]
    }
    return Dirt(("forces from outside",), {"push": push})


def _belt(draw: Draw) -> Dirt:
    """A belt that is stiff, but not rigid."""
    p, rng = draw.robot.parameters, draw.rng
    cart = p["wheel_mass"] + p.get("wheel_inertia", 0.0) / p.get("wheel_radius", 1.0) ** 2
    belt = Belt(
        rng.uniform(0.15, 0.4) * cart, log_uniform(rng, 15.0, 40.0), rng.uniform(0.03, 0.15), bool(rng.random() < 0.5)
    )
    return Dirt(("belt",), belt=belt)


def _eccentric(draw: Draw) -> Dirt:
    """An encoder whose error comes back with every turn; what it shows changes by 0.5 to 3 % too fast or too slowly."""
    rng, kind = draw.rng, draw.robot.kind
    joint = int(rng.choice(MOVING[kind]))
    if joint == 0 and kind != "double_pendulum":
        number = 1.0 / draw.robot.parameters.get("wheel_radius", 0.02)  # once in a turn of the wheel
    else:
        number = float(rng.integers(2, 21))  # turns of an encoder behind a gear
    size = rng.uniform(0.005, 0.03 / LARGEST) / number
    places = {"wobble_number": {joint: number}, "wobble_phase": {joint: rng.uniform(-pi, pi)}}
    return Dirt(("eccentric encoder",), {"wobble": {joint: size}}, places)


def _sagging(draw: Draw) -> Dirt:
    """A drive that loses 3 to 10 % in ten seconds, or at its usual load, about a mean that the owner knows."""
    rng, usual = draw.rng, draw.doing.force[DRIVEN[draw.robot.kind][0]]
    by_time, by_load = rng.uniform(0.003, 0.01 / LARGEST), rng.uniform(0.03, 0.1 / LARGEST) / usual
    which = int(rng.integers(1, 4))
    sizes = {**({"gain_drift": -by_time} if which & 1 else {}), **({"sag": by_load} if which & 2 else {})}
    names = (("drive sags with time",) if which & 1 else ()) + (("drive sags with load",) if which & 2 else ())
    return Dirt(names, sizes, {"drift_middle": 4.0, "sag_middle": usual})


def _errors(draw: Draw) -> Dirt:
    """Nominal numbers that are wrong by 1 to 2 %, and not listed as uncertain."""
    rng = draw.rng
    names = [name for name in draw.robot.parameters if name != "gravity" and draw.robot.parameters[name] > 0.0]
    if draw.robot.kind == "linear_axis":
        names = ["body_mass", "wheel_mass"]
    count = int(rng.integers(1, min(4, len(names)) + 1))
    errors = {
        name: rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.02 / LARGEST)
        for name in rng.permutation(names)[:count].tolist()
    }
    return Dirt(("nominal errors",), errors=errors)


def draw_waves(scenario: Scenario, rng: np.random.Generator) -> np.ndarray:
    """Forces from outside and wandering of friction for a run, unit variance, shape (n, 4).

    Forces are Ornstein-Uhlenbeck processes with correlation times of 0.03 to 0.5 s.
    """
    t = scenario.instants[:-1]
    step = float(np.median(np.diff(t)))
    waves = np.empty((len(t), 4))
    for joint in range(2):
        keep = np.exp(-step / log_uniform(rng, 0.03, 0.5))
        white = rng.standard_normal(len(t)) * np.sqrt(1.0 - keep**2)
        white[0] = rng.standard_normal()
        waves[:, joint] = lfilter([1.0], [1.0, -keep], white)
        phases = rng.uniform(0.0, 2.0 * pi, len(WANDERING))
        sines = np.sin(2.0 * pi * np.outer(t, WANDERING) + phases)
        waves[:, 2 + joint] = sines.sum(axis=1) * np.sqrt(2.0 / len(WANDERING))
    return waves
