"""From models to the coefficients of the equations of motion, for a whole batch at once.

This is where geometry acts (payload, inertia, reflected rotor inertia) and where effects of
one kind add up: everything that is constant during a rollout. What happens in a step is in
`wipx.sim.kernel`.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.effects.catalogue import kinds
from wipx.effects.lagged_stribeck import lag_of
from wipx.effects.payload import loaded
from wipx.effects.remainder import KNOTS
from wipx.sim import body as B
from wipx.sim import rows as R

FASTEST_LAG = 1e-30  # [s]; a lag of zero is one that settles at once


@dataclass(frozen=True)
class Coefficients:
    """What the kernel needs of a batch of models.

    Attributes:
        body: What the rows of the whole robot begin with, shape (rows, P).
        joints: And those of each joint, shape (N, BLOCK, P).
        on: Parts of the whole robot that are switched on, shape (FLAGS,).
        has: And of each joint, shape (N, JOINT_FLAGS).
        parts: Code of the rigid body.
    """

    body: np.ndarray
    joints: np.ndarray
    on: np.ndarray
    has: np.ndarray
    parts: tuple[object, object, object]


class _Filler:
    """Writes the rows of one batch."""

    def __init__(self, batch: ModelBatch) -> None:
        self.batch = batch
        self.effects = batch.model.effects
        self.plant = batch.model.plant
        self.rows = np.zeros((B.ROWS, batch.size))
        self.blocks = np.zeros((B.JOINTS, R.BLOCK, batch.size))
        self.on = np.zeros(R.FLAGS, dtype=np.bool_)
        self.has = np.zeros((B.JOINTS, R.JOINT_FLAGS), dtype=np.bool_)

    def plant_value(self, name: str) -> np.ndarray:
        return self.batch.column(name)

    def values(self, name: str) -> dict[str, np.ndarray] | None:
        """Parameters of an effect as arrays (P,), or None where it is absent; those not given have their defaults."""
        if name not in self.effects:
            return None
        parameters = kinds()[name.partition("/")[2]].parameters
        found = {p.name: np.full(self.batch.size, p.default) for p in parameters if p.default is not None}
        return found | {symbol: self.batch.column(f"{name}.{symbol}") for symbol in self.effects[name]}

    def add(self, name: str, j: int, **targets: int) -> bool:
        """Add the parameters of an effect to rows of joint j; whether there is such an effect."""
        values = self.values(name)
        for symbol, row in targets.items() if values is not None else ():
            self.blocks[j, row] += values[symbol]
        return values is not None

    def set(self, name: str, j: int, flag: int, **targets: int) -> bool:
        """Set rows of joint j to the parameters of an effect and raise its flag; whether there is such an effect."""
        values = self.values(name)
        for symbol, row in targets.items() if values is not None else ():
            self.blocks[j, row] = values[symbol]
        self.has[j, flag] |= values is not None
        return values is not None


def coefficients(batch: ModelBatch, smoothing: tuple[float, ...] = ()) -> Coefficients:
    """The coefficients of every model of a batch.

    Args:
        batch: P models.
        smoothing: Speed over which the dry friction of each joint builds up [m/s, rad/s]; empty for sticking.
    """
    f = _Filler(batch)
    plant = f.plant
    for block in f.blocks:
        _set_neutral(block)
    f.rows[[B.MASS, B.INERTIA]] = 1.0
    if plant.kind == "double_pendulum":
        body = B.double_body
        _double_pendulum(f)
    else:
        body = B.wip_body
        _wip_family(f)
    for site in plant.joints:
        j = joint_index(plant, site)
        _joint(f, site, j)
        _sensor(f, f"sensor_{plant.columns[site]}", j)
    for site in plant.actuated:
        _actuator(f, "actuator", joint_index(plant, site))
    f.has[0, R.ON_SPRING] = f.add("environment/spring", 0, k=R.SPRING, x0=R.SPRING_REST)
    for site, speed in zip(plant.joints, smoothing, strict=False):
        f.blocks[joint_index(plant, site), R.SMOOTHING] = speed
        f.on[R.ON_SMOOTHING] = True
    f.on[R.ON_TIME] = f.on[R.ON_DELAY] or f.on[R.ON_EVENT] or f.has[:, R.ON_REMAINDER].any()
    return Coefficients(f.rows, f.blocks, f.on, f.has, (body, body, body))


def joint_count(plant: Plant) -> int:
    """Joints of a plant in the kernel."""
    return B.JOINTS


def joint_index(plant: Plant, site: str) -> int:
    """Number of a joint in the kernel."""
    return {"translation": 0, "joint1": 0, "pitch": 1, "joint2": 1}[site]


def _set_neutral(block: np.ndarray) -> None:
    block[R.GAIN] = 1.0
    block[[R.FORCE_MAX, R.STALL, R.FREE_SPEED]] = 1e9
    block[[R.LAG_RATE, R.PAPER_RATE]] = 1.0 / FASTEST_LAG
    block[[R.DRIVE_INERTIA, R.STRIBECK_SPEED, R.PEAK_SPEED, R.PAPER_SPEED]] = 1.0


def _wip_family(f: _Filler) -> None:
    """Contract section 2: wip, and cartpole, pendulum and linear_axis as its special cases."""
    plain = _rigid_body(f, with_event=False)
    for row, value in zip((B.MASS, B.COUPLING, B.INERTIA, B.GRAVITY), plain[:4], strict=True):
        f.rows[row] = value
    event = f.values("geometry/payload_event")
    if event is not None:
        f.on[R.ON_EVENT] = True
        loaded_body = _rigid_body(f, with_event=True)
        deltas = (B.EVENT_MASS, B.EVENT_COUPLING, B.EVENT_INERTIA, B.EVENT_GRAVITY, B.EVENT_WEIGHT)
        for row, after, before in zip(deltas, loaded_body, plain, strict=True):
            f.rows[row] = after - before
        f.rows[B.EVENT_TIME] = event["t0"]
    balance = f.values("geometry/com_offset")
    if balance is not None:
        f.rows[B.BALANCE] = balance["theta_eq"]
    tilt = f.values("environment/rail_tilt")
    if tilt is not None:
        f.on[R.ON_TILT] = True
        f.rows[B.TILT] = tilt["angle"]
        f.rows[B.TILT_FORCE] = plain[4]


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
    mass1, mass2 = f.plant_value("link1_mass"), f.plant_value("link2_mass")
    length1, com1, com2 = f.plant_value("link1_length"), f.plant_value("link1_com"), f.plant_value("link2_com")
    gravity = f.plant_value("gravity")
    f.rows[B.DP_ELBOW] = f.plant_value("link2_inertia")
    f.rows[B.DP_BASE] = f.plant_value("link1_inertia") + mass2 * length1**2 + f.rows[B.DP_ELBOW]
    f.rows[B.DP_COUPLING] = mass2 * length1 * com2
    f.rows[B.DP_GRAVITY] = mass2 * com2 * gravity
    f.rows[B.DP_GRAVITY1] = (mass1 * com1 + mass2 * length1) * gravity
    f.add("joint1/rotor_inertia", 0, J=R.ROTOR)
    f.add("joint2/rotor_inertia", 1, J=R.ROTOR)


def _actuator(f: _Filler, site: str, j: int) -> None:
    block = f.blocks[j]
    f.has[j, R.ACTUATED] = True
    block[R.INPUT_GAIN] = f.plant_value("input_gain")
    f.on[R.ON_DELAY] |= f.add(f"{site}/delay", j, tau=R.DELAY)
    f.set(f"{site}/offset", j, R.ON_OFFSET, F_0=R.OFFSET)
    f.set(f"{site}/dead_zone", j, R.ON_DEAD_ZONE, band=R.DEAD_BAND)
    f.set(f"{site}/gain", j, R.ON_GAIN, k=R.GAIN)
    f.set(f"{site}/saturation", j, R.ON_SATURATION, F_max=R.FORCE_MAX)
    f.set(f"{site}/speed_limit", j, R.ON_SPEED_LIMIT, F_stall=R.STALL, v_free=R.FREE_SPEED)
    f.set(f"{site}/back_emf", j, R.ON_BACK_EMF, k_e=R.BACK_EMF)
    if f.set(f"{site}/lag", j, R.ON_LAG, tau=R.LAG_RATE):
        block[R.LAG_RATE] = 1.0 / np.maximum(block[R.LAG_RATE], FASTEST_LAG)
    if f.set(f"{site}/ripple", j, R.ON_RIPPLE, A=R.RIPPLE, phase=R.RIPPLE_PHASE, n=R.RIPPLE_PERIODS):
        block[R.RIPPLE_PERIODS] /= f.plant_value("wheel_radius") if "wheel_radius" in f.plant.parameters else 1.0
    gap = {"gap": R.GAP, "drive_inertia": R.DRIVE_INERTIA, "drive_damping": R.DRIVE_DAMPING, "returned": R.RETURNED}
    if f.set(f"{site}/backlash", j, R.ON_BACKLASH, **gap, contact_time=R.CONTACT_RATE):
        block[R.CONTACT_RATE] = 1.0 / np.maximum(block[R.CONTACT_RATE], FASTEST_LAG)
    f.has[j, R.ON_MEMORY] |= f.has[j, R.ON_LAG] or f.has[j, R.ON_BACKLASH]


def _joint(f: _Filler, site: str, j: int) -> None:
    block, has = f.blocks[j], f.has[j]
    damped = f.add(f"{site}/viscous", j, sigma=R.VISCOUS)
    has[R.ON_DRAG] = f.add(f"{site}/quadratic_drag", j, c=R.DRAG)
    dry = False
    for name, plus, minus in (
        ("coulomb", "F_c", "F_c"),
        ("asymmetric_coulomb", "F_plus", "F_minus"),
        ("stribeck", "F_c", "F_c"),
    ):
        dry |= f.add(f"{site}/{name}", j, **{plus: R.LEVEL_PLUS})
        dry |= f.add(f"{site}/{name}", j, **{minus: R.LEVEL_MINUS})
    f.set(f"{site}/stribeck", j, R.ON_STRIBECK, F_s=R.STATIC, F_c=R.COULOMB, v_s=R.STRIBECK_SPEED)
    dry |= f.set(f"{site}/sticky_spot", j, R.ON_SPOT, F_c=R.SPOT, lo=R.SPOT_LOW, hi=R.SPOT_HIGH)
    dry |= f.set(f"{site}/load_friction", j, R.ON_LOAD, K_motor=R.LOAD_MOTOR, K_external=R.LOAD_EXTERNAL)
    bristle = {"F_c": R.SLIDING, "stiffness": R.BRISTLE, "damping": R.BRISTLE_DAMPING}
    f.set(f"{site}/presliding", j, R.ON_BRISTLE, **bristle)
    f.set(f"{site}/lugre", j, R.ON_BRISTLE, **bristle, F_s=R.PEAK, v_s=R.PEAK_SPEED)
    f.set(f"{site}/hysteresis", j, R.ON_HYSTERESIS, **bristle, n=R.EXPONENT, gamma=R.GAMMA)
    has[R.ON_BRISTLE] |= has[R.ON_HYSTERESIS]
    if has[R.ON_BRISTLE]:
        damped = True
        # A bristle without a level slides at once; from rest it would first be a spring.
        held = np.maximum(block[R.SLIDING], block[R.PEAK]) > 0.0
        block[[R.BRISTLE, R.BRISTLE_DAMPING]] *= held
    values = f.values(f"{site}/remainder")
    if values is not None:
        dry |= bool(np.any(values["factor"] < 0.0))
        _remainder(f, values, j)
    if f.set(f"{site}/resonance", j, R.ON_SWING, m=R.SWING, f=R.SWING_STIFFNESS, zeta=R.SWING_DAMPING):
        pulsation = 2.0 * np.pi * block[R.SWING_STIFFNESS]
        block[R.SWING_STIFFNESS] = pulsation**2
        block[R.SWING_DAMPING] *= 2.0 * pulsation
    paper = {
        "F_s": R.PAPER_STATIC,
        "F_c": R.PAPER_COULOMB,
        "v_s": R.PAPER_SPEED,
        "sigma": R.PAPER_VISCOUS,
        "epsilon": R.PAPER_EPSILON,
        "alpha": R.PAPER_RATE,
    }
    if f.set(f"{site}/lagged_stribeck", j, R.ON_PAPER, **paper):
        block[R.PAPER_RATE] = 1.0 / np.maximum(lag_of(block[R.PAPER_RATE]), FASTEST_LAG)
    laws = [R.ON_DRAG, R.ON_STRIBECK, R.ON_SPOT, R.ON_LOAD, R.ON_BRISTLE, R.ON_PAPER, R.ON_REMAINDER, R.ON_SWING]
    has[R.ON_LAWS] = has[laws].any()
    has[R.ON_MEMORY] |= has[R.ON_PAPER]
    f.on[R.ON_DAMPING] |= damped
    f.on[R.ON_FRICTION] |= dry


def _remainder(f: _Filler, values: dict[str, np.ndarray], j: int) -> None:
    block = f.blocks[j]
    f.has[j, R.ON_REMAINDER] = True
    for symbol, row in (("signal", R.REMAINDER_SIGNAL), ("factor", R.REMAINDER_FACTOR), ("low", R.REMAINDER_LOW)):
        block[row] = values[symbol]
    block[R.REMAINDER_PER_UNIT] = (KNOTS - 1) / np.maximum(values["high"] - values["low"], 1e-12)
    for i in range(KNOTS):
        block[R.REMAINDER + i] = values[f"f{i}"]


def _sensor(f: _Filler, site: str, j: int) -> None:
    f.add(f"{site}/bias", j, b=R.BIAS)
    f.add(f"{site}/scale", j, e=R.SCALE)
    f.on[R.ON_SENSOR_DELAY] |= f.add(f"{site}/delay", j, tau=R.SENSOR_DELAY)
