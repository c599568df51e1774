"""Inverse dynamics of a robot from a model file, linear in the inertial numbers of its links, for signals in numpy.

Forces are those of the drives that the motion needs; laws of friction and drives are those of contract section 6 that
the literature fits: viscous and Coulomb friction, constant offsets, reflected inertia of the rotors, gains.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Tree
from wipx.identify.motion import Motion
from wipx.sim.tree import equations as E
from wipx.sim.tree.inertias import gravity, inertial_numbers


@dataclass(frozen=True, eq=False)
class Signals:
    """What the joints do, on rows of any recordings.

    Attributes:
        coordinates: Shape (rows, joints) [rad or m].
        rates: Likewise.
        accelerations: Likewise.
        forces: Of the drives without any effect, shape (rows, joints) [N m or N]; zero at a passive joint.
        slides: Direction of motion, from -1 to 1 where noise cannot feign it, shape (rows, joints).
    """

    coordinates: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    forces: np.ndarray
    slides: np.ndarray


def signals_of(model: Model, motions: Sequence[Motion], kept: Sequence[slice] | None = None) -> Signals:
    """Kept rows of smoothed recordings; forces pass the same filter as positions.

    Args:
        model: Whose drives act; only gains of torque drives, stiffness, damping and limits of position drives count.
        motions: Smoothed recordings.
        kept: Rows of each of them; None for those that a fit uses.
    """
    kept = kept or [motion.kept for motion in motions]
    parts = [_signals(model, motion, rows) for motion, rows in zip(motions, kept, strict=True)]
    return Signals(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _signals(model: Model, motion: Motion, kept: slice) -> tuple[np.ndarray, ...]:
    slides = motion.filtered(np.clip(motion.rates / motion.rest_speeds, -1.0, 1.0))
    parts = (
        motion.coordinates,
        motion.rates,
        motion.accelerations,
        motion.filtered(commanded_forces(model, motion)),
        slides,
    )
    return tuple(part[kept] for part in parts)


def commanded_forces(model: Model, motion: Motion, delay: float = 0.0) -> np.ndarray:
    """Forces of the drives, as commanded a `delay` [s] before, not filtered, shape (N, joints).

    Args:
        model: See `signals_of`.
        motion: A smoothed recording.
        delay: Of the commands.
    """
    plant = model.plant
    forces, commands = np.zeros_like(motion.coordinates), motion.commands(delay)
    for i, site in enumerate(plant.actuated):
        j, drive = plant.joints.index(site), plant.drives[site]
        if drive.kind == "position":
            stiffness, damping = model.servo(site)
            force = stiffness * (commands[:, i] - motion.coordinates[:, j]) - damping * motion.rates[:, j]
            forces[:, j] = force if drive.limit is None else np.clip(force, -drive.limit, drive.limit)
        else:
            forces[:, j] = model.parameters[f"{site}.gain"] * commands[:, i]
    return forces


def regressor(tree: Tree, signals: Signals, weight: np.ndarray) -> np.ndarray:
    """Forces of the joints per unit of each inertial number, shape (rows, joints, 10 N).

    Args:
        tree: Links and joints.
        signals: Motion.
        weight: Gravity in the frame of the base, shape (3,) [m/s^2].
    """
    count = E.NUMBERS * len(tree.links)
    return np.stack([inverse_dynamics(tree, signals, one, weight) for one in np.eye(count)], axis=2)


def inverse_dynamics(tree: Tree, signals: Signals, inertial: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Forces of the joints that links need for a motion, shape (rows, joints) [N m or N].

    Args:
        tree: Links and joints.
        signals: Motion.
        inertial: Inertial numbers of all links, shape (10 N,).
        weight: Gravity in the frame of the base, shape (3,) [m/s^2].
    """
    q, v, a = (each.T for each in (signals.coordinates, signals.rates, signals.accelerations))
    poses = _poses(tree, q)
    own = [_inertia(each) for each in inertial.reshape(-1, E.NUMBERS)]
    pull = (float(weight[0]), float(weight[1]), float(weight[2]))
    accelerating = E.product(tree, E.mass_matrix(tree, poses, own, [0.0] * len(q)), list(a))
    others = E.bias(tree, poses, list(v), own, pull)
    needed = (np.asarray(x + y, dtype=float) for x, y in zip(accelerating, others, strict=True))
    return np.stack([np.broadcast_to(force, q.shape[1]) for force in needed], axis=1)


