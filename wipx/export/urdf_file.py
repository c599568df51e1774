"""A completed model as URDF: bodies, damping, dry friction, limits of joints. URDF knows no drives and no sensors."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wipx.core.export_result import Statement, approximated, exact, lost
from wipx.core.model import Model
from wipx.core.tree import Link, Tree
from wipx.export.mjcf import STEP, ExportedFile, compiled_urdf
from wipx.export.owner_urdf import UNLIMITED, owner_urdf
from wipx.sim.mechanism import EVENT, Mechanism, check_possible, mechanism
from wipx.sim.urdf import urdf

DRY = {
    "coulomb": ("F_c", "friction of the joint"),
    "stribeck": ("F_c", "friction of the joint, without the static level"),
    "lagged_stribeck": (
        "F_c",
        "friction and damping of the joint, without the static level, the dead zone and the lag",
    ),
    "presliding": ("F_c", "friction of the joint, without the bristle"),
    "lugre": ("F_c", "friction of the joint, without the bristle and the static level"),
    "hysteresis": ("F_c", "friction of the joint, without the bristle"),
}
SAME = {"viscous": "damping", "coulomb": "friction"}
LIMITS = {"saturation": "effort", "speed_limit": "effort and velocity"}
BODIES = {"base_tilt": "rotation of the joints on the ground", "rail_tilt": "axis of the joint"}
DAMPED = {"viscous": "sigma", "lagged_stribeck": "sigma"}


def export_urdf(model: Model, step: float | None = None) -> ExportedFile:
    """A completed model as URDF.

    Args:
        model: The completed model.
        step: Of the integrator with which MuJoCo judges it [s].

    Raises:
        InputError: MuJoCo, which judges it, is not installed, or a link is no rigid body.
    """
    check_possible(model, "task=export", "")
    found = mechanism(model)
    turn = _down(found.tree.gravity)
    found = _upright(found, turn)
    joints = {link.joint: _joint(model, link) for link in found.tree.links}
    root = ElementTree.fromstring(urdf(found, model.plant.kind, with_event=False, joints=joints))
    ElementTree.indent(root)
    text = '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
    compiled = compiled_urdf(model, found, text, step or STEP)
    terms = {name: ElementTree.fromstring(f"<joint>{each}</joint>") for name, each in joints.items()}
    own, note = owner_urdf(model, terms, turn)
    source = model.plant.tree.source.path if own and model.plant.tree and model.plant.tree.source else None
    said = _statements(model, found.tree)
    return ExportedFile(own or text, compiled, float(compiled.opt.timestep), source, note, said, has_runtime=False)


def _down(gravity: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) of the ground after which gravity (3,) points down, as URDF has it."""
    size = float(np.linalg.norm(gravity))
    return _turning(gravity / size, np.array([0.0, 0.0, -1.0])) if size else np.eye(3)


def _upright(found: Mechanism, turn: np.ndarray) -> Mechanism:
    """The same robot on a ground that is turned."""
    if (turn == np.eye(3)).all():
        return found
    links = []
    for link in found.tree.links:
        moved = {"rotation": turn @ link.rotation, "place": turn @ link.place} if link.parent < 0 else {}
        links.append(replace(link, **moved))
    return Mechanism(Tree(tuple(links), turn @ found.tree.gravity), found.coming)


def _turning(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The smallest rotation (3, 3) from one unit vector to another."""
    axis, cosine = np.cross(one, other), float(one @ other)
    if cosine < -1.0 + 1e-12:  # half a turn about any axis across
        across = np.cross(one, np.eye(3)[int(np.argmin(np.abs(one)))])
        across /= np.linalg.norm(across)
        return 2.0 * np.outer(across, across) - np.eye(3)
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + skew + skew @ skew / (1.0 + cosine)


def _joint(model: Model, link: Link) -> str:
    """Dynamics and limits of a joint."""
    damping = model.parameters.get(f"{link.joint}.damping", 0.0)
    friction = model.parameters.get(f"{link.joint}.friction", 0.0)
    for name, values in model.effects.items():
        site, _, kind = name.partition("/")
        if site == link.joint:
            damping += values[DAMPED[kind]] if kind in DAMPED else 0.0
            friction += values[DRY[kind][0]] if kind in DRY else 0.0
            friction += 0.5 * (values["F_plus"] + values["F_minus"]) if kind == "asymmetric_coulomb" else 0.0
    drive = _drive_values(model, link.joint)
    effort = min(
        link.effort or UNLIMITED,
        drive.get("saturation", {}).get("F_max", UNLIMITED),
        drive.get("speed_limit", {}).get("F_stall", UNLIMITED),
    )
    velocity = drive.get("speed_limit", {}).get("v_free", UNLIMITED)
    low, high = link.limits if link.limits is not None else (-UNLIMITED, UNLIMITED)
    ends = f'lower="{low!r}" upper="{high!r}" ' if link.limits is not None or link.slides else ""
    return (
        f'<limit {ends}effort="{effort!r}" velocity="{velocity!r}"/>'
        f'<dynamics damping="{damping!r}" friction="{max(friction, 0.0)!r}"/>'
    )


def _drive_values(model: Model, joint: str) -> dict[str, Mapping[str, float]]:
    """Effects of the drive of a joint by kind."""
    if joint not in model.plant.actuated:
        return {}
    site = "actuator" if model.plant.tree is None else f"actuator_{joint}"
    return {name.partition("/")[2]: v for name, v in model.effects.items() if name.startswith(f"{site}/")}


def _statements(model: Model, tree: Tree) -> tuple[Statement, ...]:
    """What becomes of every effect, and of the joints' armature."""
    said = [_statement(model, name) for name in model.effects]
    effects = {statement.effect for statement in said}
    for link in tree.links:
        if link.armature and f"{link.joint}/rotor_inertia" not in effects:
            said.append(lost(f"{link.joint}.armature", "URDF has no inertia of joints"))
    return tuple(said)


def _statement(model: Model, name: str) -> Statement:
    """What becomes of an effect."""
    site, _, kind = name.partition("/")
    if site in model.plant.joints:
        return _of_joint(name, kind)
    if site.startswith("actuator"):
        if kind in LIMITS:
            return approximated(name, f"{LIMITS[kind]} of the joint's limit, which a simulator may or may not heed")
        return lost(name, "URDF has no drives")
    if site.startswith("sensor_"):
        return lost(name, "URDF has no sensors of joints")
    if kind == EVENT or name == "environment/spring":
        return lost(name, "URDF has no such law")
    return exact(name, BODIES.get(kind, "mass, centre and inertia of the link"))


def _of_joint(name: str, kind: str) -> Statement:
    if kind in SAME:
        return exact(name, f"{SAME[kind]} of the joint")
    if kind in DRY:
        return approximated(name, DRY[kind][1])
    if kind == "asymmetric_coulomb":
        return approximated(name, "friction of the joint, the mean of both directions")
    return lost(name, "URDF has no such law")
