"""Inverse dynamics of a tree: the forces that a motion needs, for many rows at once, in numpy."""

import numpy as np

from wipx.core.tree import Tree
from wipx.sim.tree import equations as E
from wipx.sim.tree.inertias import link_inertia


def needed_forces(tree: Tree, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Forces of the joints that a rigid robot without friction needs for a motion, shape (rows, N) [N m or N].

    The file's armature counts, its damping and dry friction do not.

    Args:
        tree: The robot.
        q: Positions, shape (rows, N) [rad or m].
        v: Rates, shape (rows, N).
        a: Accelerations, shape (rows, N).
    """
    # The equations are written for floats and nodes of a graph; arrays of rows obey the same arithmetic.
    poses = [E.pose(link, q[:, i], np.sin(q[:, i]), np.cos(q[:, i])) for i, link in enumerate(tree.links)]  # pyright: ignore[reportArgumentType]
    inertias = [link_inertia(link) for link in tree.links]
    gravity = tuple(tree.gravity.tolist())
    bias = E.bias(tree, poses, list(v.T), inertias, gravity)  # pyright: ignore[reportArgumentType]
    matrix = E.mass_matrix(tree, poses, inertias, [link.armature for link in tree.links])
    inertial = E.product(tree, matrix, list(a.T))  # pyright: ignore[reportArgumentType]
    return np.stack([np.zeros(len(q)) + b + m for b, m in zip(bias, inertial, strict=True)], axis=1)  # pyright: ignore[reportOperatorIssue]
