"""Equations of motion of a tree, in coordinates of the base: Newton and Euler for each body, composites for M.

Velocities and the accelerations that they cause run from the base outwards; forces, and the masses of all that a joint
carries, run back (Featherstone 2008, Rigid Body Dynamics Algorithms, chapters 5 and 6).
"""

import math
from typing import NamedTuple

import numpy as np

from wipx.proof.blind_robots.compiled import equation, kept


class Body(NamedTuple):
    """N links as arrays; see `links.Link`.

    Attributes:
        parent: Shape (N,).
        slides: Shape (N,).
        axis: Shape (N, 3).
        turn: Shape (N, 3, 3).
        place: Shape (N, 3) [m].
        mass: Shape (N,) [kg].
        com: Shape (N, 3) [m].
        inertia: Shape (N, 3, 3) [kg m^2].
        gravity: Shape (3,) [m/s^2].
    """

    parent: np.ndarray
    slides: np.ndarray
    axis: np.ndarray
    turn: np.ndarray
    place: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray
    gravity: np.ndarray


class Space(NamedTuple):
    """Room for the equations of N links; vectors are in coordinates of the base.

    Attributes:
        turn: From the link's frame to the base's, shape (N, 3, 3).
        place: Origins, shape (N, 3).
        axis: Of the joints, shape (N, 3).
        spin: Angular velocities, shape (N, 3).
        twist: Angular accelerations that velocities cause, shape (N, 3).
        pull: Accelerations of the origins likewise, shape (N, 3).
        centre: Centres of mass of all that each joint carries, shape (N, 3).
        heavy: Its mass, shape (N,).
        inertia: And inertia about its centre, shape (N, 3, 3).
        force: On all that a joint carries, without accelerations of the joints, shape (N, 3).
        moment: Likewise, about its origin, shape (N, 3).
        matrix: Mass matrix, shape (N, N).
        bias: Generalised forces of gravity and of velocities, shape (N,); M q'' + bias = other forces.
    """

    turn: np.ndarray
    place: np.ndarray
    axis: np.ndarray
    spin: np.ndarray
    twist: np.ndarray
    pull: np.ndarray
    centre: np.ndarray
    heavy: np.ndarray
    inertia: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    matrix: np.ndarray
    bias: np.ndarray


def room(n: int) -> Space:
    """Room for n links."""
    three = [np.zeros((n, 3)) for _ in range(9)]
    square = [np.zeros((n, 3, 3)) for _ in range(2)]
    return Space(
        square[0], three[0], three[1], three[2], three[3], three[4], three[5], np.zeros(n), square[1], three[6],
        three[7], np.zeros((n, n)), np.zeros(n),
    )  # fmt: skip


@equation
def cross(a, b):
    """Vector product of two triples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@equation
def dot(a, b):
    """Scalar product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@equation
