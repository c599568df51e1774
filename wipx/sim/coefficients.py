"""From models to the coefficients of the equations of motion, for a whole batch at once.

This is where geometry acts (payload, inertia, reflected rotor inertia) and where effects of
one kind add up: everything that is constant during a rollout. What happens in a step is in
`wipx.sim.kernel`.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import ModelBatch
from wipx.effects.catalogue import kinds
from wipx.effects.lagged_stribeck import lag_of
from wipx.effects.payload import loaded
from wipx.effects.remainder import KNOTS
from wipx.sim import rows as R

FASTEST_LAG = 1e-30  # [s]; a lag of zero is one that settles at once


@dataclass(frozen=True)
class Coefficients:
    """What the kernel needs of a batch of models.

    Attributes:
        rows: Coefficients, shape (N_COEFFICIENTS, P).
        present: Parts of the signal path that are switched on, shape (N_FLAGS,).
        actuated: Whether each joint has a command, shape (2,).
    """

    rows: np.ndarray
    present: np.ndarray
    actuated: np.ndarray


class _Filler:
    """Writes the rows of one batch."""

    def __init__(self, batch: ModelBatch) -> None:
        self.batch = batch
        self.effects = batch.model.effects
        self.plant = batch.model.plant
        self.rows = np.zeros((R.N_COEFFICIENTS, batch.size))
        self.present = np.zeros(R.N_FLAGS, dtype=np.bool_)

    def plant_value(self, name: str) -> np.ndarray:
        return self.batch.column(name)

    def values(self, name: str) -> dict[str, np.ndarray] | None:
        """Parameters of an effect as arrays (P,), or None where it is absent; those not given have their defaults."""
        if name not in self.effects:
            return None
        parameters = kinds()[name.partition("/")[2]].parameters
        found = {p.name: np.full(self.batch.size, p.default) for p in parameters if p.default is not None}
        return found | {symbol: self.batch.column(f"{name}.{symbol}") for symbol in self.effects[name]}

    def add(self, name: str, flag: int | None, **targets: int) -> None:
        """Add the parameters of an effect, where present, to rows, and raise its flag."""
        values = self.values(name)
        if values is None:
            return
        if flag is not None:
            self.present[flag] = True
        for symbol, row in targets.items():
            self.rows[row] += values[symbol]


def coefficients(batch: ModelBatch, smoothing: tuple[float, ...] = ()) -> Coefficients:
    """The coefficients of every model of a batch.

    Args:
        batch: P models.
        smoothing: Speed over which the dry friction of each joint builds up [m/s, rad/s]; empty for sticking.
    """
    f = _Filler(batch)
    _set_neutral(f.rows)
    plant = f.plant
    f.rows[R.INPUT_GAIN] = f.plant_value("input_gain")
    if plant.kind == "double_pendulum":
        _double_pendulum(f)
    else:
        _wip_family(f)
    _environment(f)
    _actuator(f)
    for site in plant.joints:
        _joint(f, site, joint_index(site))
    for site, speed in zip(plant.joints, smoothing, strict=False):
        f.rows[R.SMOOTHING + joint_index(site)] = speed
        f.present[R.ON_SMOOTHING] = True
    for site, column in plant.columns.items():
        _sensor(f, f"sensor_{column}", joint_index(site))
    actuated = np.zeros(2, dtype=np.bool_)
    actuated[[joint_index(site) for site in plant.actuated]] = True
    return Coefficients(f.rows, f.present, actuated)


def joint_index(site: str) -> int:
    """Row of a joint in the kernel: translation and joint1 are 0, pitch and joint2 are 1."""
    return {"translation": 0, "joint1": 0, "pitch": 1, "joint2": 1}[site]


def _set_neutral(rows: np.ndarray) -> None:
    rows[[R.GAIN, R.MASS, R.INERTIA]] = 1.0
    rows[[R.FORCE_MAX, R.STALL, R.FREE_SPEED]] = 1e9
    rows[[R.LAG_RATE, R.PAPER_RATE, R.PAPER_RATE1]] = 1.0 / FASTEST_LAG
    rows[[R.DRIVE_INERTIA, R.STRIBECK_SPEED, R.STRIBECK_SPEED1, R.PEAK_SPEED, R.PEAK_SPEED1]] = 1.0
    rows[[R.PAPER_SPEED, R.PAPER_SPEED1]] = 1.0


def _wip_family(f: _Filler) -> None:
    """Contract section 2: wip, and cartpole, pendulum and linear_axis as its special cases."""
    plain = _rigid_body(f, with_event=False)
    for row, value in zip((R.MASS, R.COUPLING, R.INERTIA, R.GRAVITY), plain[:4], strict=True):
        f.rows[row] = value
    event = f.values("geometry/payload_event")
    if event is not None:
        f.present[R.ON_EVENT] = True
        loaded_body = _rigid_body(f, with_event=True)
        deltas = (R.EVENT_MASS, R.EVENT_COUPLING, R.EVENT_INERTIA, R.EVENT_GRAVITY, R.EVENT_WEIGHT)
        for row, after, before in zip(deltas, loaded_body, plain, strict=True):
            f.rows[row] = after - before
        f.rows[R.EVENT_TIME] = event["t0"]
    f.add("geometry/com_offset", None, theta_eq=R.BALANCE)
    tilt = f.values("environment/rail_tilt")
    if tilt is not None:
        f.present[R.ON_TILT] = True
        f.rows[R.TILT] = tilt["angle"]
        f.rows[R.TILT_FORCE] = plain[4]


def _rigid_body(f: _Filler, *, with_event: bool) -> tuple[np.ndarray, ...]:
    """Mass m11, coupling m_b L, inertia m22, gravity m_b g L, and weight along a tilted rail, each (P,)."""
    has = f.plant.parameters
    zero = np.zeros(f.batch.size)
    body = f.plant_value("body_mass")
    com = f.plant_value("com_height") if "com_height" in has else zero
    inertia = f.plant_value("body_inertia") if "body_inertia" in has else zero
    scale = f.values("geometry/inertia")
    if scale is not None:
        inertia = inertia * scale["scale"]
    extras = ("geometry/payload", "geometry/payload_event") if with_event else ("geometry/payload",)
    for name in extras:
        extra = f.values(name)
        if extra is not None:
            body, com, inertia = loaded(body, com, inertia, extra["mass"], extra["height"])
    gravity = f.plant_value("gravity")
    rotor = [f.values(f"{site}/rotor_inertia") for site in ("translation", "pitch")]
    one = np.ones(f.batch.size)
    if "translation" in f.plant.joints:
        carriage = f.plant_value("wheel_mass")
        rolling = f.plant_value("wheel_inertia") / f.plant_value("wheel_radius") ** 2
        mass = body + carriage + rolling + (rotor[0]["J"] if rotor[0] else 0.0)
    else:
        carriage, mass = zero, one
    tilt = f.values("environment/rail_tilt")
    weight = (body + carriage) * gravity * np.sin(tilt["angle"]) if tilt else zero
    if "pitch" not in f.plant.joints:
        return mass, zero, one, zero, weight
    turning = body * com**2 + inertia + (rotor[1]["J"] if rotor[1] else 0.0)
    coupling = body * com if "translation" in f.plant.joints else zero
    return mass, coupling, turning, body * gravity * com, weight


def _double_pendulum(f: _Filler) -> None:
    """Double pendulum, theta1 = 0 hanging, theta2 relative to link 1; inertias about the joints."""
    f.present[R.ON_DOUBLE] = True
    mass1, mass2 = f.plant_value("link1_mass"), f.plant_value("link2_mass")
    length1, com1, com2 = f.plant_value("link1_length"), f.plant_value("link1_com"), f.plant_value("link2_com")
    gravity = f.plant_value("gravity")
    f.rows[R.DP_ELBOW] = f.plant_value("link2_inertia")
    f.rows[R.DP_BASE] = f.plant_value("link1_inertia") + mass2 * length1**2 + f.rows[R.DP_ELBOW]
    f.rows[R.DP_COUPLING] = mass2 * length1 * com2
    f.rows[R.DP_GRAVITY] = mass2 * com2 * gravity
    f.rows[R.DP_GRAVITY1] = (mass1 * com1 + mass2 * length1) * gravity
    f.add("joint1/rotor_inertia", None, J=R.ROTOR)
    f.add("joint2/rotor_inertia", None, J=R.ROTOR1)


def _environment(f: _Filler) -> None:
    f.add("environment/spring", R.ON_SPRING, k=R.SPRING, x0=R.SPRING_REST)


def _actuator(f: _Filler) -> None:
    f.add("actuator/delay", R.ON_DELAY, tau=R.DELAY)
    f.add("actuator/offset", R.ON_OFFSET, F_0=R.OFFSET)
    f.add("actuator/dead_zone", R.ON_DEAD_ZONE, band=R.DEAD_BAND)
    f.add("actuator/back_emf", R.ON_BACK_EMF, k_e=R.BACK_EMF)
    f.add("actuator/ripple", R.ON_RIPPLE, A=R.RIPPLE, phase=R.RIPPLE_PHASE)
    for name, flag, targets in (
        ("actuator/gain", None, {"k": R.GAIN}),
        ("actuator/saturation", R.ON_SATURATION, {"F_max": R.FORCE_MAX}),
        ("actuator/speed_limit", R.ON_SPEED_LIMIT, {"F_stall": R.STALL, "v_free": R.FREE_SPEED}),
        (
            "actuator/backlash",
            R.ON_BACKLASH,
            {"gap": R.GAP, "drive_inertia": R.DRIVE_INERTIA, "drive_damping": R.DRIVE_DAMPING, "returned": R.RETURNED},
        ),
    ):
        _replace(f, name, flag, targets)
    backlash = f.values("actuator/backlash")
    if backlash is not None:
        f.rows[R.CONTACT_RATE] = 1.0 / np.maximum(backlash["contact_time"], FASTEST_LAG)
    lag = f.values("actuator/lag")
    if lag is not None:
        f.present[R.ON_LAG] = True
        f.rows[R.LAG_RATE] = 1.0 / np.maximum(lag["tau"], FASTEST_LAG)
    ripple = f.values("actuator/ripple")
    if ripple is not None:
        has_wheel = "wheel_radius" in f.plant.parameters
        f.rows[R.RIPPLE_PERIODS] = ripple["n"] / (f.plant_value("wheel_radius") if has_wheel else 1.0)


def _replace(f: _Filler, name: str, flag: int | None, targets: dict[str, int]) -> None:
    values = f.values(name)
    if values is None:
        return
    if flag is not None:
        f.present[flag] = True
    for symbol, row in targets.items():
        f.rows[row] = values[symbol]


def _joint(f: _Filler, site: str, j: int) -> None:
    f.add(f"{site}/viscous", R.ON_DAMPING, sigma=R.VISCOUS + j)
    f.add(f"{site}/quadratic_drag", R.ON_DRAG + j, c=R.DRAG + j)
    for name, plus, minus in (
        ("coulomb", "F_c", "F_c"),
        ("asymmetric_coulomb", "F_plus", "F_minus"),
        ("stribeck", "F_c", "F_c"),
    ):
        f.add(f"{site}/{name}", R.ON_FRICTION, **{plus: R.LEVEL_PLUS + j})
        f.add(f"{site}/{name}", R.ON_FRICTION, **{minus: R.LEVEL_MINUS + j})
    stribeck = {"F_s": R.STATIC + j, "F_c": R.COULOMB + j, "v_s": R.STRIBECK_SPEED + j}
    _replace(f, f"{site}/stribeck", R.ON_STRIBECK + j, stribeck)
    _replace(f, f"{site}/sticky_spot", R.ON_SPOT, {"F_c": R.SPOT, "lo": R.SPOT_LOW, "hi": R.SPOT_HIGH})
    _replace(
        f, f"{site}/load_friction", R.ON_LOAD + j, {"K_motor": R.LOAD_MOTOR + j, "K_external": R.LOAD_EXTERNAL + j}
    )
    if f.present[[R.ON_SPOT, R.ON_LOAD + j]].any():
        f.present[R.ON_FRICTION] = True
    bristle = {"F_c": R.SLIDING + j, "stiffness": R.BRISTLE + j, "damping": R.BRISTLE_DAMPING + j}
    peak, shape = {"F_s": R.PEAK + j, "v_s": R.PEAK_SPEED + j}, {"n": R.EXPONENT + j, "gamma": R.GAMMA + j}
    _replace(f, f"{site}/presliding", R.ON_BRISTLE + j, bristle)
    _replace(f, f"{site}/lugre", R.ON_BRISTLE + j, {**bristle, **peak})
    _replace(f, f"{site}/hysteresis", R.ON_HYSTERESIS + j, {**bristle, **shape})
    f.present[R.ON_BRISTLE + j] |= f.present[R.ON_HYSTERESIS + j]
    if f.present[R.ON_BRISTLE + j]:
        f.present[R.ON_DAMPING] = True
        # A bristle without a level slides at once; from rest it would first be a spring.
        held = np.maximum(f.rows[R.SLIDING + j], f.rows[R.PEAK + j]) > 0.0
        f.rows[[R.BRISTLE + j, R.BRISTLE_DAMPING + j]] *= held
    _remainder(f, site, j)
    swing = f.values(f"{site}/resonance")
    if swing is not None:
        f.present[R.ON_SWING + j] = True
        pulsation = 2.0 * np.pi * swing["f"]
        f.rows[R.SWING + j] = swing["m"]
        f.rows[R.SWING_STIFFNESS + j] = pulsation**2
        f.rows[R.SWING_DAMPING + j] = 2.0 * swing["zeta"] * pulsation
    paper = f.values(f"{site}/lagged_stribeck")
    if paper is not None:
        f.present[R.ON_PAPER + j] = True
        for symbol, row in (
            ("F_s", R.PAPER_STATIC),
            ("F_c", R.PAPER_COULOMB),
            ("v_s", R.PAPER_SPEED),
            ("sigma", R.PAPER_VISCOUS),
            ("epsilon", R.PAPER_EPSILON),
        ):
            f.rows[row + j] = paper[symbol]
        f.rows[R.PAPER_RATE + j] = 1.0 / np.maximum(lag_of(paper["alpha"]), FASTEST_LAG)


def _remainder(f: _Filler, site: str, j: int) -> None:
    values = f.values(f"{site}/remainder")
    if values is None:
        return
    f.present[R.ON_REMAINDER + j] = True
    for symbol, row in (("signal", R.REMAINDER_SIGNAL), ("factor", R.REMAINDER_FACTOR), ("low", R.REMAINDER_LOW)):
        f.rows[row + j] = values[symbol]
    f.present[R.ON_FRICTION] |= bool(np.any(values["factor"] < 0.0))
    f.rows[R.REMAINDER_PER_UNIT + j] = (KNOTS - 1) / np.maximum(values["high"] - values["low"], 1e-12)
    for i in range(KNOTS):
        f.rows[R.REMAINDER + 2 * i + j] = values[f"f{i}"]


def _sensor(f: _Filler, site: str, j: int) -> None:
    f.add(f"{site}/bias", None, b=R.BIAS + j)
    f.add(f"{site}/scale", None, e=R.SCALE + j)
    f.add(f"{site}/delay", R.ON_SENSOR_DELAY, tau=R.SENSOR_DELAY + j)
