"""From models to the coefficients of the equations of motion, for a whole batch at once.

Each effect says itself which rows it fills (`wipx.core.effect.Effect.rows`); here they are put together, and geometry
acts (payload, inertia, reflected rotor inertia): everything that is constant during a rollout. What happens in a step
is in `wipx.sim.kernel`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from wipx.core.drive import Drive
from wipx.core.effect import Columns, Effect
from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.core.tree import Tree
from wipx.effects.catalogue import kind_of, kinds, of_trees
from wipx.effects.payload import loaded
from wipx.sim import body as B
from wipx.sim import rows as R
from wipx.sim.cache import part
from wipx.sim.tree import code
from wipx.sim.tree import equations as E
from wipx.sim.tree.inertias import gravity, inertial_numbers

NO_LIMIT = 1e12  # [N m or N] of a drive without one
ON = "ON_"  # names of flags begin so


@cache
def no_tree() -> Any:
    """What stands for the code of a tree where there is none; loaded when it is needed first."""

    @part
    def nothing(S, B, n, on, asked):
        pass

    return nothing


@dataclass(frozen=True)
class Coefficients:
    """What the kernel needs of a batch of models.

    Attributes:
        body: What the rows of the whole robot begin with, shape (rows, P).
        joints: And those of each joint, shape (N, BLOCK, P).
        on: Parts of the whole robot that are switched on, shape (FLAGS,).
        has: And of each joint, shape (N, JOINT_FLAGS).
        rigid: Code of a tree (`wipx.sim.cache.part`).
    """

    body: np.ndarray
    joints: np.ndarray
    on: np.ndarray
    has: np.ndarray
    rigid: Any


class _Filler:
    """Writes the rows of one batch."""

    def __init__(self, batch: ModelBatch) -> None:
        self.batch = batch
        self.effects = batch.model.effects
        self.plant = batch.model.plant
        self.body = np.zeros((body_rows(self.plant), batch.size))
        self.joints = np.repeat(_neutral_block(tuple(kinds()))[None, :, None], joint_count(self.plant), axis=0)
        self.joints = np.repeat(self.joints, batch.size, axis=2)
        self.on = np.zeros(R.FLAGS, dtype=np.bool_)
        self.has = np.zeros((len(self.joints), R.JOINT_FLAGS), dtype=np.bool_)

    def values(self, name: str) -> dict[str, np.ndarray] | None:
        """Parameters of an effect as arrays (P,), or None where it is absent; those not given have their defaults."""
        if name not in self.effects:
            return None
        found = {p.name: np.full(self.batch.size, p.default) for p in kind_of(name).parameters if p.default is not None}
        return found | {symbol: self.batch.column(f"{name}.{symbol}") for symbol in self.effects[name]}

    def add_effects(self) -> None:
        """Fill the rows of all effects, and raise their flags."""
        body = {name: self.batch.column(name) for name in self.plant.parameters}
        filled: set[tuple[int, int]] = set()
        for name in self.effects:
            site, effect, values = name.partition("/")[0], kind_of(name), self.values(name)
            if site not in self.plant.sites or values is None:
                continue
            for row, value in _rows(effect, values, body):
                for j in joints_of(row, site, self.plant):
                    rows = self.body if j < 0 else self.joints[j]
                    for i, each in enumerate(np.atleast_2d(value), row_at(row, site)):
                        rows[i] = rows[i] + each if (j, i) in filled else each
                        filled.add((j, i))
            for stage in effect.parts(values) if callable(effect.parts) else effect.parts:
                for j in joints_of(f"{ON}{stage}", site, self.plant):
                    flags = self.on if j < 0 else self.has[j]
                    flags[row_at(f"{ON}{stage}", site)] = True


def _rows(effect: Effect, values: Columns, body: Columns) -> Iterator[tuple[str, np.ndarray]]:
    """Names of the rows that an effect fills, each with its value, shape (P,) or (n, P)."""
    for row, coefficient in effect.rows.items():
        yield row, values[coefficient] if isinstance(coefficient, str) else coefficient(values, body)


@cache
def _neutral_block(known: tuple[str, ...]) -> np.ndarray:
    """Rows of a joint without any effect, shape (BLOCK,): an absent effect equals one at its neutral values."""
    rows = np.zeros(R.BLOCK)
    for effect in (*(kinds()[kind] for kind in known), *of_trees().values()):
        neutral = {symbol: np.array([value]) for symbol, value in effect.neutral.items()}
        for row, value in _rows(effect, neutral, {}):
            for name in (row, f"SENSOR_{row}"):
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
    f.add_effects()
    if plant.tree is not None:
        rigid = _tree(f, plant.tree)
    elif plant.kind == "double_pendulum":
        rigid = _double_pendulum(f)
    else:
        rigid = _wip_family(f)
    for site in plant.actuated:
        j = joint_index(plant, site)
        f.has[j, R.ACTUATED] = True
        f.joints[j, R.INPUT_GAIN] = _input_gain(f, site)
        if site in plant.drives and plant.drives[site].kind == "position":
            _servo(f, site, plant.drives[site])
    for site, speed in zip(plant.joints, smoothing, strict=False):
        f.joints[joint_index(plant, site), R.SMOOTHING] = speed
        f.on[R.ON_SMOOTHING] = True
    f.has[:, R.ON_PATH] = f.has[:, list(R.PATH)].any(axis=1)
    f.has[:, R.ON_LAWS] = f.has[:, list(R.LAWS)].any(axis=1)
    f.has[:, R.ON_MEMORY] = f.has[:, list(R.MEMORY)].any(axis=1)
    f.on[R.ON_TIME] |= f.on[R.ON_DELAY] or f.on[R.ON_EVENT] or f.has[:, [R.ON_REMAINDER, R.ON_SAG]].any()
    return Coefficients(f.body, f.joints, f.on, f.has, rigid)


def sensors_are_late(batch: ModelBatch) -> bool:
    """Whether sensors of models show where joints were some time before."""
    return bool(coefficients(batch).has[:, R.ON_SENSOR_DELAY].any())


def joint_count(plant: Plant) -> int:
    """Joints of a plant in the kernel."""
    return B.JOINTS if plant.tree is None else len(plant.joints)


def joint_index(plant: Plant, site: str) -> int:
    """Number of a joint in the kernel."""
    if plant.tree is not None:
        return plant.joints.index(site)
    return {"translation": 0, "joint1": 0, "pitch": 1, "joint2": 1}[site]


def body_rows(plant: Plant) -> int:
    """Rows of the whole robot."""
    return B.ROWS if plant.tree is None else code.row_count(len(plant.joints))


def row_at(name: str, site: str) -> int:
    """Number of the row, or of the flag, that an effect at a site means by a name; `X` is `SENSOR_X` at a sensor.

    Raises:
        AttributeError: there is no such row.
    """
    if site.startswith("sensor_"):
        sensor = f"{ON}SENSOR_{name.removeprefix(ON)}" if name.startswith(ON) else f"SENSOR_{name}"
        name = sensor if hasattr(R, sensor) else name
    return getattr(B if hasattr(B, name) else R, name)


def joints_of(name: str, site: str, plant: Plant) -> list[int]:
    """Joints whose blocks have the row or flag of that name for an effect at a site; -1 for the whole robot."""
    if (plant.tree is None and hasattr(B, name)) or (name.startswith(ON) and row_at(name, site) < R.FLAGS):
        return [-1]
    return [joint_index(plant, joint) for joint in plant.joints_at(site)]


def _wip_family(f: _Filler) -> Any:
    """Contract section 2: wip, and cartpole, pendulum and linear_axis as its special cases."""
    f.body[[B.MASS, B.INERTIA]] = 1.0  # of a joint that the plant lacks
    plain = _rigid_body(f, with_event=False)
    for row, value in zip((B.MASS, B.COUPLING, B.INERTIA, B.GRAVITY), plain[:4], strict=True):
        f.body[row] = value
    if "geometry/payload_event" in f.effects:
        loaded_body = _rigid_body(f, with_event=True)
        deltas = (B.EVENT_MASS, B.EVENT_COUPLING, B.EVENT_INERTIA, B.EVENT_GRAVITY, B.EVENT_WEIGHT)
        for row, after, before in zip(deltas, loaded_body, plain, strict=True):
            f.body[row] = after - before
    f.body[B.TILT_FORCE] = plain[4]
    return no_tree()


def _rigid_body(f: _Filler, *, with_event: bool) -> tuple[np.ndarray, ...]:
    """Mass m11, coupling m_b L, inertia m22, gravity m_b g L, and weight along a tilted rail, each (P,)."""
    has = f.plant.parameters
    zero = np.zeros(f.batch.size)
    body = f.batch.column("body_mass")
    com = f.batch.column("com_height") if "com_height" in has else zero
    inertia = f.batch.column("body_inertia") if "body_inertia" in has else zero
    scale = f.values("geometry/inertia")
    if scale is not None:
        inertia = inertia * scale["scale"]
    extras = ("geometry/payload", "geometry/payload_event") if with_event else ("geometry/payload",)
    for name in extras:
        extra = f.values(name)
        if extra is not None:
            body, com, inertia = loaded(body, com, inertia, extra["mass"], extra["height"])
    gravity = f.batch.column("gravity")
    rotor = [f.values(f"{site}/rotor_inertia") for site in ("translation", "pitch")]
    one = np.ones(f.batch.size)
    if "translation" in f.plant.joints:
        carriage = f.batch.column("wheel_mass")
        rolling = f.batch.column("wheel_inertia") / f.batch.column("wheel_radius") ** 2
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


def _double_pendulum(f: _Filler) -> Any:
    """Double pendulum, theta1 = 0 hanging, theta2 relative to link 1; inertias about the joints."""
    column = f.batch.column
    mass1, mass2 = column("link1_mass"), column("link2_mass")
    length1, com1, com2 = column("link1_length"), column("link1_com"), column("link2_com")
    gravity = column("gravity")
    f.body[B.DP_ELBOW] = column("link2_inertia")
    f.body[B.DP_BASE] = column("link1_inertia") + mass2 * length1**2 + f.body[B.DP_ELBOW]
    f.body[B.DP_COUPLING] = mass2 * length1 * com2
    f.body[B.DP_GRAVITY] = mass2 * com2 * gravity
    f.body[B.DP_GRAVITY1] = (mass1 * com1 + mass2 * length1) * gravity
    f.on[R.ON_DOUBLE] = True
    return no_tree()


def _tree(f: _Filler, tree: Tree) -> Any:
    """A robot from a model file: inertial numbers of its links, and what the file gives its joints beside effects."""
    joints = len(tree.links)
    first = code.gravity_row(joints)
    f.body[first : first + code.GRAVITY] = gravity(f.batch, tree)
    for i, link in enumerate(tree.links):
        first = code.number_row(joints, i)
        f.body[first : first + E.NUMBERS] = inertial_numbers(f.batch, link)
        damping, friction, armature = (
            f.batch.column(f"{link.joint}.{name}") for name in ("damping", "friction", "armature")
        )
        f.joints[i, R.VISCOUS] += damping
        f.joints[i, R.ROTOR] += armature
        f.joints[i, [R.LEVEL_PLUS, R.LEVEL_MINUS]] += friction
        f.on[R.ON_DAMPING] |= bool(damping.any())
        f.on[R.ON_FRICTION] |= bool(friction.any())
    f.on[R.ON_TREE] = True
    return code.rigid_body(tree)


def _servo(f: _Filler, site: str, drive: Drive) -> None:
    """The loop of a position drive; its rows hold the factors by which effects change its numbers."""
    j = joint_index(f.plant, site)
    f.has[j, R.ON_SERVO] = True
    f.joints[j, R.SERVO_KP] *= f.batch.column(f"{site}.kp")
    f.joints[j, R.SERVO_KD] *= f.batch.column(f"{site}.kd")
    f.joints[j, R.SERVO_LIMIT] = NO_LIMIT if drive.limit is None else drive.limit
    f.joints[j, R.SERVO_PERIOD] = 0.0 if drive.rate is None else 1.0 / drive.rate
    f.on[R.ON_TIME] |= drive.rate is not None


def _input_gain(f: _Filler, site: str) -> np.ndarray:
    """Force of a drive per unit of its command, shape (P,)."""
    name = "input_gain" if f.plant.tree is None else f"{site}.gain"
    return f.batch.column(name) if name in f.plant.parameters else np.ones(f.batch.size)
