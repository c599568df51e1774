"""MJCF and URDF files as trees; MuJoCo reads both."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.drive import Drive
from wipx.core.errors import InputError
from wipx.core.tree import Link, ModelFile, Tree
from wipx.recordings.model_specification import compiled_model, urdf_root
from wipx.recordings.tree_names import check_names


def read_tree(path: Path, locked: dict[str, float] | None = None) -> Tree:
    """The tree of links in a model file.

    Meshes and textures need not be there; contacts and sensors of the file are not part of the tree.

    Args:
        path: MJCF or URDF.
        locked: Joints that are fixed, with their positions [rad or m]; their links join those below.

    Raises:
        InputError: as `compiled_model`, or a joint moves no mass, or a name clashes with a column's.
    """
    locked = dict(locked or {})
    mujoco, model = compiled_model(path, locked)
    return _tree(mujoco, model, locked, path)


def read_drives(path: Path, locked: Collection[str] = ()) -> dict[str, Drive]:
    """The actuators of a model file as drives, by joint; those of locked joints are left out.

    Raises:
        InputError: as `compiled_model`, or an actuator is neither a motor nor a position servo of one joint.
    """
    mujoco, model = compiled_model(path, locked)
    found: dict[str, Drive] = {}
    for i in range(model.nu):
        gain, bias, gear = model.actuator_gainprm[i], model.actuator_biasprm[i], model.actuator_gear[i]
        limit = float(np.max(np.abs(model.actuator_forcerange[i]))) if model.actuator_forcelimited[i] else None
        plain = (
            model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
            and model.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_NONE
            and model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_FIXED
        )
        motor = model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_NONE
        servo = gain[0] > 0.0 and bias[0] == 0.0 and bias[1] == -gain[0] and gear[0] == 1.0
        joint = model.joint(int(model.actuator_trnid[i, 0])).name if plain else ""
        if not plain or not (motor or servo) or joint in found:
            name = model.actuator(i).name or i + 1
            raise InputError(
                f"{path}: actuator {name} is neither the only motor nor the only position servo (gear 1) of a joint; "
                f"remove it from the file and describe the drive in robot.yaml"
            )
        if motor:
            found[joint] = Drive("torque", gain=float(gain[0] * gear[0]))
        else:
            found[joint] = Drive("position", kp=float(gain[0]), kd=float(-bias[2]), limit=limit)
    return found


def _tree(mujoco: Any, model: Any, locked: dict[str, float], path: Path) -> Tree:
    data = mujoco.MjData(model)
    joints = [model.joint(j).name for j in range(model.njnt)]
    for name, position in locked.items():
        if name not in joints:
            raise InputError(f"{path}: there is no joint {name} to lock; there are {', '.join(joints)}")
        data.qpos[model.jnt_qposadr[joints.index(name)]] = position
    for j, name in enumerate(joints):
        if name not in locked:
            data.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, data)
    free = [j for j in range(model.njnt) if joints[j] not in locked]
    if not free:
        raise InputError(f"{path}: every joint is locked; leave at least one that moves")
    number = {j: i for i, j in enumerate(free)}
    carrier = _carriers(model, number)
    frames = {i: _frame(model, data, j, free) for j, i in number.items()}
    speeds = _speeds(path)
    links = []
    for j, i in number.items():
        parent = _parent(model, j, number, carrier)
        turn, origin = frames[i]
        below_turn, below = frames[parent] if parent >= 0 else (np.eye(3), np.zeros(3))
        body = int(model.jnt_bodyid[j])
        mass, com, inertia = _lumped(model, data, i, carrier, turn, origin)
        own = data.xmat[body].reshape(3, 3)
        limited = bool(model.jnt_limited[j])
        effort = float(np.max(np.abs(model.jnt_actfrcrange[j]))) if model.jnt_actfrclimited[j] else None
        dof = int(model.jnt_dofadr[j])
        links.append(
            Link(
                joint=joints[j],
                body=_body_name(model, j, body, carrier[body] == i),
                parent=parent,
                slides=model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE,
                rotation=below_turn.T @ turn,
                place=below_turn.T @ (origin - below),
                mass=mass,
                com=com,
                inertia=inertia,
                body_rotation=turn.T @ own,
                body_place=turn.T @ (data.xpos[body] - origin),
                armature=float(model.dof_armature[dof]) + _of_drives(mujoco, model, j, model.actuator_armature),
                damping=float(model.dof_damping[dof]) + _of_drives(mujoco, model, j, model.actuator_damping),
                friction=float(model.dof_frictionloss[dof]),
                limits=(float(model.jnt_range[j, 0]), float(model.jnt_range[j, 1])) if limited else None,
                effort=effort,
                speed=speeds.get(joints[j]),
            )
        )
    source = ModelFile(path.resolve(), locked)
    tree = Tree(tuple(links), np.array(model.opt.gravity, dtype=float), source)
    _check_masses(tree, path)
    check_names(tree, path)
    return tree


def _speeds(path: Path) -> dict[str, float]:
    """Largest speeds of the joints in a URDF, which MuJoCo does not keep; an MJCF has none."""
    root = urdf_root(path)
    limits = {} if root is None else {joint.get("name", ""): joint.find("limit") for joint in root.iter("joint")}
    stated = {name: limit.get("velocity") for name, limit in limits.items() if limit is not None}
    return {name: float(speed) for name, speed in stated.items() if speed is not None and float(speed) > 0.0}


def _of_drives(mujoco: Any, model: Any, j: int, values: np.ndarray) -> float:
    """What the actuators of joint j add to its armature or damping, through their gears."""
    in_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    own = in_joint & (model.actuator_trnid[:, 0] == j)
    return float(np.sum(np.ravel(values)[own] * model.actuator_gear[own, 0] ** 2))


def _body_name(model: Any, j: int, body: int, moving: bool) -> str:
    """Name of the link that joint j carries: the body's, or one of its own between two joints of the body."""
    name = model.body(body).name or f"body{body}"
    return name if moving else f"{name}_{model.joint(j).name}"


