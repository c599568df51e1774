"""A robot's MJCF or URDF file as MuJoCo reads it, left with what moves; what is no open tree is refused."""

import importlib
import re
from collections.abc import Collection
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from wipx.core.errors import InputError

FREE = "remove it for a robot on a stand; for a base that moves in the plane, put a slide and a hinge in its place"
BALL = "put three hinges in its place"
SHAPES = ("visual", "collision")  # elements of a URDF that are not needed where the inertia is given


def compiled_model(path: Path, locked: Collection[str] = ()) -> tuple[Any, Any]:
    """MuJoCo and the model of a file, without shapes, sensors and whatever acts on locked joints only.

    Raises:
        InputError: the file is missing or no such file, MuJoCo is not installed, or the robot is no open tree of hinges
            and slides on a fixed base.
    """
    try:
        mujoco = importlib.import_module("mujoco")
    except ModuleNotFoundError as error:
        raise InputError(f'{path} is read by MuJoCo, which is not installed; pip install "mujoco>=4.0,<5"') from error
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; give the path of an MJCF or URDF file relative to robot.yaml")
    spec = _specification(mujoco, path)
    release_locked(mujoco, spec, locked)
    _refuse_couplings(mujoco, spec, path)
    _strip(mujoco, spec)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"{path}: {_in_words(error, spec)}; correct the file") from error
    _refuse_forces(model, locked, path)
    return mujoco, model


def release_locked(mujoco: Any, spec: Any, locked: Collection[str]) -> None:
    """Remove what couples, drives or senses locked joints only: equalities, tendons, actuators, sensors."""
    in_joint, in_tendon = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON
    equal = [one for one in spec.equalities if one.type == mujoco.mjtEq.mjEQ_JOINT]
    _delete(spec, [one for one in equal if {one.name1, one.name2} - {""} <= set(locked)])
    slack = [one for one in spec.tendons if _joints_of(mujoco, one) <= set(locked)]
    names = {tendon.name for tendon in slack}
    _delete(spec, [one for one in spec.actuators if one.trntype == in_tendon and one.target in names])
    _delete(spec, [one for one in spec.actuators if one.trntype == in_joint and one.target in locked])
    _delete(spec, slack)
    of_joint = mujoco.mjtObj.mjOBJ_JOINT
    _delete(spec, [one for one in spec.sensors if one.objtype == of_joint and one.objname in locked])


def urdf_root(path: Path) -> ElementTree.Element | None:
    """The root of a URDF; None for an MJCF, and for XML that only a lenient reader takes."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError:
        return None
    return root if root.tag == "robot" else None


def _specification(mujoco: Any, path: Path) -> Any:
    """MuJoCo's specification of a file; a URDF without the shapes of links whose inertia it gives."""
    try:
        root = urdf_root(path)
        if root is None:
            return mujoco.MjSpec.from_file(str(path))
        for link in root.iter("link"):
            if link.find("inertial") is not None:
                for shape in [each for each in link if each.tag in SHAPES]:
                    link.remove(shape)
        return mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    except (ValueError, OSError) as error:
        raise InputError(f"{path}: {_in_words(error)}; expected an MJCF or URDF file") from error


def _in_words(error: Exception, spec: Any = None) -> str:
    """What MuJoCo says of a file, in one line."""
    text = str(error).strip() or type(error).__name__
    element = re.search(r"Element name '([^']+)'", text)
    body = f"body {element.group(1)}" if element else "a body"
    line = re.search(r"Line number=(\d+)", text)
    if line is not None:
        return f"line {line.group(1)} is not XML"
    if "mjMINVAL" in text:
        return f"{body} moves and has no mass or no inertia; give it an inertial with both above zero"
    if "A + B >= C" in text:
        found = f"{body} has an inertia that no body can have: one principal moment exceeds the sum of the other two"
        return found + (_moments(spec.body(element.group(1))) if element and spec is not None else "")
    return text.splitlines()[0].rstrip(".;") + (f" ({body})" if element else "")


def _moments(body: Any) -> str:
    """The principal moments of a body that are stated in a specification."""
    xx, yy, zz, xy, xz, yz = body.fullinertia
    full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = np.sort(np.linalg.eigvalsh(full) if np.all(np.isfinite(full)) else np.array(body.inertia))
    return f" ({moments[2]:.6g} > {moments[0]:.6g} + {moments[1]:.6g} kg m^2)"


def _strip(mujoco: Any, spec: Any) -> None:
    """Leave only what moves: joints, inertias and actuators."""
    _delete(spec, spec.sensors, spec.keys, spec.pairs, spec.excludes, spec.lights, spec.cameras)
    for body in spec.bodies[1:]:
        mesh = mujoco.mjtGeom.mjGEOM_MESH
        _delete(spec, [geom for geom in body.geoms if body.explicitinertial or geom.type == mesh])
    _delete(spec, spec.skins, spec.meshes, spec.hfields, spec.materials, spec.textures)


def _delete(spec: Any, *lists: Any) -> None:
    for each in (item for many in lists for item in list(many)):
        spec.delete(each)


def _joints_of(mujoco: Any, tendon: Any) -> set[str]:
    """Joints that a tendon runs over; one without a name stands for whatever else it runs over."""
    over_joint = mujoco.mjtWrap.mjWRAP_JOINT
    return {wrap.target.name if wrap.type == over_joint and wrap.target else "" for wrap in tendon.path}


def _refuse_couplings(mujoco: Any, spec: Any, path: Path) -> None:
    """Refuse what is no hinge or slide, and what closes a loop."""
    free, ball = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
    for joint in spec.joints:
        if joint.type in (free, ball):
            kind, advice = ("free", FREE) if joint.type == free else ("ball", BALL)
            raise InputError(
                f"{path}: joint {joint.name or 'without a name'} is a {kind} joint, expected hinges and slides on a "
                f"fixed base; {advice}"
            )
    if spec.equalities:
        first = spec.equalities[0]
        names = " and ".join(name for name in (first.name1, first.name2) if name)
        raise InputError(
            f"{path}: {names or first.name or 'two bodies'} are coupled (a closed loop, a coupling of joints or a "
            f"mimic joint), expected an open tree; lock both joints, or remove the coupling from the file"
        )
    if spec.tendons:
        raise InputError(
            f"{path}: tendon {spec.tendons[0].name or 1} is not supported; lock its joints, or remove it from the file"
        )


def _refuse_forces(model: Any, locked: Collection[str], path: Path) -> None:
    """Refuse what no tree of rigid links is, and forces of the file that no effect stands for."""
    if model.njnt == 0:
        raise InputError(f"{path}: the model has no joint that moves")
    for j in range(model.njnt):
        name = model.joint(j).name
        if not name:
            raise InputError(f"{path}: a joint of body {model.body(model.jnt_bodyid[j]).name} has no name; give it one")
        if name in locked:
            continue
        dof = int(model.jnt_dofadr[j])
        if np.any(model.dof_dampingpoly[dof] != 0.0):
            raise InputError(
                f"{path}: joint {name} has damping beyond the linear coefficient; "
                f"remove that and add the effect {name}/quadratic_drag instead"
            )
        if np.any(model.jnt_stiffness[j] != 0.0) or np.any(model.jnt_stiffnesspoly[j] != 0.0):
            raise InputError(f"{path}: joint {name} has a spring; remove it and add the effect {name}/spring instead")
    if np.any(model.body_gravcomp != 0.0):
        body = model.body(int(np.argmax(model.body_gravcomp != 0.0))).name
        raise InputError(f"{path}: body {body} has gravity compensation, which is not supported; remove it")
