"""From a robot and what is hidden in it to the records that the equations read; contract section 6."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from wipx.proof.blind_robots.trees.dynamics import Body
from wipx.proof.blind_robots.trees.links import Link, changed, tilted
from wipx.proof.blind_robots.trees.records import CABLE, joint_records

Values = Mapping[str, float]

# The free side of a drive with play; contact is stiff enough to be over within a few ms and hardly rebounds.
CONTACT_RATE, CONTACT_DAMPING, GREASE_RATE = 1500.0, 0.7, 5.0  # [1/s], share of critical, [1/s]


@dataclass(frozen=True)
class Drive:
    """What moves a joint, as its owner knows it.

    Attributes:
        kind: "torque", "position" or "none".
        gain: Force of a torque drive per unit of its command.
        kp: Of a position drive [N m/rad or N/m].
        kd: Likewise.
        limit: Largest force of a position drive.
        rate: Of its loop [Hz]; None for a continuous one.
        in_file: Whether the model file says so, not robot.yaml.
        logged: "command", or "motor" where the log has what the motor made of it.
    """

    kind: str
    gain: float = 1.0
    kp: float = 0.0
    kd: float = 0.0
    limit: float = np.inf
    rate: float | None = None
    in_file: bool = False
    logged: str = "command"


@dataclass(frozen=True)
class UnmodelledPhysics:
    """Physics that the vocabulary lacks.

    Attributes:
        name: What it is.
        joint: Number of the joint or link at which it acts.
        values: Its numbers.
    """

    name: str
    joint: int
    values: Values


@dataclass(frozen=True)
class Hidden:
    """What a robot has beside what its owner knows.

    Attributes:
        effects: Values of the effects' parameters [SI] by "site/kind"; names as contract section 6 has them.
        details: What a law leaves to the modeller, fields of the joint's record, by "site/kind".
        unmodelled: Physics outside the vocabulary; None without.
    """

    effects: Mapping[str, Values] = field(default_factory=dict)
    details: Mapping[str, Values] = field(default_factory=dict)
    unmodelled: UnmodelledPhysics | None = None

    def without(self, name: str) -> "Hidden":
        """The same robot without one effect, or without the unmodelled physics of that name."""
        effects = {key: values for key, values in self.effects.items() if key != name}
        details = {key: values for key, values in self.details.items() if key != name}
        unmodelled = None if self.unmodelled is not None and self.unmodelled.name == name else self.unmodelled
        return Hidden(effects, details, unmodelled)

    def beside(self, other: Mapping[str, Values]) -> "Hidden":
        """The same with further effects."""
        return replace(self, effects={**other, **self.effects})


class Real(NamedTuple):
    """A robot as `run.simulate` takes it."""

    body: Body
    joints: np.ndarray
    cable: np.void
    visible: np.ndarray


def body_of(links: tuple[Link, ...], gravity: np.ndarray) -> Body:
    """Links as arrays."""
    return Body(
        np.array([link.parent for link in links]),
        np.array([int(link.slides) for link in links]),
        np.array([link.axis for link in links]),
        np.array([link.turn for link in links]),
        np.array([link.place for link in links]),
        np.array([link.mass for link in links]),
        np.array([link.com for link in links]),
        np.array([link.inertia for link in links]),
        np.array(gravity, dtype=float),
    )


def real(links: tuple[Link, ...], drives: tuple[Drive, ...], gravity: np.ndarray, hidden: Hidden) -> Real:
    """A robot with what is hidden in it.

    Args:
        links: With true masses; effects at links are not in them.
        drives: Of each joint.
        gravity: In the frame of a level base [m/s^2].
        hidden: Effects and unmodelled physics.
    """
    records = joint_records(len(links))
    for r, link, drive in zip(records, links, drives, strict=True):
        _set_joint(r, link, drive)
    names = [link.joint for link in links]
    for name, values in hidden.effects.items():
        site, _, kind = name.partition("/")
        if site.startswith("link_"):
            continue
        if site == "environment":
            gravity = tilted(gravity, values["roll"], values["pitch"])
            continue
        at = [i for i, joint in enumerate(names) if site in (joint, f"actuator_{joint}", f"sensor_{joint}")]
        for i in at or [i for i, drive in enumerate(drives) if drive.kind != "none"]:
            _LAWS[f"sensor {kind}" if site.startswith("sensor_") else kind](records[i], values)
            for entry, value in hidden.details.get(name, {}).items():
                records[i][entry] = value
    for r in records:
        _finish(r)
    links = changed(links, hidden.effects)
    cable, visible = np.zeros(1, CABLE), np.arange(len(links))
    if hidden.unmodelled is not None:
        from wipx.proof.blind_robots.trees.unmodelled_physics import built

        links, records, cable, visible = built(hidden.unmodelled, links, records, cable)
    return Real(body_of(links, gravity), records, cable[0], visible)


def _set_joint(r: np.void, link: Link, drive: Drive) -> None:
    r["armature"], r["viscous"] = link.armature, link.damping
    r["kinetic"] = r["static"] = link.friction
    r["driven"], r["servo"] = drive.kind != "none", drive.kind == "position"
    r["input_gain"] = drive.gain
    r["kp"], r["kd"], r["servo_limit"] = drive.kp, drive.kd, drive.limit
    r["servo_period"] = 0.0 if drive.rate is None else 1.0 / drive.rate


def _finish(r: np.void) -> None:
    r["dry"] = any(r[name] != 0.0 for name in ("static", "one_sided", "spot_level", "per_motor", "per_load"))
    if r["drive_inertia"] > 0.0:
        r["armature"] -= r["drive_inertia"]
        if not r["elastic"]:
            r["contact_stiffness"] = r["drive_inertia"] * CONTACT_RATE**2
            r["contact_damping"] = 2.0 * CONTACT_DAMPING * r["drive_inertia"] * CONTACT_RATE
            r["grease"] = GREASE_RATE * r["drive_inertia"]


def _adds(**fields: str) -> Callable[[np.void, Values], None]:
    """A rule that adds parameters to fields of the record."""

    def rule(r: np.void, values: Values) -> None:
        for symbol, name in fields.items():
            r[name] += values[symbol]

    return rule


def _sets(**fields: str) -> Callable[[np.void, Values], None]:
    """A rule that puts parameters into fields of the record."""

    def rule(r: np.void, values: Values) -> None:
        for symbol, name in fields.items():
            r[name] = values[symbol]

    return rule


def _scales(name: str) -> Callable[[np.void, Values], None]:
    def rule(r: np.void, values: Values) -> None:
        r[name] *= values["factor"]

    return rule


def _coulomb(r: np.void, values: Values) -> None:
    r["kinetic"] += values["F_c"]
    r["static"] += values["F_c"]


def _stribeck(r: np.void, values: Values) -> None:
    r["kinetic"] += values["F_c"]
    r["static"] += values["F_s"]
    r["bump_speed"] = values["v_s"]


def _asymmetric(r: np.void, values: Values) -> None:
    _coulomb(r, {"F_c": 0.5 * (values["F_plus"] + values["F_minus"])})
    r["one_sided"] = 0.5 * (values["F_plus"] - values["F_minus"])


def _elasticity(r: np.void, values: Values) -> None:
    r["elastic"] = 1
    r["contact_stiffness"], r["contact_damping"] = values["stiffness"], values["damping"]
    r["drive_inertia"] = values["drive_inertia"]
    r["armature"] += values["drive_inertia"]  # the file's stays on the side of the link


_LAWS: Mapping[str, Callable[[np.void, Values], None]] = {
    "viscous": _adds(sigma="viscous"),
    "coulomb": _coulomb,
    "stribeck": _stribeck,
    "presliding": _sets(F_c="bristle_level", stiffness="bristle_stiffness"),
    "asymmetric_coulomb": _asymmetric,
    "quadratic_drag": _sets(c="drag"),
    "load_friction": _sets(K_motor="per_motor", K_external="per_load"),
    "sticky_spot": _sets(F_c="spot_level", lo="spot_low", hi="spot_high"),
    "rotor_inertia": _adds(J="armature"),
    "spring": _sets(k="spring", q0="spring_rest"),
    "gain": _sets(k="gain"),
    "offset": _sets(F_0="offset"),
    "dead_zone": _sets(band="dead_band"),
    "delay": _adds(tau="delay"),
    "lag": _sets(tau="lag"),
    "saturation": _sets(F_max="force_limit"),
    "speed_limit": _sets(F_stall="stall", v_free="free_speed"),
    "ripple": _sets(A="ripple", n="ripple_number", phase="ripple_phase"),
    "backlash": _sets(gap="gap"),
    "elasticity": _elasticity,
    "kp": _scales("kp"),
    "kd": _scales("kd"),
    "sensor bias": _sets(b="sensor_bias"),
    "sensor scale": _sets(e="sensor_scale"),
    "sensor delay": _sets(tau="sensor_delay"),
}
