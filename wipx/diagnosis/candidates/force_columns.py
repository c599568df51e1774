"""Forces per unit of what links, joints, drives and sensors may do beside what the model says, from recorded motion.

What a law adds to the forces is a sum of such columns. Laws that are not proportional to their numbers, such as those
of a delay or a limit, have a column for each of several values and are interpolated between them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.core.tree import Tree
from wipx.identify.inverse_dynamics import (
    Signals,
    commanded_forces,
    gravity_regressor,
    inverse_dynamics,
    missing,
    numbers,
    regressor,
    signals_of,
    weight_of,
)
from wipx.identify.motion import Motion, motions
from wipx.identify.noise import sensor_noise
from wipx.sim.tree.inertias import gravity

SHIFT = 1e-4  # over which slopes are taken, in SI units or as a share
DELAYS = (0.005, 0.012, 0.025, 0.05)  # [s]
LAGS = (0.005, 0.015, 0.04, 0.1)  # [s]
LIMITS = (0.03, 0.08, 0.16, 0.3, 0.5, 0.75, 1.0)  # of the largest force that was commanded
LOAD_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the load, beside the motor, in the force that rubs
STRIBECK_SPEEDS = (0.05, 0.15, 0.5)  # of the joint's root mean square speed
POSTURES = 30  # of which the mean inertia is taken

DIRECTION, RATE, ACCELERATION, COORDINATE, MINUS_ONE, NEEDED, DRAG = range(7)
_GROUPS = (DRAG + 1, len(LOAD_SHARES), 1, len(DELAYS), len(LAGS), len(LIMITS), len(STRIBECK_SPEEDS))
_ENDS = np.cumsum(_GROUPS).tolist()
RUBBED, STIFFNESS, DELAYED, LAGGED, CLIPPED, BUMPS = (np.arange(first, end) for first, end in pairwise(_ENDS))
OWN = _ENDS[-1]  # columns of a joint
SENSOR = 3  # columns of a sensor: bias, scale, delay


@dataclass(frozen=True)
class Ranges:
    """What joints do at most or usually, by which values are chosen at which a law has a column.

    Attributes:
        forces: Largest force that was commanded, shape (joints,) [N m or N].
        rates: Root mean square speed, shape (joints,) [rad/s or m/s].
    """

    forces: np.ndarray
    rates: np.ndarray

    @classmethod
    def of(cls, model: Model, recorded: Sequence[Motion]) -> "Ranges":
        """Those of recorded motions."""
        forces = np.concatenate([commanded_forces(model, motion) for motion in recorded])
        rates = np.concatenate([motion.rates for motion in recorded])
        return cls(np.max(np.abs(forces), axis=0), np.sqrt(np.mean(rates**2, axis=0)))

    @property
    def limits(self) -> np.ndarray:
        """Levels at which forces are clipped, shape (LIMITS, joints) [N m or N]."""
        return np.array(LIMITS)[:, None] * self.forces

    @property
    def stribeck_speeds(self) -> np.ndarray:
        """Shape (STRIBECK_SPEEDS, joints) [rad/s or m/s]."""
        return np.array(STRIBECK_SPEEDS)[:, None] * self.rates


@dataclass(frozen=True, eq=False)
class ForceColumns:
    """Forces of the joints per unit of every size, and what they add up to.

    Attributes:
        lacking: That the motion needs and the model does not give, shape (rows, joints).
        shared: Of several joints, shape (rows, joints, S): per inertial number of each link, per roll and pitch of the
            base, per bias, scale and delay of each sensor.
        own: Of each joint alone, shape (rows, joints, OWN).
        inertia: What each column adds to the inertia that a joint feels, relative to it, shape (joints, count).
    """

    lacking: np.ndarray
    shared: np.ndarray
    own: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, model: Model, recorded: Sequence[Motion], ranges: Ranges, kept: Sequence[slice]) -> "ForceColumns":
        """Those of some rows of recorded motions."""
        tree = tree_of(model)
        signals = signals_of(model, recorded, kept)
        inertial = regressor(tree, signals, weight_of(model))
        lacking = missing(model, signals, inertial)
        tilted = gravity_regressor(tree, signals, numbers(model)) @ _tilts(model, tree)
        sensors = [_sensor(model, recorded, kept, j, lacking) for j in range(len(tree.links))]
        shared = np.concatenate([inertial, tilted, *sensors], axis=2)
        parts = [_of_drives(model, *each, ranges) for each in zip(recorded, kept, strict=True)]
        of_drives = np.concatenate(parts)
        own = np.concatenate([_of_motion(model, signals, lacking), of_drives], axis=2)
        return cls(lacking, shared, own, _inertia(model, signals, shared.shape[2]))

    def extrapolated(self, wider: "ForceColumns") -> "ForceColumns":
        """Without the bias of the filter, from the same columns behind a filter that is wider by the root of two."""
        pairs = ((getattr(self, each.name), getattr(wider, each.name)) for each in fields(self))
        return ForceColumns(*(2.0 * narrow - wide for narrow, wide in pairs))

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.shared.shape[2] + self.own.shape[1] * self.own.shape[2]

    @property
    def sizes(self) -> np.ndarray:
        """Sum of squares of every column, shape (count,)."""
        return np.concatenate([np.sum(self.shared**2, axis=(0, 1)), np.sum(self.own**2, axis=0).ravel()])

    def of_joint(self, j: int) -> np.ndarray:
        """All columns in the force of one joint, shape (rows, count)."""
        alone = np.zeros((len(self.own), *self.own.shape[1:]))
        alone[:, j] = self.own[:, j]
        return np.concatenate([self.shared[:, j], alone.reshape(len(alone), -1)], axis=1)

    def left(self, sizes: np.ndarray) -> np.ndarray:
        """Force that stays at each joint, shape (rows, joints), for sizes (count,)."""
        shared, own = np.split(sizes, [self.shared.shape[2]])
        return self.lacking + self.shared @ shared + np.sum(self.own * own.reshape(self.own.shape[1:]), axis=2)


def force_columns(model: Model, recordings: tuple[Recording, ...]) -> tuple[ForceColumns, Ranges]:
    """Forces that the motion needs and the model does not give, what may add to them, and the ranges of both.

    Products of smoothed signals are not the smoothed products: they err by the square of the filter's width. So they
    are extrapolated to no width from two of them (Richardson 1911).
    """
    noise = sensor_noise(recordings, model.plant)
    narrow, wide = (motions(recordings, model.plant, noise, wider=width) for width in (1.0, np.sqrt(2.0)))
    ranges = Ranges.of(model, narrow)
    kept = [motion.kept for motion in wide]
    columns = [ForceColumns.of(model, each, ranges, kept) for each in (narrow, wide)]
    return columns[0].extrapolated(columns[1]), ranges


def _inertia(model: Model, signals: Signals, shared: int) -> np.ndarray:
    """What each column adds to the inertia that a joint feels, relative to it, shape (joints, count).

    Args:
        model: Whose links move.
        signals: Rows, some of which are looked at.
        shared: Number of columns of several joints.
    """
    tree = tree_of(model)
    few = slice(None, None, max(1, len(signals.rates) // POSTURES))
    q = signals.coordinates[few]
    still = Signals(q, np.zeros_like(q), np.zeros_like(q), np.zeros_like(q), np.zeros_like(q))
    found = np.zeros((len(tree.links), shared + OWN * len(tree.links)))
    own = numbers(model)
    for j, link in enumerate(tree.links):
        first = shared + OWN * j
        moved = replace(still, accelerations=np.zeros_like(q) + np.eye(len(tree.links))[j])
        per_number = regressor(tree, moved, np.zeros(3))[:, j].mean(axis=0)
        rotor = model.effects.get(f"{link.joint}/rotor_inertia", {"J": 0.0})["J"]
        whole = per_number @ own + rotor + model.parameters[f"{link.joint}.armature"]
        found[j, : len(per_number)] = per_number / whole
        found[j, first + ACCELERATION], found[j, first + NEEDED] = 1.0 / whole, 1.0
    return found


def _of_motion(model: Model, signals: Signals, lacking: np.ndarray) -> np.ndarray:
    """The columns of a joint up to what rubs, shape (rows, joints, STIFFNESS)."""
    still = replace(signals, accelerations=np.zeros_like(signals.accelerations))
    load = inverse_dynamics(tree_of(model), still, numbers(model), weight_of(model))
    own = {
        DIRECTION: signals.slides,
        RATE: signals.rates,
        ACCELERATION: signals.accelerations,
        COORDINATE: signals.coordinates,
        MINUS_ONE: -np.ones_like(signals.rates),
        NEEDED: lacking + signals.forces,
        DRAG: signals.rates * np.abs(signals.rates),
    }
    rubbed = [np.abs((1.0 - share) * signals.forces + share * load) * signals.slides for share in LOAD_SHARES]
    return np.stack([*(own[column] for column in sorted(own)), *rubbed], axis=2)


def _of_drives(model: Model, motion: Motion, kept: slice, ranges: Ranges) -> np.ndarray:
    """The columns of a joint from the stiffness of its drive on, shape (rows, joints, OWN - the others)."""
    forces = commanded_forces(model, motion)
    direction = np.clip(motion.rates / motion.rest_speeds, -1.0, 1.0)
    own = [
        (forces - commanded_forces(_stiffer(model), motion)) / SHIFT,
        *(forces - commanded_forces(model, motion, delay) for delay in DELAYS),
        *(forces - _lagged(forces, motion.step / lag) for lag in LAGS),
        *(np.clip(forces, -limits, limits) for limits in ranges.limits),
        *(direction * np.exp(-((motion.rates / np.maximum(v, 1e-12)) ** 2)) for v in ranges.stribeck_speeds),
    ]
    return np.stack([motion.filtered(each)[kept] for each in own], axis=2)


def _lagged(forces: np.ndarray, steps: float) -> np.ndarray:
    """What a first-order lag of 1/steps rows makes of forces, from rest at the first row."""
    from scipy.signal import lfilter  # slow to import, and only robots from model files need it

    share = 1.0 - np.exp(-steps)
    first = (1.0 - share) * forces[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], forces, axis=0, zi=first)[0])


def _stiffer(model: Model) -> Model:
    """The model with position drives that are stiffer by a share of `SHIFT`."""
    joints = [joint for joint, drive in model.plant.drives.items() if drive.kind == "position"]
    known = {joint: model.effects.get(f"actuator_{joint}/kp", {}).get("factor", 1.0) for joint in joints}
    return model.with_effects({f"actuator_{j}/kp": {"factor": factor * (1.0 + SHIFT)} for j, factor in known.items()})


def _sensor(model: Model, recorded: Sequence[Motion], kept: Sequence[slice], j: int, lacking: np.ndarray) -> np.ndarray:
    """Change of the lacking forces per bias, scale and delay of the sensor of a joint, shape (rows, joints, SENSOR)."""

    def read_right(motion: Motion, bias: float, scale: float, delay: float) -> Motion:
        q, v, a = (each.copy() for each in (motion.coordinates, motion.rates, motion.accelerations))
        jerk = np.gradient(a[:, j], motion.step)
        q[:, j] += delay * v[:, j] - scale * q[:, j] - bias
        v[:, j] += delay * a[:, j] - scale * v[:, j]
        a[:, j] += delay * jerk - scale * a[:, j]
        return replace(motion, coordinates=q, rates=v, accelerations=a)

    changed = []
    for wrong in np.eye(SENSOR) * SHIFT:
        right = [read_right(motion, *wrong.tolist()) for motion in recorded]
        changed.append((missing(model, signals_of(model, right, kept)) - lacking) / SHIFT)
    return np.stack(changed, axis=2)


def _tilts(model: Model, tree: Tree) -> np.ndarray:
    """Change of gravity in the frame of the base per roll and pitch, shape (3, 2)."""
    tilt = model.effects.get("environment/base_tilt", {"roll": 0.0, "pitch": 0.0})
    here = weight_of(model)
    slopes = []
    for name in ("roll", "pitch"):
        moved = model.with_effects({"environment/base_tilt": {**tilt, name: tilt[name] + SHIFT}})
        slopes.append((gravity(ModelBatch(moved), tree)[:, 0] - here) / SHIFT)
    return np.stack(slopes, axis=1)


def tree_of(model: Model) -> Tree:
    """Links and joints of a robot from a model file."""
    assert model.plant.tree is not None
    return model.plant.tree
