"""Inverse dynamics of a tree: the forces that a motion needs, for many rows at once, in numpy."""

from collections.abc import Sequence

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Tree
from wipx.sim.tree import equations as E
from wipx.sim.tree.inertias import gravity, inertial_numbers, link_inertia


def needed_forces(tree: Tree, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Forces of the joints that a rigid robot without friction needs for a motion, shape (rows, N) [N m or N].

    The file's armature counts, its damping and dry friction do not.

    Args:
        tree: The robot.
        q: Positions, shape (rows, N) [rad or m].
        v: Rates, shape (rows, N).
        a: Accelerations, shape (rows, N).
    """
    inertias = [link_inertia(link) for link in tree.links]
    return _forces(tree, inertias, [link.armature for link in tree.links], tree.gravity, (q, v, a))


def forces_of(model: Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """The same for a model of a tree, with its own numbers and its effects at links and base, shape (rows, N).

    Friction, springs and rotor inertias that are effects do not count.
    """
    tree, batch = model.plant.tree, ModelBatch(model)
    assert tree is not None
    inertias = []
    for link in tree.links:
        mass, x, y, z, *rest = inertial_numbers(batch, link)[:, 0].tolist()
        inertias.append(E.Inertia(mass, (x, y, z), *rest))
    rotors = [model.parameters[f"{joint}.armature"] for joint in tree.joints]
    return _forces(tree, inertias, rotors, gravity(batch, tree)[:, 0], (q, v, a))


def _forces(
    tree: Tree,
    inertias: Sequence[E.Inertia],
    rotors: Sequence[float],
    weight: np.ndarray,
    motion: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> np.ndarray:
    q, v, a = motion
    # The equations are written for floats and nodes of a graph; arrays of rows obey the same arithmetic.
    poses = [E.pose(link, q[:, i], np.sin(q[:, i]), np.cos(q[:, i])) for i, link in enumerate(tree.links)]  # pyright: ignore[reportArgumentType]
    bias = E.bias(tree, poses, list(v.T), inertias, tuple(weight.tolist()))  # pyright: ignore[reportArgumentType]
    matrix = E.mass_matrix(tree, poses, inertias, rotors)
    inertial = E.product(tree, matrix, list(a.T))  # pyright: ignore[reportArgumentType]
    return np.stack([np.zeros(len(q)) + b + m for b, m in zip(bias, inertial, strict=True)], axis=1)  # pyright: ignore[reportOperatorIssue]
