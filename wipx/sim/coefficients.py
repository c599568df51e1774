"""From models to the coefficients of the equations of motion, for a whole batch at once.

Each effect says itself which rows it fills (`wipx.core.effect.Effect.rows`); here they are put together, and geometry
acts (payload, inertia, reflected rotor inertia): everything that is constant during a rollout. What happens in a step
is in `wipx.sim.kernel`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from wipx.core.effect import Columns, Effect
from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.effects.catalogue import kind_of, kinds
from wipx.effects.payload import loaded
from wipx.sim import rows as R


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
        self.rows = np.repeat(_neutral_rows(tuple(kinds()))[:, None], batch.size, axis=1)
        self.present = np.zeros(R.N_FLAGS, dtype=np.bool_)

    def plant_value(self, name: str) -> np.ndarray:
        return self.batch.column(name)

    def values(self, name: str) -> dict[str, np.ndarray] | None:
        """Parameters of an effect as arrays (P,), or None where it is absent; those not given have their defaults."""
        if name not in self.effects:
            return None
        parameters = kind_of(name).parameters
        found = {p.name: np.full(self.batch.size, p.default) for p in parameters if p.default is not None}
        return found | {symbol: self.batch.column(f"{name}.{symbol}") for symbol in self.effects[name]}

    def add_effects(self) -> None:
        """Fill the rows of all effects, and raise their flags."""
        body = {name: self.plant_value(name) for name in self.plant.parameters}
        filled: set[int] = set()
        for name in self.effects:
            site, effect, values = name.partition("/")[0], kind_of(name), self.values(name)
            if site not in self.plant.sites or values is None:
                continue
            for row, value in _rows(effect, values, body):
                first = row_at(row, site, self.plant)
                for i, each in enumerate(np.atleast_2d(value)):
                    place = first + 2 * i
                    self.rows[place] = self.rows[place] + each if place in filled else each
                    filled.add(place)
            for part in effect.parts(values) if callable(effect.parts) else effect.parts:
                self.present[row_at(part, site, self.plant, prefix="ON_")] = True


def _rows(effect: Effect, values: Columns, body: Columns) -> Iterator[tuple[str, np.ndarray]]:
    """Names of the rows that an effect fills, each with its value, shape (P,) or (n, P)."""
    for row, coefficient in effect.rows.items():
        yield row, values[coefficient] if isinstance(coefficient, str) else coefficient(values, body)


@cache
def _neutral_rows(known: tuple[str, ...]) -> np.ndarray:
    """Rows without any effect, shape (N_COEFFICIENTS,): an absent effect equals one at its neutral values."""
    rows = np.zeros(R.N_COEFFICIENTS)
    rows[[R.MASS, R.INERTIA]] = 1.0
    for effect in (kinds()[kind] for kind in known):
        neutral = {symbol: np.array([value]) for symbol, value in effect.neutral.items()}
        for row, value in _rows(effect, neutral, {}):
            for name in (row, f"{row}1", f"SENSOR_{row}", f"SENSOR_{row}1"):
                if hasattr(R, name):
                    rows[getattr(R, name)] = np.ravel(value)[0]
    return rows


def coefficients(batch: ModelBatch, smoothing: tuple[float, ...] = ()) -> Coefficients:
    """The coefficients of every model of a batch.

    Args:
        batch: P models.
        smoothing: Speed over which the dry friction of each joint builds up [m/s, rad/s]; empty for sticking.
    """
    f = _Filler(batch)
    plant = f.plant
    f.rows[R.INPUT_GAIN] = f.plant_value("input_gain")
    f.add_effects()
    if plant.kind == "double_pendulum":
        _double_pendulum(f)
    else:
        _wip_family(f)
    for site, speed in zip(plant.joints, smoothing, strict=False):
        f.rows[R.SMOOTHING + joint_index(site)] = speed
        f.present[R.ON_SMOOTHING] = True
    actuated = np.zeros(2, dtype=np.bool_)
    actuated[[joint_index(site) for site in plant.actuated]] = True
    return Coefficients(f.rows, f.present, actuated)


def joint_index(site: str) -> int:
    """Row of a joint in the kernel: translation and joint1 are 0, pitch and joint2 are 1."""
    return {"translation": 0, "joint1": 0, "pitch": 1, "joint2": 1}[site]


def row_at(name: str, site: str, plant: Plant, prefix: str = "") -> int:
    """Number of the row that an effect at a site means by a name.

    Args:
        name: E.g. "VISCOUS". Of a pair it is the row of the site's joint; `X` is `SENSOR_X` at a sensor that has one.
        site: A site of the plant.
        plant: Whose joints count.
        prefix: Of the names of such rows.

    Raises:
        AttributeError: there is no such row.
    """
    base = f"{prefix}{name}"
    if site.startswith("sensor_") and hasattr(R, f"{prefix}SENSOR_{name}"):
        base = f"{prefix}SENSOR_{name}"
    second = joint_index(plant.joint_at(site)) == 1 and hasattr(R, f"{base}1")
    return getattr(R, f"{base}1" if second else base)


def _wip_family(f: _Filler) -> None:
    """Contract section 2: wip, and cartpole, pendulum and linear_axis as its special cases."""
    plain = _rigid_body(f, with_event=False)
    for row, value in zip((R.MASS, R.COUPLING, R.INERTIA, R.GRAVITY), plain[:4], strict=True):
        f.rows[row] = value
    if "geometry/payload_event" in f.effects:
        loaded_body = _rigid_body(f, with_event=True)
        deltas = (R.EVENT_MASS, R.EVENT_COUPLING, R.EVENT_INERTIA, R.EVENT_GRAVITY, R.EVENT_WEIGHT)
        for row, after, before in zip(deltas, loaded_body, plain, strict=True):
            f.rows[row] = after - before
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
