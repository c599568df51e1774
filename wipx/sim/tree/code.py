"""The rigid body of one robot as compiled code: written out once, kept on disk beside the other compiled code.

Written out, a robot of seven joints runs several times faster than loops over its links, because every number has a
register and zeros cost nothing. Indices are unsigned: with signed ones the compiler leaves long loops scalar.
"""

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from typing import Any

from wipx.core.tree import Tree
from wipx.sim import rows as R
from wipx.sim.cache import compiled_folder
from wipx.sim.rows import W
from wipx.sim.sticking import row_of
from wipx.sim.tree import equations as E
from wipx.sim.tree.graph import Graph, Scalar

GRAVITY = 3  # rows of gravity, before those of the links

HEADER = '''"""Rigid body of a robot; written by wipx.sim.tree.code."""

import numpy as np

from wipx.core.law import law, sin_cos
from wipx.sim import rows as R
from wipx.sim.cache import part

U = np.uint64
'''


def gravity_row(joints: int) -> int:
    """First of the rows of gravity in the ground's frame: behind the mass matrix."""
    return R.COMMON + joints * (joints + 1) // 2


def number_row(joints: int, link: int) -> int:
    """First of the rows with the inertial numbers of a link."""
    return gravity_row(joints) + GRAVITY + link * E.NUMBERS


def row_count(joints: int) -> int:
    """Rows of the whole robot."""
    return number_row(joints, joints)


FOOTER = """@part
def rigid(S, B, n, on, asked):
    if asked == R.FORCES:
        forces(S, B, n)
    elif asked == R.SOLVE:
        solve(S, B, n)
    else:
        multiply(S, B, n)
"""


def source(tree: Tree) -> str:
    """Code of a robot."""
    return "\n\n\n".join([HEADER, _forces(tree), _solve(tree), _multiply(tree), FOOTER])


@cache
def rigid_body(tree: Tree) -> Any:
    """The compiled code of a robot (`wipx.sim.cache.part`); the first use of a robot takes seconds."""
    text = source(tree)
    name = f"robot_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    path = compiled_folder() / f"{name}.py"
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
            file.write(text)
        os.replace(file.name, path)
    found = importlib.util.spec_from_file_location(name, path)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    found.loader.exec_module(module)
    return module.rigid


def _whole(row: int) -> str:
    return f"S[U({row * W}) + w]"


def _own(joint: int, row: int) -> str:
    return f"F[U({(joint * R.BLOCK + row) * W}) + w]"


def _function(name: str, lines: Sequence[str]) -> str:
    head = ["@law", f"def {name}(S, B, n):", "    F = B.reshape(B.size)", "    for w in range(U(n)):"]
    return "\n".join([*head, *(f"        {line}" for line in lines)])


def _forces(tree: Tree) -> str:
    graph, joints = Graph(), len(tree.links)
    turns: list[str] = []
    poses: list[E.Pose] = []
    for i, link in enumerate(tree.links):
        q = graph.named(_own(i, R.MID))
        if link.slides:
            poses.append(E.pose(link, q, 0.0, 1.0))
        else:
            turns.append(f"s{i}, c{i} = sin_cos({_own(i, R.MID)})")
            poses.append(E.pose(link, q, graph.named(f"s{i}"), graph.named(f"c{i}")))
    inertias = []
    for i in range(joints):
        mass, x, y, z, *rest = (graph.named(_whole(number_row(joints, i) + k)) for k in range(E.NUMBERS))
        inertias.append(E.Inertia(mass, (x, y, z), *rest))
    rates = [graph.named(_own(i, R.RATE)) for i in range(joints)]
    gravity: Any = tuple(graph.named(_whole(gravity_row(joints) + k)) for k in range(GRAVITY))
    matrix = E.mass_matrix(tree, poses, inertias, [graph.named(_own(i, R.ROTOR)) for i in range(joints)])
    against = E.bias(tree, poses, rates, inertias, gravity)
    entries = ((i, j) for i in range(joints) for j in range(i + 1))
    results: dict[str, Scalar] = {f"{_whole(row_of.py_func(i, j))} =": matrix.get((i, j), 0.0) for i, j in entries}
    results |= {f"{_own(i, R.FORCE)} -=": force for i, force in enumerate(against)}
    return _function("forces", [*turns, *graph.printed(results)])


def _matrix(tree: Tree, graph: Graph) -> dict[tuple[int, int], Scalar]:
    joints = len(tree.links)
    entries = [(i, j) for i in range(joints) for j in (*tree.ancestors(i), i)]
    return {(i, j): graph.named(_whole(row_of.py_func(i, j))) for i, j in entries}


def _solve(tree: Tree) -> str:
    """Rates from impulses; a joint that is not kept stays at what it is held to."""
    graph, joints = Graph(), len(tree.links)
    keep, hold, right = ([graph.named(_own(i, row)) for i in range(joints)] for row in (R.KEEP, R.HOLD, R.RIGHT))
    matrix = {
        (i, j): keep[i] * entry + hold[i] if i == j else keep[i] * keep[j] * entry
        for (i, j), entry in _matrix(tree, graph).items()
    }
    found = E.solution(tree, matrix, right)
    return _function("solve", graph.printed({f"{_own(i, R.NEXT)} =": x for i, x in enumerate(found)}))


def _multiply(tree: Tree) -> str:
    """Impulses from rates."""
    graph, joints = Graph(), len(tree.links)
    found = E.product(tree, _matrix(tree, graph), [graph.named(_own(i, R.NEXT)) for i in range(joints)])
    return _function("multiply", graph.printed({f"{_own(i, R.PUSHED)} =": x for i, x in enumerate(found)}))
