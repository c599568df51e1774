"""Sizes of effects of a tree by their consequence: shares of forces, speeds and ways of each joint."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import pi, radians

import numpy as np

from wipx.proof.blind_robots.robots import log_uniform
from wipx.proof.blind_robots.trees.links import Link
from wipx.proof.blind_robots.trees.logging import Run
from wipx.proof.blind_robots.trees.robots import Robot

Values = Mapping[str, float]
FASTEST_DRAG = 15.0  # [1/s], rate at which drag brakes a joint at its top speed; air and oil are not stiffer


@dataclass(frozen=True, eq=False)
class Doing:
    """What a robot does in its recordings; arrays of shape (joints,).

    Attributes:
        force: Root mean square force of the drive, about gravity's where there is none [N m or N].
        peak: Force that only one row in 500 exceeds.
        speed: Root mean square speed [rad/s or m/s].
        top_speed: Speed that only one row in 500 exceeds.
        spread: Standard deviation of the position [rad or m].
        middle: Its mean.
        low: Position below which it is for a tenth of the time.
        high: Position above which it is for a tenth of the time.
    """

    force: np.ndarray
    peak: np.ndarray
    speed: np.ndarray
    top_speed: np.ndarray
    spread: np.ndarray
    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray


def doing(robot: Robot, runs: tuple[Run, ...]) -> Doing:
    """Measure what a robot does in its runs."""
    places = np.concatenate([run.exact for run in runs])
    rates = np.concatenate([run.rates for run in runs])
    forces = np.concatenate([run.forces for run in runs])
    driven = np.array([drive.kind != "none" for drive in robot.drives])
    force = np.where(driven, _rms(forces), robot.weight)
    # a joint that carries no weight moves little but itself
    force = np.maximum(force, 0.5 * robot.inertia * _rms(rates) * 2.0 * pi * 0.3)
    low, high = np.quantile(places, (0.1, 0.9), axis=0)
    return Doing(
        force=force,
        peak=np.quantile(np.abs(forces), 0.998, axis=0),
        speed=_rms(rates),
        top_speed=np.quantile(np.abs(rates), 0.998, axis=0),
        spread=np.std(places, axis=0),
        middle=np.mean(places, axis=0),
        low=low,
        high=high,
    )


def _rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(values**2, axis=0))


@dataclass(frozen=True, eq=False)
class Draw:
    """What the size of an effect is drawn from.

    Attributes:
        robot: Its owner's view of it.
        doing: What it does.
        rng: Random numbers.
    """

    robot: Robot
    doing: Doing
    rng: np.random.Generator

    def joint(self, site: str) -> int:
        """Number of the joint of a site; -1 for the sites of the whole robot."""
        for i, link in enumerate(self.robot.links):
            if site in (link.joint, f"actuator_{link.joint}", f"sensor_{link.joint}", f"link_{link.body}"):
                return i
        return -1

    def link(self, site: str) -> Link:
        """The link of a site."""
        return self.robot.links[self.joint(site)]

    def force(self, site: str) -> float:
        """Part of the joint's force [N m or N]."""
        return log_uniform(self.rng, 0.05, 0.25) * float(self.doing.force[self.joint(site)])

    def sign(self) -> float:
        """1 or -1."""
        return float(self.rng.choice([-1.0, 1.0]))


def draw_values(name: str, draw: Draw) -> dict[str, float]:
    """Parameters of an effect [SI], rounded as they enter the simulation."""
    site, _, kind = name.partition("/")
    values = _SIZES[f"sensor {kind}" if site.startswith("sensor_") else kind](site, draw)
    return {symbol: float(f"{value:.4g}") for symbol, value in values.items()}


def draw_details(name: str, values: Values, draw: Draw) -> dict[str, float]:
    """What the contract leaves to the modeller: damping of bristles, inertia of a drive in its gap."""
    site, _, kind = name.partition("/")
    j = draw.joint(site)
    if kind == "presliding" and draw.rng.random() < 0.5:
        return {
            "bristle_damping": float(draw.rng.uniform(0.0, 0.2) * np.sqrt(values["stiffness"] * draw.robot.light[j]))
        }
    if kind == "backlash":
        own = draw.robot.links[j].armature
        return {
            "drive_inertia": float(
                min(0.08 * draw.robot.inertia[j], 0.4 * (draw.robot.light[j] if own == 0.0 else own))
            )
        }
    return {}