def plus(a, b):
    """Sum of two triples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@equation
def times(factor, a):
    """A triple times a number."""
    return factor * a[0], factor * a[1], factor * a[2]


@equation
def triple(rows, i):
    """Row i of an array (N, 3)."""
    return rows[i, 0], rows[i, 1], rows[i, 2]


@equation
def put(rows, i, a):
    """Write a triple to row i."""
    rows[i, 0], rows[i, 1], rows[i, 2] = a


@equation
def turned(turns, i, a):
    """A triple turned by matrix i."""
    m = turns[i]
    return (
        m[0, 0] * a[0] + m[0, 1] * a[1] + m[0, 2] * a[2],
        m[1, 0] * a[0] + m[1, 1] * a[1] + m[1, 2] * a[2],
        m[2, 0] * a[0] + m[2, 1] * a[1] + m[2, 2] * a[2],
    )


@equation
def product(a, b, out):
    """Product of two matrices (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@equation
def set_turn(i, q, body, s, helper):
    """Orientation of link i: that of the parent, the fixed turn, and the joint's own."""
    parent = body.parent[i]
    if parent < 0:
        helper[0] = body.turn[i]
    else:
        product(s.turn[parent], body.turn[i], helper[0])
    if body.slides[i]:
        s.turn[i] = helper[0]
        return
    x, y, z = triple(body.axis, i)
    c, sine = math.cos(q), math.sin(q)
    rest = 1.0 - c
    own = helper[1]
    own[0, 0], own[0, 1], own[0, 2] = c + x * x * rest, x * y * rest - z * sine, x * z * rest + y * sine
    own[1, 0], own[1, 1], own[1, 2] = y * x * rest + z * sine, c + y * y * rest, y * z * rest - x * sine
    own[2, 0], own[2, 1], own[2, 2] = z * x * rest - y * sine, z * y * rest + x * sine, c + z * z * rest
    product(helper[0], own, s.turn[i])


@equation
def outwards(q, v, body, s, helper):
    """Fill in poses, velocities and the accelerations that velocities cause."""
    for i in range(len(body.mass)):
        parent = body.parent[i]
        set_turn(i, q[i], body, s, helper)
        axis = turned(s.turn, i, triple(body.axis, i))
        put(s.axis, i, axis)
        arm, spin, twist, pull = triple(body.place, i), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        below = (0.0, 0.0, 0.0)
        if parent >= 0:
            arm = turned(s.turn, parent, arm)
            spin, twist, pull = triple(s.spin, parent), triple(s.twist, parent), triple(s.pull, parent)
            below = triple(s.place, parent)
        if body.slides[i]:
            arm = plus(arm, times(q[i], axis))
            pull = plus(pull, times(2.0 * v[i], cross(spin, axis)))
        put(s.place, i, plus(below, arm))
        put(s.pull, i, plus(pull, plus(cross(twist, arm), cross(spin, cross(spin, arm)))))
        if not body.slides[i]:
            twist = plus(twist, times(v[i], cross(spin, axis)))
            spin = plus(spin, times(v[i], axis))
        put(s.spin, i, spin)
        put(s.twist, i, twist)


@equation
def own_forces(i, body, s, helper):
    """Force and moment about its origin that link i needs, and its mass, centre and inertia in the base's frame."""
    com = turned(s.turn, i, triple(body.com, i))
    spin, twist = triple(s.spin, i), triple(s.twist, i)
    product(s.turn[i], body.inertia[i], helper[0])
    for a in range(3):
        for b in range(3):
            s.inertia[i, a, b] = 0.0
            for c in range(3):
                s.inertia[i, a, b] += helper[0, a, c] * s.turn[i, b, c]
    pull = plus(triple(s.pull, i), plus(cross(twist, com), cross(spin, cross(spin, com))))
    mass = body.mass[i]
    force = times(mass, (pull[0] - body.gravity[0], pull[1] - body.gravity[1], pull[2] - body.gravity[2]))
    moment = plus(turned(s.inertia, i, twist), cross(spin, turned(s.inertia, i, spin)))
    put(s.force, i, force)
    put(s.moment, i, plus(moment, cross(com, force)))
    put(s.centre, i, plus(triple(s.place, i), com))
    s.heavy[i] = mass


@equation
def carry(i, parent, s):
    """Add what joint i carries to what the parent's joint carries."""
    force = triple(s.force, i)
    arm = plus(triple(s.place, i), times(-1.0, triple(s.place, parent)))
    put(s.moment, parent, plus(triple(s.moment, parent), plus(triple(s.moment, i), cross(arm, force))))
    put(s.force, parent, plus(triple(s.force, parent), force))
    m, n = s.heavy[parent], s.heavy[i]
    between = plus(triple(s.centre, i), times(-1.0, triple(s.centre, parent)))
    reduced, square = m * n / (m + n), dot(between, between)
    for a in range(3):
        for b in range(3):
            s.inertia[parent, a, b] += s.inertia[i, a, b] - reduced * between[a] * between[b]
        s.inertia[parent, a, a] += reduced * square
    put(s.centre, parent, plus(triple(s.centre, parent), times(n / (m + n), between)))
    s.heavy[parent] = m + n


@equation
def dynamics(q, v, body, s, helper):
    """Fill in mass matrix and bias of a state; joints' own inertias are not in it.

    Args:
        q: Coordinates, shape (N,).
        v: Rates, shape (N,).
        body: The links.
        s: Room.
        helper: Two matrices, shape (2, 3, 3).
    """
    n = len(body.mass)
    outwards(q, v, body, s, helper)
    for i in range(n):
        own_forces(i, body, s, helper)
    for i in range(n - 1, -1, -1):
        axis, slides = triple(s.axis, i), body.slides[i]
        s.bias[i] = dot(axis, triple(s.force, i)) if slides else dot(axis, triple(s.moment, i))
        arm = plus(triple(s.centre, i), times(-1.0, triple(s.place, i)))
        if slides:
            force, moment = times(s.heavy[i], axis), (0.0, 0.0, 0.0)
        else:
            force, moment = times(s.heavy[i], cross(axis, arm)), turned(s.inertia, i, axis)
        for j in range(n):
            s.matrix[i, j] = 0.0 if j <= i else s.matrix[j, i]
        j = i
        while j >= 0:
            if body.slides[j]:
                entry = dot(triple(s.axis, j), force)
            else:
                arm = plus(triple(s.centre, i), times(-1.0, triple(s.place, j)))
                entry = dot(triple(s.axis, j), plus(moment, cross(arm, force)))
            s.matrix[i, j] = entry
            j = body.parent[j]
        if body.parent[i] >= 0:
            carry(i, body.parent[i], s)


@equation
def factorise(matrix, stuck, lower):
    """Lower triangle of Cholesky's factor of a symmetric matrix; a stuck joint is replaced by a unit."""
    n = len(stuck)
    for i in range(n):
        for j in range(i + 1):
            held = stuck[i] or stuck[j]
            entry = (1.0 if i == j else 0.0) if held else matrix[i, j]
            for k in range(j):
                entry -= lower[i, k] * lower[j, k]
            lower[i, j] = math.sqrt(entry) if i == j else entry / lower[j, j]


@equation
def solve(matrix, right, stuck, lower, out):
    """Accelerations of the joints that are not stuck, with the others at rest.

    Args:
        matrix: Symmetric, shape (N, N).
        right: Shape (N,).
        stuck: Joints that stay at rest, shape (N,).
        lower: Room, shape (N, N).
        out: Shape (N,).
    """
    n = len(right)
    factorise(matrix, stuck, lower)
    for i in range(n):
        total = 0.0 if stuck[i] else right[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]
    for i in range(n - 1, -1, -1):
        total = out[i]
        for k in range(i + 1, n):
            total -= lower[k, i] * out[k]
        out[i] = total / lower[i, i]


@kept
def at_poses(poses, rates, body, s, helper, matrices, biases):
    """Mass matrices (P, N, N) and biases (P, N) of states, each of shape (P, N)."""
    for p in range(len(poses)):
        dynamics(poses[p], rates[p], body, s, helper)
        matrices[p], biases[p] = s.matrix, s.bias
