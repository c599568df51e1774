"""Robots from model files in robot.yaml, and in a model.yaml, which holds the tree itself; contract section 6."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from wipx.core.drive import Drive, Logged
from wipx.core.errors import InputError, unknown_name
from wipx.core.plant import Plant, robot_plant
from wipx.core.tree import Link, ModelFile, Tree
from wipx.recordings.robot_model import read_drives, read_tree
from wipx.recordings.strict_yaml import finite_number

DRIVE_KEYS = {
    "torque": ("kind", "gain", "logged"),
    "position": ("kind", "kp", "kd", "limit", "rate", "logged"),
    "none": ("kind",),
}
ARRAYS = ("rotation", "place", "com", "inertia", "body_rotation", "body_place")


def plant_from_mapping(data: Mapping[str, object], where: str, folder: Path) -> Plant:
    """The plant of a robot.yaml or model.yaml with `plant: robot`.

    Args:
        data: Content of the file: `model`, `locked`, `drives`, and `tree`, which is taken where it is there.
        where: File, for messages.
        folder: That the path `model` is relative to.

    Raises:
        InputError: the model file or a drive is missing or at fault.
    """
    own: dict[str, Drive] = {}
    if data.get("tree") is not None:
        tree = _tree(cast(Mapping[str, Any], data["tree"]), _source(data, where, folder))
    else:
        model = data.get("model")
        if not isinstance(model, str) or not model:
            raise InputError(f"{where}: model is {model!r}, expected the path of an MJCF or URDF file")
        locked = _locked(data.get("locked"), where)
        tree, own = read_tree(folder / model, locked), read_drives(folder / model, locked)
    drives = data.get("drives") or {}
    if not isinstance(drives, Mapping):
        raise InputError(f"{where}: drives is {drives!r}, expected joints with their drives")
    for joint in drives:
        if joint not in tree.joints:
            raise unknown_name("joint", str(joint), tree.joints, f"{where}: drives")
    said = {str(joint): _drive(drives[joint], f"{where}: drives: {joint}") for joint in drives}
    return robot_plant(tree, {**own, **said})


def plant_to_mapping(plant: Plant) -> dict[str, object]:
    """Tree and drives of a robot as a model.yaml holds them, and the file that they were read from."""
    assert plant.tree is not None
    links = []
    for link in plant.tree.links:
        plain: dict[str, object] = {name: value for name, value in vars(link).items() if value is not None}
        plain |= {name: getattr(link, name).tolist() for name in ARRAYS}
        plain["limits"] = None if link.limits is None else list(link.limits)
        links.append(plain)
    drives = {
        joint: {key: getattr(drive, key) for key in DRIVE_KEYS[drive.kind] if getattr(drive, key) is not None}
        for joint, drive in plant.drives.items()
    }
    source = plant.tree.source
    file = {} if source is None else {"model": str(source.path), "locked": dict(source.locked)}
    return {**file, "tree": {"gravity": plant.tree.gravity.tolist(), "links": links}, "drives": drives}


def _source(data: Mapping[str, object], where: str, folder: Path) -> ModelFile | None:
    """The file that the tree of a model.yaml was read from."""
    model = data.get("model")
    return ModelFile(folder / model, _locked(data.get("locked"), where)) if isinstance(model, str) else None


def _tree(data: Mapping[str, Any], source: ModelFile | None) -> Tree:
    links = []
    for each in data["links"]:
        known = {name: np.array(value, dtype=float) if name in ARRAYS else value for name, value in each.items()}
        limits = known.get("limits")
        links.append(Link(**{**known, "limits": None if limits is None else (float(limits[0]), float(limits[1]))}))
    return Tree(tuple(links), np.array(data["gravity"], dtype=float), source)


def _locked(data: object, where: str) -> dict[str, float]:
    if data is None:
        return {}
    if not isinstance(data, Mapping):
        raise InputError(f"{where}: locked is {data!r}, expected joints with their positions, e.g. {{finger: 0.0}}")
    found = {str(joint): finite_number(position) for joint, position in data.items()}
    for joint, position in found.items():
        if position is None:
            raise InputError(f"{where}: locked: {joint} is {data[joint]!r}, expected a position in rad or m")
    return {joint: position for joint, position in found.items() if position is not None}


def _drive(data: object, where: str) -> Drive:
    if not isinstance(data, Mapping):
        raise InputError(f"{where} is {data!r}, expected settings such as {{kind: torque, gain: 1.0}}")
    kind = str(data.get("kind", "torque"))
    if kind not in DRIVE_KEYS:
        raise unknown_name("kind of drive", kind, DRIVE_KEYS, where)
    valid = DRIVE_KEYS[kind]
    for key in data:
        if key not in valid:
            raise unknown_name("setting", str(key), valid, where)
    logged = str(data.get("logged", "command"))
    if logged not in get_args(Logged):
        raise unknown_name("value of logged", logged, get_args(Logged), where)
    numbers: dict[str, float] = {}
    for key in ("gain", "kp", "kd", "limit", "rate"):
        if data.get(key) is not None:
            number = finite_number(data[key])
            if number is None or (key != "gain" and number < 0.0):
                raise InputError(f"{where}: {key} is {data[key]!r}, expected a number of zero or more")
            numbers[key] = number
    if kind == "position" and numbers.get("kp", 0.0) <= 0.0:
        raise InputError(f"{where}: kp is {data.get('kp')!r}, expected the stiffness of the position loop above 0")
    return Drive(kind, logged=cast(Logged, logged), **numbers)  # pyright: ignore[reportArgumentType]
