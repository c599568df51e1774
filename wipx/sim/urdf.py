"""A mechanism as URDF: a fixed ground, the links, and a payload that comes, fixed to its link."""

from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

import numpy as np

from wipx.core.tree import Link
from wipx.sim.mechanism import EVENT, LEAST, ComingLoad, Mechanism
from wipx.sim.tree.frames import BodyFrame, frame_on_axis, own_frame, placed, principal, roll_pitch_yaw

GROUND = "ground"
WITHOUT_MASS = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
FREE = '<limit lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"/>'


def urdf(found: Mechanism, name: str, *, with_event: bool = True, joints: Mapping[str, str] | None = None) -> str:
    """A mechanism as URDF; inertia of the joints themselves (armature) has no place in it.

    A link's frame has the axes of its body's own frame, its origin on the joint's axis.

    Args:
        found: Links and a payload that comes.
        name: Of the robot.
        with_event: Whether the payload is on the body.
        joints: Elements of the joints beside their places, by name; without limits if left out.
    """
    tree = found.tree
    frames = [frame_on_axis(link) for link in tree.links]
    names = [link.body for link in tree.links]
    ground = GROUND
    while ground in names:
        ground += "_"
    text = f"<link name={quoteattr(ground)}>{WITHOUT_MASS}</link>"
    for i, (link, frame) in enumerate(zip(tree.links, frames, strict=True)):
        below = names[link.parent] if link.parent >= 0 else ground
        com, inertia = frame.inside(link.com), frame.turn.T @ link.inertia @ frame.turn
        turn, place = placed(tree, frames, i)
        kind = "prismatic" if link.slides else "continuous"
        own = FREE
        if joints is not None:
            own, kind = joints[link.joint], kind if link.slides or link.limits is None else "revolute"
        text += (
            f"<link name={quoteattr(link.body)}>{_inertial(link.mass, com, inertia)}</link>"
            f'<joint name={quoteattr(link.joint)} type="{kind}">'
            f"<parent link={quoteattr(below)}/><child link={quoteattr(link.body)}/>{_origin(turn, place)}"
            f'<axis xyz="{_text(frame.axis)}"/>{own}</joint>'
        )
    if found.coming is not None and with_event:
        text += _fixed(found.coming, tree.links[found.coming.link], frames[found.coming.link])
    return f"<robot name={quoteattr(name)}>{text}</robot>"


def _fixed(load: ComingLoad, carrier: Link, frame: BodyFrame) -> str:
    own = own_frame(carrier)
    place = frame.inside(own.turn @ load.place + own.origin)
    return (
        f'<link name="{EVENT}">{_inertial(load.mass, place, np.zeros((3, 3)))}</link><joint name="{EVENT}" '
        f'type="fixed"><parent link={quoteattr(carrier.body)}/><child link="{EVENT}"/></joint>'
    )


def _inertial(mass: float, com: np.ndarray, inertia: np.ndarray) -> str:
    moments, axes = principal(inertia, LEAST)
    xx, yy, zz = (repr(float(x)) for x in moments)
    return (
        f'<inertial>{_origin(axes, com)}<mass value="{max(mass, LEAST)!r}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def _origin(turn: np.ndarray, place: np.ndarray) -> str:
    return f'<origin xyz="{_text(place)}" rpy="{_text(roll_pitch_yaw(turn))}"/>'


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)
