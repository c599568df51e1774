"""The owner's own URDF with what a completed model changes: inertias, dynamics and limits of joints, a tilted base.

Meshes, materials, collision shapes, fixed links and comments stay as they are.
"""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np

from wipx.core.model import Model
from wipx.core.tree import Link, Tree
from wipx.export.owner_file import CHANGED, NO_BODY, BodyMass, changed_links, unusable
from wipx.sim.tree.frames import roll_pitch_yaw
from wipx.sim.tree.inertias import numbers_of

Element = ElementTree.Element
UNLIMITED = 1e9  # of efforts and velocities, which URDF wants


def owner_urdf(model: Model, joints: dict[str, Element], turn: np.ndarray) -> tuple[str | None, str]:
    """The owner's file with a completed model in it, or None and why it cannot be used.

    Args:
        model: The completed model.
        joints: `dynamics` and `limit` of each joint, below an element each.
        turn: From the frame of the base to one in which gravity points down, shape (3, 3).

    Returns:
        The content of the file, and an empty text; or None, and why (empty where the model stems from no URDF).
    """
    tree = model.plant.tree
    source = None if tree is None else tree.source
    if tree is None or source is None:
        return None, ""
    note = unusable(tree, source)
    if note:
        return None, note
    try:
        root = ElementTree.parse(source.path, _with_comments()).getroot()
    except ElementTree.ParseError as error:
        return None, str(error)
    if root.tag != "robot":
        return None, "the file is no URDF"
    note = _change_inertias(model, tree, root)
    if note:
        return None, note
    for name in source.locked:
        _named(root, "joint", name).set("type", "fixed")
    for name, terms in joints.items():
        _change_joint(_named(root, "joint", name), terms)
    if np.abs(turn - np.eye(3)).max() > CHANGED:
        _stand(root, turn)
    _find_meshes(root, source.path.parent)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n', ""


def _with_comments() -> ElementTree.XMLParser:
    return ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True))


def _named(root: Element, tag: str, name: str) -> Element:
    return next(each for each in root.iter(tag) if each.get("name") == name)


def _numbers(element: Element | None, attribute: str) -> np.ndarray:
    """Three numbers of an attribute; zeros where it is left out."""
    text = None if element is None else element.get(attribute)
    return np.zeros(3) if text is None else np.array([float(x) for x in text.split()])


def _change_inertias(model: Model, tree: Tree, root: Element) -> str:
    """Add what the model changes of each link to its element; why that cannot be, or nothing."""
    for link, change in changed_links(model, tree):
        inertial = _named(root, "link", link.body).find("inertial")
        found = None if inertial is None else BodyMass.of(link, _own_numbers(link, inertial) + change)
        if inertial is None or found is None:
            return NO_BODY.format(body=link.body)
        _write_inertial(inertial, found)
    return ""


def _own_numbers(link: Link, inertial: Element) -> np.ndarray:
    """Inertial numbers (10,) of an element in the frame of the tree's link."""
    origin, tensor = inertial.find("origin"), inertial.find("inertia")
    mass = inertial.find("mass")
    assert tensor is not None
    assert mass is not None
    xx, yy, zz, xy, xz, yz = (float(tensor.get(name, "0")) for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turn = link.body_rotation @ _rotation(_numbers(origin, "rpy"))
    com = link.body_rotation @ _numbers(origin, "xyz") + link.body_place
    return numbers_of(float(mass.get("value", "0")), com, turn @ about @ turn.T)


def _rotation(angles: np.ndarray) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    return np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]]) @ about_y @ about_x


def _write_inertial(inertial: Element, body: BodyMass) -> None:
    for tag in ("origin", "mass", "inertia"):
        for each in inertial.findall(tag):
            inertial.remove(each)
    ElementTree.SubElement(inertial, "origin", {"xyz": _text(body.com), "rpy": "0 0 0"})
    ElementTree.SubElement(inertial, "mass", {"value": repr(body.mass)})
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    ElementTree.SubElement(inertial, "inertia", {name: repr(float(body.inertia[at])) for name, at in entries.items()})


def _change_joint(joint: Element, terms: Element) -> None:
    """Set the damping, the dry friction and the limits that differ; the ends of the joint's way stay."""
    for wanted in terms:
        values = {name: value for name, value in wanted.attrib.items() if name not in ("lower", "upper")}
        found = joint.find(wanted.tag)
        if wanted.tag == "limit" and all(float(value) >= UNLIMITED for value in values.values()):
            continue
        if found is None:
            if any(float(value) for value in values.values()):
                ElementTree.SubElement(joint, wanted.tag, values)
            continue
        for name, value in values.items():
            before = float(found.get(name, "0"))
            if float(value) != before and float(value) < UNLIMITED:
                found.set(name, value)


def _stand(root: Element, turn: np.ndarray) -> None:
    """Put the robot's root link on a level ground on which it is tilted."""
    carried = {each.get("link") for each in root.iter("child")}
    names = {each.get("name") for each in root.iter("link")}
    base = next(each for each in root.iter("link") if each.get("name") not in carried).get("name", "")
    level = "level"
    while level in names:
        level += "_"
    ElementTree.SubElement(root, "link", {"name": level})
    joint = ElementTree.SubElement(root, "joint", {"name": f"{level}_to_{base}", "type": "fixed"})
    ElementTree.SubElement(joint, "parent", {"link": level})
    ElementTree.SubElement(joint, "child", {"link": base})
    ElementTree.SubElement(joint, "origin", {"xyz": "0 0 0", "rpy": _text(roll_pitch_yaw(turn))})


def _find_meshes(root: Element, folder: Path) -> None:
    """Make relative paths of meshes absolute."""
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if name and "://" not in name and not Path(name).is_absolute():
            mesh.set("filename", str((folder / name).resolve()))


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)
