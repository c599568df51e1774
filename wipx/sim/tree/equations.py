"""Equations of motion of a tree, in link frames: recursive Newton-Euler, composite inertias, and a sparse solution.

They work on floats and on nodes of a `Graph` alike. Featherstone 2008, Rigid Body Dynamics Algorithms, ch. 5 and 6; the
inertial numbers of a link are its mass, mass times centre (3) and inertia about its origin (xx, yy, zz, xy, xz, yz), in
which mass matrix and forces are linear (Khalil, Dombre 2002, Modeling, Identification and Control of Robots, ch. 9).
"""

from collections.abc import Sequence
from typing import NamedTuple

from wipx.core.tree import Link, Tree
from wipx.sim.tree.graph import Scalar

NUMBERS = 10  # of a link
SNAPPED = 1e-9  # rounded angles of a file make entries this near to 0, 1 and -1

Vector = tuple[Scalar, Scalar, Scalar]
ZERO: Vector = (0.0, 0.0, 0.0)


class Inertia(NamedTuple):
    """Mass, mass times centre, and inertia about the origin of a frame."""

    mass: Scalar
    first: Vector
    xx: Scalar
    yy: Scalar
    zz: Scalar
    xy: Scalar
    xz: Scalar
    yz: Scalar

    def times(self, v: Vector) -> Vector:
        """Inertia about the origin times a vector."""
        x, y, z = v
        return (
            self.xx * x + self.xy * y + self.xz * z,
            self.xy * x + self.yy * y + self.yz * z,
            self.xz * x + self.yz * y + self.zz * z,
        )

    def plus(self, other: "Inertia") -> "Inertia":
        """That of both together."""
        return Inertia(
            self.mass + other.mass,
            add(self.first, other.first),
            *(a + b for a, b in zip(self[2:], other[2:], strict=True)),
        )


class Pose(NamedTuple):
    """A link in its parent's frame: columns of the rotation (rows in the parent's axes), and origin."""

    rows: tuple[Vector, Vector, Vector]
    place: Vector

    def up(self, v: Vector) -> Vector:
        """A vector of the link in its parent's axes."""
        return dot(self.rows[0], v), dot(self.rows[1], v), dot(self.rows[2], v)

    def down(self, v: Vector) -> Vector:
        """A vector of the parent in the link's axes."""
        a, b, c = self.rows
        return tuple(a[i] * v[0] + b[i] * v[1] + c[i] * v[2] for i in range(3))  # pyright: ignore[reportReturnType]


def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def dot(a: Vector, b: Vector) -> Scalar:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _snapped(value: float) -> float:
    nearest = float(round(value))
    return nearest if abs(value - nearest) < SNAPPED else float(value)


def pose(link: Link, q: Scalar, sine: Scalar, cosine: Scalar) -> Pose:
    """Where a link stands in its parent's frame, its joint at q."""
    fixed = [[_snapped(x) for x in row] for row in link.rotation.tolist()]
    place: Vector = tuple(0.0 if abs(x) < SNAPPED else float(x) for x in link.place.tolist())  # pyright: ignore
    if link.slides:
        shifted: Vector = tuple(p + row[2] * q for p, row in zip(place, fixed, strict=True))  # pyright: ignore
        return Pose(tuple(tuple(row) for row in fixed), shifted)  # pyright: ignore
    turned = tuple((row[0] * cosine + row[1] * sine, row[1] * cosine - row[0] * sine, row[2]) for row in fixed)
    return Pose(turned, place)  # pyright: ignore


def bias(
    tree: Tree, poses: Sequence[Pose], rates: Sequence[Scalar], inertias: Sequence[Inertia], gravity: Vector
) -> list[Scalar]:
    """Forces of the joints that keep their rates as they are: Coriolis, centrifugal, gravity (Newton-Euler)."""
    turning: list[Vector] = []
    angular: list[Vector] = []
    linear: list[Vector] = []
    forces: list[Vector] = []
    moments: list[Vector] = []
    rest: Vector = (-gravity[0], -gravity[1], -gravity[2])
    for i, link in enumerate(tree.links):
        below = link.parent
        spin, gain, lift = (turning[below], angular[below], linear[below]) if below >= 0 else (ZERO, ZERO, rest)
        place = poses[i].place
        carried = add(lift, add(cross(gain, place), cross(spin, cross(spin, place))))
        spin, gain, lift = poses[i].down(spin), poses[i].down(gain), poses[i].down(carried)
        along: Vector = (0.0, 0.0, rates[i])
        if link.slides:
            twice = cross(spin, along)
            lift = add(lift, (2.0 * twice[0], 2.0 * twice[1], 2.0 * twice[2]))
        else:
            gain = add(gain, cross(spin, along))
            spin = add(spin, along)
        turning.append(spin)
        angular.append(gain)
        linear.append(lift)
        own = inertias[i]
        mass_times = (own.mass * lift[0], own.mass * lift[1], own.mass * lift[2])
        forces.append(add(mass_times, add(cross(gain, own.first), cross(spin, cross(spin, own.first)))))
        moments.append(add(add(own.times(gain), cross(spin, own.times(spin))), cross(own.first, lift)))
    for i in reversed(range(len(tree.links))):
        below = tree.links[i].parent
        if below >= 0:
            force = poses[i].up(forces[i])
            forces[below] = add(forces[below], force)
            moments[below] = add(moments[below], add(poses[i].up(moments[i]), cross(poses[i].place, force)))
    return [(forces if link.slides else moments)[i][2] for i, link in enumerate(tree.links)]