def gravity_regressor(tree: Tree, signals: Signals, inertial: np.ndarray) -> np.ndarray:
    """Forces of the joints per unit of each component of gravity in the frame of the base, shape (rows, joints, 3).

    Args:
        tree: Links and joints.
        signals: Motion.
        inertial: Inertial numbers of all links, shape (10 N,).
    """
    q = signals.coordinates.T
    poses = _poses(tree, q)
    own = [_inertia(each) for each in inertial.reshape(-1, E.NUMBERS)]
    found = np.zeros((q.shape[1], len(q), 3))
    for axis in range(3):
        x, y, z = np.eye(3)[axis].tolist()
        for j, force in enumerate(E.bias(tree, poses, [0.0] * len(q), own, (x, y, z))):
            found[:, j, axis] = np.asarray(force, dtype=float)
    return found


def _poses(tree: Tree, q: np.ndarray) -> list[E.Pose]:
    """Of all links, for coordinates (joints, rows)."""
    return [E.pose(link, q[i], np.sin(q[i]), np.cos(q[i])) for i, link in enumerate(tree.links)]


def _inertia(numbers: np.ndarray) -> E.Inertia:
    mass, x, y, z, *rest = numbers.tolist()
    return E.Inertia(mass, (x, y, z), *rest)


def numbers(model: Model) -> np.ndarray:
    """Inertial numbers of all links, with the effects at links, shape (10 N,)."""
    tree = model.plant.tree
    assert tree is not None
    batch = ModelBatch(model)
    return np.concatenate([inertial_numbers(batch, link)[:, 0] for link in tree.links])


def missing(model: Model, signals: Signals, carried: np.ndarray | None = None) -> np.ndarray:
    """Forces that the motion needs and the model does not give, shape (rows, joints) [N m or N].

    Args:
        model: Its links with their effects; of its joints and drives viscous and Coulomb friction, rotor inertias,
            gains and offsets. Other effects are not seen.
        signals: Motion and forces.
        carried: Of `regressor`; None where nobody has it.
    """
    plant, own = model.plant, numbers(model)
    assert plant.tree is not None
    needed = inverse_dynamics(plant.tree, signals, own, weight_of(model)) if carried is None else carried @ own
    for j, link in enumerate(plant.tree.links):
        site, drive = link.joint, f"actuator_{link.joint}"
        rotor = model.parameters[f"{site}.armature"] + _of(model, f"{site}/rotor_inertia", "J")
        viscous = model.parameters[f"{site}.damping"] + _of(model, f"{site}/viscous", "sigma")
        dry = model.parameters[f"{site}.friction"] + _of(model, f"{site}/coulomb", "F_c")
        needed[:, j] += rotor * signals.accelerations[:, j] + viscous * signals.rates[:, j] + dry * signals.slides[:, j]
        given = _of(model, f"{drive}/gain", "k", 1.0) * (signals.forces[:, j] + _of(model, f"{drive}/offset", "F_0"))
        needed[:, j] -= given
    return needed


def _of(model: Model, effect: str, symbol: str, absent: float = 0.0) -> float:
    return model.effects[effect][symbol] if effect in model.effects else absent


def weight_of(model: Model) -> np.ndarray:
    """Gravity in the frame of the base, shape (3,) [m/s^2]."""
    assert model.plant.tree is not None
    return gravity(ModelBatch(model), model.plant.tree)[:, 0]
