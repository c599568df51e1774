"""Sizes of effects by their consequence: shares of the forces, speeds and ways of the robot at hand."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from wipx.core.plant import PLANTS
from wipx.proof.blind_robots.logging import Run
from wipx.proof.blind_robots.physics import DRIVEN, JOINT, MOVING
from wipx.proof.blind_robots.robots import Robot, log_uniform

Values = Mapping[str, float]


@dataclass(frozen=True)
class Consequences:
    """What a robot does in its recordings; entries by joint.

    Attributes:
        force: Root mean square of the commanded force; at a joint without a drive, of gravity's torque [N, N m].
        peak: Command that only one row in 500 exceeds, of the first drive [N, N m].
        speed: Root mean square speed [m/s, rad/s].
        top_speed: Speed that only one row in 500 exceeds.
        spread: Standard deviation of the coordinate [m, rad].
        low: Coordinate below which it is for a tenth of the time.
        high: Coordinate above which it is for a tenth of the time.
    """

    force: tuple[float, float]
    peak: float
    speed: tuple[float, float]
    top_speed: tuple[float, float]
    spread: tuple[float, float]
    low: tuple[float, float]
    high: tuple[float, float]


def consequences(robot: Robot, runs: tuple[Run, ...]) -> Consequences:
    """Measure what a robot does in its runs."""
    plant = PLANTS[robot.kind]
    driven = DRIVEN[robot.kind]
    size = {"force": [0.0, 0.0], "speed": [0.0, 0.0], "top": [0.0, 0.0], "spread": [0.0, 0.0]}
    ends = {"low": [0.0, 0.0], "high": [0.0, 0.0]}
    for joint, name in zip(MOVING[robot.kind], plant.coordinates, strict=True):
        place = np.concatenate([run.exact[name] for run in runs])
        speed = np.concatenate([run.rates[name] for run in runs])
        size["speed"][joint] = _rms(speed)
        size["top"][joint] = float(np.quantile(np.abs(speed), 0.998))
        size["spread"][joint] = float(np.std(place))
        ends["low"][joint], ends["high"][joint] = (float(v) for v in np.quantile(place, (0.1, 0.9)))
        if joint in driven:
            size["force"][joint] = _rms(_commands(runs, plant.commands[driven.index(joint)]))
        else:
            p = robot.parameters
            size["force"][joint] = p["body_mass"] * p["gravity"] * p["com_height"] * _rms(place)
    peak = float(np.quantile(np.abs(_commands(runs, plant.commands[0])), 0.998))
    pairs = {name: (values[0], values[1]) for name, values in (*size.items(), *ends.items())}
    return Consequences(
        pairs["force"], peak, pairs["speed"], pairs["top"], pairs["spread"], pairs["low"], pairs["high"]
    )


def _commands(runs: tuple[Run, ...], name: str) -> np.ndarray:
    return np.concatenate([run.columns[name] for run in runs])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class Draw:
    """What the size of an effect is drawn from.

    Attributes:
        robot: Its owner's view of it.
        doing: What it does.
        rng: Random numbers.
        weak: Whether effects are to be just noticeable.
    """

    robot: Robot
    doing: Consequences
    rng: np.random.Generator
    weak: bool

    def between(self, clear: tuple[float, float], weak: tuple[float, float]) -> float:
        """A size within the interval that applies."""
        return log_uniform(self.rng, *(weak if self.weak else clear))

    def either_sign(self, clear: tuple[float, float], weak: tuple[float, float]) -> float:
        """The same, positive or negative."""
        return self.between(clear, weak) * float(self.rng.choice([-1.0, 1.0]))

    def force(self, site: str) -> float:
        """Part of the joint's force that friction takes [N or N m]."""
        return self.between((0.05, 0.25), (0.015, 0.04)) * self.doing.force[self.joint(site)]

    def joint(self, site: str) -> int:
        """Index of the joint at a site; of the first driven joint for the actuator."""
        return JOINT[site] if site in JOINT else DRIVEN[self.robot.kind][0]


