"""The owner's own model file with the bodies of a completed model, as far as that is possible."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link, ModelFile, Tree
from wipx.recordings.model_specification import release_locked
from wipx.recordings.robot_model import read_tree
from wipx.sim.mechanism import LEAST, mechanism
from wipx.sim.tree.frames import principal
from wipx.sim.tree.inertias import inertial_numbers, lumped, numbers_of

SAME = 1e-9  # of masses, lengths and moments, up to which two trees are one
NO_BODY = "body {body} alone, without what is welded to it, cannot take the change of its mass or inertia"
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
    note = unusable(tree, source)
    if note:
        return OwnerFile(None, source.path, note)
    try:
        spec = mujoco.MjSpec.from_file(str(source.path))
        _lock(mujoco, spec, tuple(source.locked))
        compiled = spec.compile()
    except ValueError as error:
        return OwnerFile(None, source.path, str(error).strip().splitlines()[0].rstrip(".;"))
    note = _move_masses(model, tree, spec, compiled)
    if note:
        return OwnerFile(None, source.path, note)
    gravity = mechanism(model).tree.gravity
    if np.abs(gravity - tree.gravity).max() > CHANGED:
        spec.option.gravity = gravity
    for folder in ("meshdir", "texturedir"):
        setattr(spec, folder, str((source.path.parent / (getattr(spec, folder) or "")).resolve()))
    return OwnerFile(spec, source.path)


def _lock(mujoco: Any, spec: Any, joints: tuple[str, ...]) -> None:
    """Fix joints at zero: they go, with what acts on them only and with their places in keyframes."""
    if joints:
        spec.compile()  # keyframes of a compiled specification follow what is deleted
    release_locked(mujoco, spec, joints)
    for name in joints:
        spec.delete(spec.joint(name))


def unusable(tree: Tree, source: ModelFile) -> str:
    """Why nothing can be built from the file that a tree was read from; empty where it can."""
    if not source.path.is_file():
        return "the file is not there any more"
    if any(source.locked.values()):
        return "joints are locked elsewhere than at zero"
    try:
        same = _same_tree(read_tree(source.path, dict(source.locked)), tree)
    except InputError as error:
        return str(error)
    return "" if same else "the file has changed since"


def _same_tree(one: Tree, other: Tree) -> bool:
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


def changed_links(model: Model, tree: Tree) -> Iterator[tuple[Link, np.ndarray]]:
    """Links with other inertial numbers than in the owner's file, and by how much each of the ten differs."""
    plain = ModelBatch(Model(model.plant, model.plant.complete({}, "model"), {}))
    for link in tree.links:
        before, after = (inertial_numbers(batch, link)[:, 0] for batch in (plain, ModelBatch(model)))
        if np.abs(after - before).max() > CHANGED * np.abs(before).max():
            yield link, after - before


@dataclass(frozen=True)
class BodyMass:
    """Mass of one body.

    Attributes:
        mass: [kg].
        com: Centre in the body's own frame, shape (3,) [m].
        inertia: About the centre in the body's axes, shape (3, 3) [kg m^2].
    """

    mass: float
    com: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, link: Link, numbers: np.ndarray) -> "BodyMass | None":
        """From ten inertial numbers (10,) in the link's frame; None where no rigid body has them."""
        mass, com, inertia = lumped(numbers)
        least, middle, most = np.linalg.eigvalsh(inertia)
        if mass <= 0.0 or least <= 0.0 or least + middle < most * (1.0 - SAME):
            return None
        turn = link.body_rotation
        return cls(mass, turn.T @ (com - link.body_place), turn.T @ inertia @ turn)


def _move_masses(model: Model, tree: Tree, spec: Any, compiled: Any) -> str:
    """Add what the model changes of each link to its body; why that cannot be, or nothing."""
    for link, change in changed_links(model, tree):
        found = BodyMass.of(link, _own_numbers(link, compiled) + change)
        if found is None:
            return NO_BODY.format(body=link.body)
        sizes, axes = principal(found.inertia, LEAST)
        body = spec.body(link.body)
        body.mass, body.ipos, body.inertia = found.mass, found.com, sizes
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