def _viscous(site: str, draw: Draw) -> Values:
    return {"sigma": draw.force(site) / draw.doing.speed[draw.joint(site)]}


def _coulomb(site: str, draw: Draw) -> Values:
    return {"F_c": draw.force(site)}


def _stribeck(site: str, draw: Draw) -> Values:
    level = draw.force(site)
    speed = draw.rng.uniform(0.08, 0.4) * draw.doing.speed[draw.joint(site)]
    return {"F_c": level, "F_s": draw.rng.uniform(1.4, 2.5) * level, "v_s": speed}


def _presliding(site: str, draw: Draw) -> Values:
    level = draw.force(site)
    return {"F_c": level, "stiffness": level / (draw.rng.uniform(0.02, 0.12) * draw.doing.spread[draw.joint(site)])}


def _asymmetric(site: str, draw: Draw) -> Values:
    level, uneven = draw.force(site), draw.sign() * draw.rng.uniform(0.25, 0.7)
    return {"F_plus": (1.0 + uneven) * level, "F_minus": (1.0 - uneven) * level}


def _drag(site: str, draw: Draw) -> Values:
    j = draw.joint(site)
    most = FASTEST_DRAG * draw.robot.light[j] / draw.doing.top_speed[j]
    return {"c": min(draw.force(site) / draw.doing.speed[j] ** 2, most)}


def _load_friction(site: str, draw: Draw) -> Values:
    return {"K_motor": draw.rng.uniform(0.03, 0.15), "K_external": draw.rng.uniform(0.03, 0.15)}


def _sticky_spot(site: str, draw: Draw) -> Values:
    j = draw.joint(site)
    low, high = draw.doing.low[j], draw.doing.high[j]
    half = 0.5 * draw.rng.uniform(0.15, 0.4) * (high - low)
    middle = draw.rng.uniform(low, high)
    return {"F_c": 2.0 * draw.force(site), "lo": middle - half, "hi": middle + half}


def _rotor(site: str, draw: Draw) -> Values:
    return {"J": log_uniform(draw.rng, 0.1, 0.5) * draw.robot.inertia[draw.joint(site)]}


def _spring(site: str, draw: Draw) -> Values:
    j = draw.joint(site)
    rest = draw.doing.middle[j] + draw.rng.normal(0.0, 0.7) * draw.doing.spread[j]
    return {"k": draw.force(site) / draw.doing.spread[j], "q0": rest}


def _gain(site: str, draw: Draw) -> Values:
    return {"k": 1.0 + draw.sign() * log_uniform(draw.rng, 0.08, 0.25)}


def _offset(site: str, draw: Draw) -> Values:
    return {"F_0": draw.sign() * draw.force(site)}


def _dead_zone(site: str, draw: Draw) -> Values:
    return {"band": draw.force(site)}


def _delay(site: str, draw: Draw) -> Values:
    # what is shorter than a period of the log is hard to see and cheap to have
    return {"tau": log_uniform(draw.rng, 0.008, 0.025) + 0.3 / draw.robot.rate}


def _sensor_delay(site: str, draw: Draw) -> Values:
    return {"tau": log_uniform(draw.rng, 0.006, 0.02) + 0.3 / draw.robot.rate}


def _saturation(site: str, draw: Draw) -> Values:
    return {"F_max": draw.rng.uniform(0.6, 0.9) * draw.doing.peak[draw.joint(site)]}


def _speed_limit(site: str, draw: Draw) -> Values:
    j = draw.joint(site)
    stall = draw.rng.uniform(0.8, 1.3) * draw.doing.peak[j]
    return {"F_stall": stall, "v_free": draw.rng.uniform(1.3, 2.5) * draw.doing.top_speed[j]}