def effect_names(kind: str) -> tuple[str, ...]:
    """The vocabulary of a plant, "site/kind"."""
    joints = PLANTS[kind].joints
    names = [f"{joint}/{law}" for joint in joints for law in JOINT_LAWS]
    lacking = LACKING.get(kind, ())
    names += [f"actuator/{law}" for law in ACTUATOR_LAWS if law not in lacking]
    if "translation" in joints:
        names += ["translation/sticky_spot", "environment/rail_tilt", "environment/spring"]
    if "pitch" in joints:
        names += [f"geometry/{law}" for law in ("payload", "payload_event", "com_offset", "inertia")]
    for column in PLANTS[kind].coordinates:
        names += [f"sensor_{column}/{law}" for law in SENSOR_LAWS if law != "bias" or column == "theta"]
    return tuple(names)


def draw_values(name: str, draw: Draw) -> dict[str, float]:
    """Parameters of an effect [SI], rounded as they enter the simulation."""
    site, _, law = name.partition("/")
    rule = _sensor_delay if name.startswith("sensor_") and law == "delay" else _SIZES[law]
    return {symbol: float(f"{value:.4g}") for symbol, value in rule(site, draw).items()}


def draw_details(name: str, values: Values, draw: Draw) -> dict[str, float]:
    """What the contract leaves to the modeller: the damping of the bristles, from none to a tenth of critical."""
    if not name.endswith("/presliding") or draw.rng.random() < 0.5:
        return {}
    joint = draw.joint(name.partition("/")[0])
    inertia = draw.doing.force[joint] / max(draw.doing.speed[joint], 1e-9) * 0.1
    return {"bristle_damping": 0.2 * draw.rng.random() * float(np.sqrt(values["stiffness"] * inertia))}


def _viscous(site: str, draw: Draw) -> Values:
    return {"sigma": draw.force(site) / draw.doing.speed[draw.joint(site)]}


def _coulomb(site: str, draw: Draw) -> Values:
    return {"F_c": draw.force(site)}


def _stribeck(site: str, draw: Draw) -> Values:
    level = draw.force(site)
    bump = draw.rng.uniform(1.4, 2.5)
    return {"F_c": level, "F_s": bump * level, "v_s": draw.rng.uniform(0.08, 0.5) * draw.doing.speed[draw.joint(site)]}


def _presliding(site: str, draw: Draw) -> Values:
    level = draw.force(site)
    way = draw.rng.uniform(0.02, 0.12) * draw.doing.spread[draw.joint(site)]
    return {"F_c": level, "stiffness": level / way}


def _drag(site: str, draw: Draw) -> Values:
    return {"c": draw.force(site) / draw.doing.speed[draw.joint(site)] ** 2}


def _sticky_spot(site: str, draw: Draw) -> Values:
    low, high = draw.doing.low[0], draw.doing.high[0]
    width = max(draw.rng.uniform(0.15, 0.4) * (high - low), 0.02)
    middle = draw.rng.uniform(low, high)
    return {"F_c": 2.0 * draw.force(site), "lo": middle - 0.5 * width, "hi": middle + 0.5 * width}


def _gain(site: str, draw: Draw) -> Values:
    return {"k": 1.0 + draw.either_sign((0.08, 0.25), (0.02, 0.05))}


def _dead_zone(site: str, draw: Draw) -> Values:
    forces = [draw.doing.force[joint] for joint in DRIVEN[draw.robot.kind]]
    return {"band": draw.between((0.05, 0.25), (0.015, 0.04)) * float(np.exp(np.mean(np.log(forces))))}


def _delay(site: str, draw: Draw) -> Values:
    return {"tau": draw.between((0.008, 0.025), (0.003, 0.006))}


def _sensor_delay(site: str, draw: Draw) -> Values:
    return {"tau": draw.between((0.005, 0.02), (0.002, 0.004))}


def _saturation(site: str, draw: Draw) -> Values:
    return {"F_max": draw.between((0.4, 0.75), (0.8, 0.9)) * draw.doing.peak}


def _speed_limit(site: str, draw: Draw) -> Values:
    stall = draw.between((0.7, 1.2), (1.1, 1.5)) * draw.doing.peak
    free = draw.between((1.3, 2.5), (2.0, 3.5)) * draw.doing.top_speed[draw.joint(site)]
    return {"F_stall": stall, "v_free": free}