def _carriers(model: Any, number: dict[int, int]) -> dict[int, int]:
    """The link that carries each body: of its last joint that moves, else of the body below; -1 for the ground."""
    carrier = {0: -1}
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        own = [number[j] for j in range(first, first + count) if j in number] if count else []
        carrier[body] = own[-1] if own else carrier[int(model.body_parentid[body])]
    return carrier


def _parent(model: Any, j: int, number: dict[int, int], carrier: dict[int, int]) -> int:
    """The link below joint j: that of the joint before it on the same body, else the carrier of the body below."""
    body = int(model.jnt_bodyid[j])
    before = [number[k] for k in range(int(model.body_jntadr[body]), j) if k in number]
    return before[-1] if before else carrier[int(model.body_parentid[body])]


def _frame(model: Any, data: Any, j: int, free: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and origin of a link in the world: z along the joint, x across to the next joint, which makes zeros."""
    z, anchor = np.array(data.xaxis[j]), np.array(data.xanchor[j])
    body = int(model.jnt_bodyid[j])
    following = next((k for k in free if k > j and int(model.body_parentid[model.jnt_bodyid[k]]) == body), None)
    across = np.zeros(3)
    if following is not None:
        other, there = np.array(data.xaxis[following]), np.array(data.xanchor[following])
        across = np.cross(z, other)
        apart = there - anchor
        if np.linalg.norm(across) < 1e-9:  # parallel axes: across the gap between them
            across = apart - z * (z @ apart)
        elif abs(z @ other) < 1.0:
            # foot of the common normal on this axis
            along = (apart @ z - (apart @ other) * (z @ other)) / (1.0 - (z @ other) ** 2)
            anchor = anchor + along * z
    if np.linalg.norm(across) < 1e-9:
        across = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x = across / np.linalg.norm(across)
    return np.stack([x, np.cross(z, x), z], axis=1), anchor


def _lumped(
    model: Any, data: Any, link: int, carrier: dict[int, int], turn: np.ndarray, origin: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and inertia about it of all bodies that a link carries, in the link's frame."""
    bodies = [body for body, carried_by in carrier.items() if body > 0 and carried_by == link]
    masses = np.array([model.body_mass[body] for body in bodies])
    total = float(masses.sum())
    if not total:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    places = np.array([turn.T @ (data.xipos[body] - origin) for body in bodies])
    com = masses @ places / total
    inertia = np.zeros((3, 3))
    for body, place in zip(bodies, places, strict=True):
        axes = turn.T @ data.ximat[body].reshape(3, 3)
        away = place - com
        shift = model.body_mass[body] * (away @ away * np.eye(3) - np.outer(away, away))
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T + shift
    return total, com, inertia


def _check_masses(tree: Tree, path: Path) -> None:
    """Every joint must move some inertia: its own or that of links above it."""
    carried = [link.mass + link.armature for link in tree.links]
    for i in reversed(range(len(tree.links))):
        if tree.links[i].parent >= 0:
            carried[tree.links[i].parent] += carried[i]
    for link, inertia in zip(tree.links, carried, strict=True):
        if not inertia > 0.0:
            raise InputError(f"{path}: body {link.body} that joint {link.joint} moves has no mass; give it an inertial")