def _ripple(site: str, draw: Draw) -> Values:
    fewest = max(3, int(np.ceil(pi / draw.doing.spread[draw.joint(site)])))  # so that some periods are passed
    number = float(draw.rng.integers(fewest, 3 * fewest + 1))
    return {"A": draw.force(site), "n": number, "phase": draw.rng.uniform(-pi, pi)}


def _backlash(site: str, draw: Draw) -> Values:
    return {"gap": log_uniform(draw.rng, 0.03, 0.1) * draw.doing.spread[draw.joint(site)]}


def _elasticity(site: str, draw: Draw) -> Values:
    j = draw.joint(site)
    drive = draw.rng.uniform(0.15, 0.6) * draw.robot.inertia[j]
    reduced = drive * draw.robot.light[j] / (drive + draw.robot.light[j])
    stiffness = reduced * (2.0 * pi * log_uniform(draw.rng, 5.0, 14.0)) ** 2
    damping = 2.0 * draw.rng.uniform(0.02, 0.1) * np.sqrt(stiffness * reduced)
    return {"stiffness": stiffness, "damping": damping, "drive_inertia": drive}


def _factor(site: str, draw: Draw) -> Values:
    return {"factor": 1.0 + draw.sign() * log_uniform(draw.rng, 0.1, 0.3)}


def _bias(site: str, draw: Draw) -> Values:
    link = draw.link(site)
    unit = link.limits[1] - link.limits[0] if link.slides else 1.0
    return {"b": draw.sign() * radians(log_uniform(draw.rng, 0.5, 2.0)) * unit}


def _scale(site: str, draw: Draw) -> Values:
    return {"e": draw.sign() * log_uniform(draw.rng, 0.03, 0.08)}


def _payload(site: str, draw: Draw) -> Values:
    link = draw.link(site)
    carried = sum(one.mass for one in draw.robot.links[draw.joint(site) :])
    spot = draw.rng.uniform(0.4, 1.1) * link.tip + draw.rng.normal(0.0, 0.1, 3) * link.length - link.origin
    return {"mass": log_uniform(draw.rng, 0.06, 0.3) * carried, **dict(zip("xyz", spot.tolist(), strict=True))}


def _com_offset(site: str, draw: Draw) -> Values:
    shift = draw.link(site).length * log_uniform(draw.rng, 0.05, 0.15) * _direction(draw.rng)
    return dict(zip("xyz", shift.tolist(), strict=True))


def _direction(rng: np.random.Generator) -> np.ndarray:
    found = rng.standard_normal(3)
    return found / np.linalg.norm(found)


def _inertia(site: str, draw: Draw) -> Values:
    size = log_uniform(draw.rng, 0.2, 0.8)
    return {"scale": 1.0 + size if draw.rng.random() < 0.6 else 1.0 / (1.0 + size)}


def _base_tilt(site: str, draw: Draw) -> Values:
    return {name: radians(draw.sign() * log_uniform(draw.rng, 0.5, 3.0)) for name in ("roll", "pitch")}


_SIZES: Mapping[str, Callable[[str, Draw], Values]] = {
    "viscous": _viscous,
    "coulomb": _coulomb,
    "stribeck": _stribeck,
    "presliding": _presliding,
    "asymmetric_coulomb": _asymmetric,
    "quadratic_drag": _drag,
    "load_friction": _load_friction,
    "sticky_spot": _sticky_spot,
    "rotor_inertia": _rotor,
    "spring": _spring,
    "gain": _gain,
    "offset": _offset,
    "dead_zone": _dead_zone,
    "delay": _delay,
    "lag": _delay,
    "saturation": _saturation,
    "speed_limit": _speed_limit,
    "ripple": _ripple,
    "backlash": _backlash,
    "elasticity": _elasticity,
    "kp": _factor,
    "kd": _factor,
    "sensor bias": _bias,
    "sensor scale": _scale,
    "sensor delay": _sensor_delay,
    "payload": _payload,
    "com_offset": _com_offset,
    "inertia": _inertia,
    "base_tilt": _base_tilt,
}