def _backlash(site: str, draw: Draw) -> Values:
    return {"gap": draw.between((0.04, 0.12), (0.015, 0.03)) * draw.doing.spread[draw.joint(site)]}


def _ripple(site: str, draw: Draw) -> Values:
    way = 2.0 * draw.doing.spread[draw.joint(site)]
    turning = way / draw.robot.parameters.get("wheel_radius", 1.0)
    fewest = max(3, int(np.ceil(2.0 * pi / turning)))  # so that several periods are passed
    size = draw.between((0.05, 0.25), (0.015, 0.04)) * draw.doing.force[draw.joint(site)]
    return {"A": size, "n": float(draw.rng.integers(fewest, 3 * fewest + 1)), "phase": draw.rng.uniform(-pi, pi)}


def _payload(site: str, draw: Draw) -> Values:
    p = draw.robot.parameters
    mass = draw.between((0.05, 0.2), (0.015, 0.04)) * p["body_mass"]
    return {"mass": mass, "height": draw.rng.uniform(0.5, 1.9) * p["com_height"]}


def _payload_event(site: str, draw: Draw) -> Values:
    return {**_payload(site, draw), "t0": draw.rng.uniform(2.8, 5.6)}


def _lean(symbol: str) -> Callable[[str, Draw], Values]:
    def rule(site: str, draw: Draw) -> Values:
        return {symbol: radians(draw.either_sign((0.5, 2.0), (0.1, 0.3)))}

    return rule


def _inertia(site: str, draw: Draw) -> Values:
    size = draw.between((0.15, 0.5), (0.04, 0.08))
    return {"scale": 1.0 + size if draw.rng.random() < 0.6 else 1.0 / (1.0 + size)}


def _spring(site: str, draw: Draw) -> Values:
    joint = draw.joint("translation")
    size = draw.between((0.08, 0.35), (0.02, 0.05)) * draw.doing.force[joint]
    return {"k": size / draw.doing.spread[joint], "x0": draw.rng.normal(0.0, 0.7) * draw.doing.spread[joint]}


def _scale(site: str, draw: Draw) -> Values:
    return {"e": draw.either_sign((0.03, 0.08), (0.01, 0.02))}


_SIZES: dict[str, Callable[[str, Draw], Values]] = {
    "viscous": _viscous,
    "coulomb": _coulomb,
    "stribeck": _stribeck,
    "presliding": _presliding,
    "quadratic_drag": _drag,
    "sticky_spot": _sticky_spot,
    "gain": _gain,
    "dead_zone": _dead_zone,
    "delay": _delay,
    "lag": _delay,
    "saturation": _saturation,
    "speed_limit": _speed_limit,
    "backlash": _backlash,
    "ripple": _ripple,
    "payload": _payload,
    "payload_event": _payload_event,
    "com_offset": _lean("theta_eq"),
    "inertia": _inertia,
    "rail_tilt": _lean("angle"),
    "spring": _spring,
    "bias": _lean("b"),
    "scale": _scale,
}
JOINT_LAWS = ("viscous", "coulomb", "stribeck", "presliding", "quadratic_drag")
ACTUATOR_LAWS = ("gain", "dead_zone", "delay", "lag", "saturation", "speed_limit", "backlash", "ripple")
LACKING = {"pendulum": ("backlash",), "double_pendulum": ("backlash", "ripple")}  # they have no rim
SENSOR_LAWS = ("bias", "scale", "delay")

_FAMILIES = {
    "dry friction": ("coulomb", "stribeck", "presliding", "sticky_spot"),
    "damping": ("viscous", "quadratic_drag"),
    "timing": ("delay", "lag"),
    "limit": ("saturation", "speed_limit"),
    "play": ("dead_zone", "backlash"),
    "inclination": ("com_offset", "rail_tilt", "bias"),
    "constant pull": ("rail_tilt", "spring"),  # a tilt moves the place where a spring rests, and hardly anything else
    "mass": ("payload", "payload_event", "inertia"),
    "scale": ("gain", "scale"),
}


def families(name: str) -> set[str]:
    """What an effect has in common with those that must not be drawn beside it."""
    site, _, law = name.partition("/")
    found = {group for group, laws in _FAMILIES.items() if law in laws} or {law}
    return {f"{site}: {group}" if group in ("dry friction", "damping") else group for group in found}
