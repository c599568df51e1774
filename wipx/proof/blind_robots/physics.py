"""Everything that a robot is made of, as one record that the equations of motion read.

A plant's rigid body, the effects of the vocabulary and physics outside it become numbers here; the
equations themselves are in `motion`, `friction` and `drive`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

import numpy as np

DRIVEN = {  # joints on which the commands act, by plant
    "wip": (0,),
    "cartpole": (0,),
    "linear_axis": (0,),
    "pendulum": (1,),
    "double_pendulum": (0, 1),
}
MOVING = {"wip": (0, 1), "cartpole": (0, 1), "linear_axis": (0,), "pendulum": (1,), "double_pendulum": (0, 1)}
JOINT = {"translation": 0, "pitch": 1, "joint1": 0, "joint2": 1}
SENSOR = {"sensor_x": 0, "sensor_theta": 1, "sensor_theta1": 0, "sensor_theta2": 1}

_SCALARS = (
    # rigid body of the wip family; _after from the payload event on
    ("body_mass", 0.0), ("body_height", 0.0), ("body_inertia", 0.0), ("cart_mass", 0.0), ("cart_weight", 0.0),
    ("gravity", 9.81),
    ("body_mass_after", 0.0), ("body_height_after", 0.0), ("body_inertia_after", 0.0), ("event_time", inf),
    ("tilt", 0.0), ("lean", 0.0), ("spring", 0.0), ("spring_rest", 0.0),
    # a mass that moves on the body, sideways on a spring: sloshing or bending
    ("aux_mass", 0.0), ("aux_height", 0.0), ("aux_stiffness", 0.0), ("aux_damping", 0.0),
    # double pendulum: inertias and gravity moments that its equations are made of
    ("inertia1", 0.0), ("inertia2", 0.0), ("coupling", 0.0), ("moment1", 0.0), ("moment2", 0.0),
    # friction that depends on the place
    ("spot_level", 0.0), ("spot_low", 0.0), ("spot_high", 0.0),
    ("rail_level", 0.0), ("rail_wavenumber", 0.0), ("rail_phase", 0.0),
    # torque over the pitch
    ("cog_torque", 0.0), ("cog_number", 0.0), ("cog_phase", 0.0),
    # drive
    ("delay", 0.0), ("dead_band", 0.0), ("gain", 1.0), ("gain_drift", 0.0), ("force_limit", inf),
    ("stall_force", inf), ("free_speed", inf), ("lag", 0.0),
    ("ripple", 0.0), ("ripple_wavenumber", 0.0), ("ripple_phase", 0.0),
    ("drive_mass", 0.0), ("gap", 0.0), ("contact_stiffness", 0.0), ("contact_damping", 0.0), ("grease", 0.0),
    ("traction", 0.0), ("creep", 0.0),
    # what real drives have besides
    ("drift_middle", 0.0), ("sag", 0.0), ("sag_middle", 0.0),
    ("belt_stiffness", 0.0), ("belt_damping", 0.0), ("belt_motor_side", 0.0),
)  # fmt: skip
_PAIRS = (
    ("viscous", 0.0), ("drag", 0.0), ("kinetic", 0.0), ("static", 0.0), ("bump_speed", 1.0), ("one_sided", 0.0),
    ("viscous_forward", 0.0), ("viscous_backward", 0.0),
    ("bristle_level", 0.0), ("bristle_stiffness", 0.0), ("bristle_damping", 0.0),
    ("hysteresis", 0.0), ("hysteresis_length", 1.0), ("hysteresis_first", 1.0),
    ("regeneration", 0.0), ("regeneration_cubic", 0.0),
    ("sensor_bias", 0.0), ("sensor_scale", 0.0), ("sensor_delay", 0.0),
    # friction that keeps to no law, forces from outside, eccentric encoders
    ("bump_power", 2.0), ("wander", 0.0), ("wander_place", 0.0), ("wander_number", 0.0), ("wander_phase", 0.0),
    ("wander_load", 0.0), ("usual_load", 1.0), ("uneven", 0.0), ("push", 0.0),
    ("wobble", 0.0), ("wobble_number", 0.0), ("wobble_phase", 0.0),
)  # fmt: skip
RECORD = np.dtype(
    [("chain", np.int64), ("locked", np.int64, 2), ("dry", np.int64, 2), ("driven", np.int64, 2)]
    + [("uneven_friction", np.int64)]
    + [(name, np.float64) for name, _ in _SCALARS]
    + [(name, np.float64, 2) for name, _ in _PAIRS]
)


@dataclass(frozen=True)
class UnmodelledPhysics:
    """Physics that the vocabulary lacks.

    Attributes:
        name: What it is, in one or two words.
        values: Fields of the record by name; of those with one entry for each joint, the entry of `joint`.
        joint: The joint at which it acts.
    """

    name: str
    values: Mapping[str, float]
    joint: int = 0


@dataclass(frozen=True)
class Hidden:
    """What a robot has beside its rigid body.

    Attributes:
        effects: Values of the effects' parameters [SI] by "site/kind"; names as the contract has them.
        details: What an effect's law leaves to the modeller, as fields of the record, by "site/kind".
        unmodelled: Physics outside the vocabulary; None without.
        dirt: Fields of the record in which a robot differs from its laws, see `dirt.Dirt.fields`; by joint where they
            have an entry for each.
    """

    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    details: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    unmodelled: UnmodelledPhysics | None = None
    dirt: Mapping[str, float | Mapping[int, float]] = field(default_factory=dict)

    def without(self, name: str) -> "Hidden":
        """The same robot without one effect, or without the unmodelled physics of that name."""
        effects = {key: values for key, values in self.effects.items() if key != name}
        unmodelled = None if self.unmodelled is not None and self.unmodelled.name == name else self.unmodelled
        return Hidden(effects, self.details, unmodelled, self.dirt)


def physics(kind: str, parameters: Mapping[str, float], hidden: Hidden) -> np.ndarray:
    """The record of a robot, shape (1,) of `RECORD`.

    Args:
        kind: Plant.
        parameters: True rigid body [SI], names of contract section 2.
        hidden: Everything beside it.
    """
    record = np.zeros(1, RECORD)
    for name, value in (*_SCALARS, *_PAIRS):
        record[name] = value
    record["chain"] = kind == "double_pendulum"
    record["locked"] = [[joint not in MOVING[kind] for joint in (0, 1)]]
    record["driven"] = [[joint in DRIVEN[kind] for joint in (0, 1)]]
    record["gravity"] = parameters["gravity"]
    if kind == "double_pendulum":
        _set_chain(record, parameters)
    else:
        _set_body(record, kind, parameters)
    for name, values in hidden.effects.items():
        site, _, effect = name.partition("/")
        _EFFECTS[effect](record, site, values)
        for entry, value in hidden.details.get(name, {}).items():
            record[entry][0, JOINT[site]] = value
    if hidden.unmodelled is not None:
        _set_unmodelled(record, hidden.unmodelled)
    _set_dirt(record, hidden.dirt)
    if "actuator/ripple" in hidden.effects:
        record["ripple_wavenumber"] /= parameters.get("wheel_radius", 1.0)
    _set_drive_details(record, hidden)
    if kind != "double_pendulum":
        _set_body_after_event(record, hidden)
    _set_dry(record)
    return record


def _set_chain(record: np.ndarray, parameters: Mapping[str, float]) -> None:
    m2, l1 = parameters["link2_mass"], parameters["link1_length"]
    record["inertia1"] = parameters["link1_inertia"] + m2 * l1**2
    record["inertia2"] = parameters["link2_inertia"]
    record["coupling"] = m2 * l1 * parameters["link2_com"]
    record["moment1"] = parameters["link1_mass"] * parameters["link1_com"] + m2 * l1
    record["moment2"] = m2 * parameters["link2_com"]


def _set_body(record: np.ndarray, kind: str, parameters: Mapping[str, float]) -> None:
    wheel = parameters.get("wheel_inertia", 0.0) / parameters.get("wheel_radius", 1.0) ** 2
    record["cart_mass"] = 1.0 if kind == "pendulum" else parameters["wheel_mass"] + wheel  # a pendulum's is held
    record["cart_weight"] = parameters.get("wheel_mass", 0.0)  # spin has inertia, but no weight on a tilted rail
    record["body_mass"] = parameters["body_mass"]
    record["body_height"] = parameters.get("com_height", 0.0)
    record["body_inertia"] = parameters.get("body_inertia", 1.0)


def add_mass(body: tuple[float, float, float], mass: float, height: float) -> tuple[float, float, float]:
    """Mass, height of the CoM and inertia about it of a `body` after a point mass was added (or taken away).

    Steiner's theorem about the axis: the moment of inertia grows by mass * height^2.
    """
    m, h, inertia = body
    total = m + mass
    com = (m * h + mass * height) / total
    return total, com, inertia + m * h**2 + mass * height**2 - total * com**2


def _body(record: np.ndarray) -> tuple[float, float, float]:
    return float(record["body_mass"][0]), float(record["body_height"][0]), float(record["body_inertia"][0])


def _set_payload(record: np.ndarray, _site: str, values: Mapping[str, float]) -> None:
    body = add_mass(_body(record), values["mass"], values["height"])
    record["body_mass"], record["body_height"], record["body_inertia"] = body


def _set_event(record: np.ndarray, _site: str, values: Mapping[str, float]) -> None:
    record["event_time"] = values["t0"]


def _set_body_after_event(record: np.ndarray, hidden: Hidden) -> None:
    event = hidden.effects.get("geometry/payload_event", {"mass": 0.0, "height": 0.0})
    body = add_mass(_body(record), event["mass"], event["height"])
    record["body_mass_after"], record["body_height_after"], record["body_inertia_after"] = body


def _set_inertia(record: np.ndarray, _site: str, values: Mapping[str, float]) -> None:
    record["body_inertia"] *= values["scale"]


def _set_stribeck(record: np.ndarray, site: str, values: Mapping[str, float]) -> None:
    joint = JOINT[site]
    record["kinetic"][0, joint] += values["F_c"]
    record["static"][0, joint] += values["F_s"]
    record["bump_speed"][0, joint] = values["v_s"]


def _set_coulomb(record: np.ndarray, site: str, values: Mapping[str, float]) -> None:
    _set_stribeck(record, site, {"F_c": values["F_c"], "F_s": values["F_c"], "v_s": 1.0})


def _set_delay(record: np.ndarray, site: str, values: Mapping[str, float]) -> None:
    if site == "actuator":
        record["delay"] = values["tau"]
    else:
        record["sensor_delay"][0, SENSOR[site]] = values["tau"]


def _at_joint(**fields: str):
    """A rule that copies parameters to fields with an entry for each joint."""

    def rule(record: np.ndarray, site: str, values: Mapping[str, float]) -> None:
        for symbol, name in fields.items():
            record[name][0, JOINT[site] if site in JOINT else SENSOR[site]] = values[symbol]

    return rule


def _as_given(**fields: str):
    """A rule that copies parameters to fields of the whole robot."""

    def rule(record: np.ndarray, _site: str, values: Mapping[str, float]) -> None:
        for symbol, name in fields.items():
            record[name] = values[symbol]

    return rule


_EFFECTS = {
    "viscous": _at_joint(sigma="viscous"),
    "coulomb": _set_coulomb,
    "stribeck": _set_stribeck,
    "presliding": _at_joint(F_c="bristle_level", stiffness="bristle_stiffness"),
    "quadratic_drag": _at_joint(c="drag"),
    "sticky_spot": _as_given(F_c="spot_level", lo="spot_low", hi="spot_high"),
    "gain": _as_given(k="gain"),
    "dead_zone": _as_given(band="dead_band"),
    "delay": _set_delay,
    "lag": _as_given(tau="lag"),
    "saturation": _as_given(F_max="force_limit"),
    "speed_limit": _as_given(F_stall="stall_force", v_free="free_speed"),
    "backlash": _as_given(gap="gap"),
    "ripple": _as_given(A="ripple", n="ripple_wavenumber", phase="ripple_phase"),
    "payload": _set_payload,
    "payload_event": _set_event,
    "com_offset": _as_given(theta_eq="lean"),
    "inertia": _set_inertia,
    "rail_tilt": _as_given(angle="tilt"),
    "spring": _as_given(k="spring", x0="spring_rest"),
    "bias": _at_joint(b="sensor_bias"),
    "scale": _at_joint(e="sensor_scale"),
}


def _set_unmodelled(record: np.ndarray, unmodelled: UnmodelledPhysics) -> None:
    for name, value in unmodelled.values.items():
        if record.dtype[name].shape:
            record[name][0, unmodelled.joint] = value
        else:
            record[name] = value
    mass, height = float(record["aux_mass"][0]), float(record["aux_height"][0])
    if mass > 0.0:  # at rest on the body the moving mass is part of what the owner weighed
        record["body_mass"], record["body_height"], record["body_inertia"] = add_mass(_body(record), -mass, height)


def _set_dirt(record: np.ndarray, dirt: Mapping[str, float | Mapping[int, float]]) -> None:
    for name, value in dirt.items():
        if isinstance(value, Mapping):
            for joint, size in value.items():
                record[name][0, joint] = size
        else:
            record[name] = value
    uneven = ("wander", "wander_place", "wander_load", "uneven")
    record["uneven_friction"] = any(np.any(record[name] != 0.0) for name in uneven)


# The free side of a drive with play; contact is stiff enough to be over within 5 ms and hardly rebounds.
FREE_SHARE, CONTACT_RATE, CONTACT_DAMPING, GREASE_RATE = 0.08, 1500.0, 0.7, 5.0


def _set_drive_details(record: np.ndarray, hidden: Hidden) -> None:
    if "actuator/backlash" in hidden.effects:
        mass = FREE_SHARE * (record["cart_mass"] + record["body_mass"])
        record["drive_mass"] = mass
        record["contact_stiffness"] = mass * CONTACT_RATE**2
        record["contact_damping"] = 2.0 * CONTACT_DAMPING * mass * CONTACT_RATE
        record["grease"] = GREASE_RATE * mass
    record["cart_mass"] -= record["drive_mass"]  # the drive moves on its own, so its mass must not count twice


def _set_dry(record: np.ndarray) -> None:
    dry = (record["static"] > 0.0) | (record["one_sided"] != 0.0)
    dry[0, 0] |= bool(record["spot_level"][0] > 0.0) or bool(record["rail_level"][0] > 0.0)
    record["dry"] = dry
