"""A mechanism as URDF: a fixed rail or stand, the links, and payloads fixed to them."""

from wipx.core.model import Model
from wipx.sim.mechanism import EVENT, LEAST, Link, Part, mechanism

RAIL = (
    '<link name="rail"><inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
    "</link>"
)
FREE = '<limit lower="-1e9" upper="1e9" effort="1e9" velocity="1e9"/>'


def urdf(model: Model, *, with_event: bool = True) -> str:
    """The rigid body of a model as URDF; inertia of the joints themselves (`Link.rotor`) has no place in it.

    Args:
        model: Rigid body, geometry and environment.
        with_event: Whether the payload of a payload event is on the body.
    """
    links, below = RAIL, "rail"
    for link in mechanism(model):
        own = link.parts[0]
        links += f'<link name="{own.name}">{_inertial(own)}</link>{_joint(link, below)}'
        for part in link.parts[1:]:
            if with_event or part.name != EVENT:
                links += _fixed(part, own.name)
        below = own.name
    return f'<robot name="{model.plant.kind}">{links}</robot>'


def _joint(link: Link, below: str) -> str:
    axis = " ".join(repr(x) for x in link.axis)
    return (
        f'<joint name="{link.joint}" type="{"prismatic" if link.slides else "continuous"}">'
        f'<parent link="{below}"/><child link="{link.parts[0].name}"/>'
        f'<origin xyz="0 0 {link.up!r}"/><axis xyz="{axis}"/>{FREE}</joint>'
    )


def _fixed(part: Part, carrier: str) -> str:
    return (
        f'<link name="{part.name}">{_inertial(part)}</link>'
        f'<joint name="{part.name}" type="fixed"><parent link="{carrier}"/><child link="{part.name}"/></joint>'
    )


def _inertial(part: Part) -> str:
    about = max(part.inertia, LEAST)
    return (
        f'<inertial><origin xyz="{part.across!r} 0 {part.up!r}"/><mass value="{max(part.mass, LEAST)!r}"/>'
        f'<inertia ixx="{about!r}" iyy="{about!r}" izz="{about!r}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