def _carried(own: Inertia, at: Pose) -> Inertia:
    """An inertia in the axes and about the origin of the parent's frame."""
    x, y, z = at.rows
    turned = [own.times((row[0], row[1], row[2])) for row in (x, y, z)]
    first, p = at.up(own.first), at.place
    once = 2.0 * dot(p, first) + own.mass * dot(p, p)

    def entry(i: int, j: int) -> Scalar:
        both = dot(at.rows[i], turned[j])
        away = p[i] * first[j] + first[i] * p[j] + own.mass * (p[i] * p[j])
        return both + (once - away) if i == j else both - away

    moved = tuple(first[i] + own.mass * p[i] for i in range(3))
    entries = (entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2))
    return Inertia(own.mass, moved, *entries)  # pyright: ignore[reportArgumentType]


def mass_matrix(
    tree: Tree, poses: Sequence[Pose], inertias: Sequence[Inertia], rotors: Sequence[Scalar]
) -> dict[tuple[int, int], Scalar]:
    """Entries (i, j), j <= i, of the mass matrix that are not zero for lack of a common branch (composite inertias)."""
    composite = list(inertias)
    matrix: dict[tuple[int, int], Scalar] = {}
    for i in reversed(range(len(tree.links))):
        link, own = tree.links[i], composite[i]
        if link.parent >= 0:
            composite[link.parent] = composite[link.parent].plus(_carried(own, poses[i]))
        if link.slides:
            force: Vector = (0.0, 0.0, own.mass)
            moment: Vector = (own.first[1], -1.0 * own.first[0], 0.0)
        else:
            force = (-1.0 * own.first[1], own.first[0], 0.0)
            moment = (own.xz, own.yz, own.zz)
        matrix[i, i] = (force[2] if link.slides else moment[2]) + rotors[i]
        at = i
        for j in tree.ancestors(i):
            moment = add(poses[at].up(moment), cross(poses[at].place, poses[at].up(force)))
            force = poses[at].up(force)
            matrix[i, j] = (force if tree.links[j].slides else moment)[2]
            at = j
    return matrix


def solution(tree: Tree, matrix: dict[tuple[int, int], Scalar], right: Sequence[Scalar]) -> list[Scalar]:
    """X with A x = right, for a symmetric A with the zeros of a mass matrix: A = L' D L from the leaves down."""
    a, x = dict(matrix), list(right)
    inverse: dict[int, Scalar] = {}
    lower: dict[tuple[int, int], Scalar] = {}
    for k in reversed(range(len(tree.links))):
        inverse[k] = 1.0 / a[k, k]
        above = tree.ancestors(k)
        for i in above:
            lower[k, i] = a[k, i] * inverse[k]
        for i in above:
            for j in above:
                if j <= i:
                    a[i, j] = a[i, j] - lower[k, i] * a[k, j]
            x[i] = x[i] - lower[k, i] * x[k]
    for k in range(len(tree.links)):
        x[k] = x[k] * inverse[k]
        for i in tree.ancestors(k):
            x[k] = x[k] - lower[k, i] * x[i]
    return x


def product(tree: Tree, matrix: dict[tuple[int, int], Scalar], x: Sequence[Scalar]) -> list[Scalar]:
    """A x for a symmetric A with the zeros of a mass matrix."""
    found: list[Scalar] = [matrix[i, i] * x[i] for i in range(len(tree.links))]
    for (i, j), entry in matrix.items():
        if i != j:
            found[i] = found[i] + entry * x[j]
            found[j] = found[j] + entry * x[i]
    return found
