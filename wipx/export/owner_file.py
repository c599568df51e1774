"""The owner's own model file with the bodies of a completed model, as far as that is possible."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link, Tree
from wipx.recordings.robot_model import read_tree
from wipx.sim.mechanism import LEAST, mechanism
from wipx.sim.tree.frames import principal
from wipx.sim.tree.inertias import inertial_numbers, lumped, numbers_of

SAME = 1e-9  # of masses, lengths and moments, up to which two trees are one
CHANGED = 1e-12  # relative, from which a number of a link counts as changed


@dataclass(frozen=True)
class OwnerFile:
    """What there is of the owner's file.

    Attributes:
        spec: MuJoCo's `MjSpec` with the masses and the gravity of the completed model; None where it cannot be used.
        path: Of the file; None where the model stems from none.
        note: Why it cannot be used; empty where it can.
    """

    spec: Any
    path: Path | None
    note: str = ""


def owner_file(model: Model, mujoco: Any) -> OwnerFile:
    """The file that a model's tree was read from, with the model's bodies in it."""
    tree = model.plant.tree
    source = None if tree is None else tree.source
    if tree is None or source is None:
        return OwnerFile(None, None)
    if not source.path.is_file():
        return OwnerFile(None, source.path, "the file is not there any more")
    if any(source.locked.values()):
        return OwnerFile(None, source.path, "joints are locked elsewhere than at zero")
    try:
        if not _same(read_tree(source.path, dict(source.locked)), tree):
            return OwnerFile(None, source.path, "the file has changed since")
        spec = mujoco.MjSpec.from_file(str(source.path))
        for name in source.locked:
            spec.delete(spec.joint(name))
        compiled = spec.compile()
    except (InputError, ValueError) as error:
        return OwnerFile(None, source.path, str(error).strip().splitlines()[0].rstrip(".;"))
    note = _moved_masses(model, tree, spec, compiled)
    if note:
        return OwnerFile(None, source.path, note)
    gravity = mechanism(model).tree.gravity
    if np.abs(gravity - tree.gravity).max() > CHANGED:
        spec.option.gravity = gravity
    for folder in ("meshdir", "texturedir"):
        setattr(spec, folder, str((source.path.parent / (getattr(spec, folder) or "")).resolve()))
    return OwnerFile(spec, source.path)


def _same(one: Tree, other: Tree) -> bool:
    """Whether two trees have the same links."""
    if one.joints != other.joints:
        return False
    for a, b in zip(one.links, other.links, strict=True):
        arrays = ("rotation", "place", "com", "inertia", "body_rotation", "body_place")
        if a.body != b.body or a.parent != b.parent or abs(a.mass - b.mass) > SAME:
            return False
        if any(np.abs(getattr(a, name) - getattr(b, name)).max() > SAME for name in arrays):
            return False
    return True


def _moved_masses(model: Model, tree: Tree, spec: Any, compiled: Any) -> str:
    """Add what the model changes of each link's ten inertial numbers to its body; why that cannot be, or nothing."""
    plain = ModelBatch(Model(model.plant, model.plant.complete({}, "model"), {}))
    for link in tree.links:
        before, after = (inertial_numbers(batch, link)[:, 0] for batch in (plain, ModelBatch(model)))
        if np.abs(after - before).max() <= CHANGED * np.abs(before).max():
            continue
        mass, com, inertia = lumped(_own_numbers(link, compiled) + after - before)
        moments = np.linalg.eigvalsh(inertia)
        if mass <= 0.0 or moments[0] <= 0.0 or moments[0] + moments[1] < moments[2] * (1.0 - SAME):
            return (
                f"body {link.body} alone, without what is welded to it, cannot take the change of its mass or inertia"
            )
        body, turn = spec.body(link.body), link.body_rotation
        sizes, axes = principal(turn.T @ inertia @ turn, LEAST)
        body.mass, body.ipos, body.inertia = mass, turn.T @ (com - link.body_place), sizes
        body.iquat, body.explicitinertial = quaternion(axes), True
        body.fullinertia = np.full(6, np.nan)
    return ""


def _own_numbers(link: Link, compiled: Any) -> np.ndarray:
    """Inertial numbers (10,) of a body alone, without what is welded to it, in the link's frame."""
    body = compiled.body(link.body)
    turn = link.body_rotation @ _matrix(body.iquat)
    com = link.body_rotation @ body.ipos + link.body_place
    return numbers_of(float(body.mass[0]), com, turn @ np.diag(body.inertia) @ turn.T)


def quaternion(turn: np.ndarray) -> np.ndarray:
    """A rotation matrix (3, 3) as (w, x, y, z), by its largest component."""
    trace = np.trace(turn)
    squares = np.array([trace, *(2.0 * np.diag(turn) - trace)])
    largest = int(np.argmax(squares))
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    if largest == 0:
        found = np.array([1.0 + trace, *skew])
    else:
        i = largest - 1
        found = np.array([skew[i], *(turn[i] + turn[:, i])])
        found[1 + i] = 1.0 + squares[largest]
    return found / np.linalg.norm(found)


def _matrix(quat: np.ndarray) -> np.ndarray:
    w, x, y, z = quat
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
