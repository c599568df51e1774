"""A mechanism as MuJoCo's XML (MJCF).

Effects on the signals (delays, scales, biases) are not in it, and friction only where it is asked for.
"""

from xml.sax.saxutils import quoteattr

import numpy as np

from wipx.core.model import Model
from wipx.core.tree import Tree
from wipx.effects.catalogue import kind_of
from wipx.sim.mechanism import EVENT, LEAST, ComingLoad, Mechanism, mechanism
from wipx.sim.tree.frames import NEGLIGIBLE, own_frame, placed, principal

NO_CONTACT = '<flag contact="disable"/>'
BUILT_IN = ("damping", "frictionloss", "gear")  # parameters of MuJoCo's that effects may be (`Effect.built_in`)


def mjcf(model: Model, step: float, *, built_in: tuple[str, ...] = ()) -> str:
    """The rigid body of a model as MuJoCo's XML.

    Args:
        model: Rigid body, geometry and environment.
        step: Of the integrator [s].
        built_in: Those of `BUILT_IN` that the joints and motors shall have; effects that are others, and all by
            default, are left to whoever steps the engine.
    """
    plant, found = model.plant, mechanism(model)
    joints = {link.joint: _built_in(model, link.joint, built_in) for link in found.tree.links}
    motors = "".join(
        f'<motor name={quoteattr(command)} joint={quoteattr(joint)} gear="{_gear(model, joint, built_in)!r}"/>'
        for command, joint in zip(plant.commands, plant.actuated, strict=True)
    )
    sensors = "".join(
        f"<jointpos name={quoteattr(column)} joint={quoteattr(joint)}/>"
        for joint, column in zip(plant.joints, plant.coordinates, strict=True)
    )
    return (
        f'<mujoco><size memory="64K"/>{option(found.tree, step, NO_CONTACT)}'
        f"<worldbody>{bodies(found, joints)}</worldbody>"
        f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


def option(tree: Tree, step: float, flags: str = "") -> str:
    """The element with gravity and the step [s]."""
    return f'<option timestep="{step!r}" gravity="{_text(tree.gravity)}" tolerance="1e-10">{flags}</option>'


def bodies(found: Mechanism, joints: dict[str, str]) -> str:
    """The bodies of a mechanism in their own frames, each inside of the one that carries it.

    Args:
        found: Links and a payload that comes.
        joints: Further attributes of the joints, by name.
    """
    tree = found.tree
    frames = [own_frame(link) for link in tree.links]
    texts = [""] * len(tree.links)
    for i in reversed(range(len(tree.links))):
        link, frame = tree.links[i], frames[i]
        turn, place = placed(tree, frames, i)
        com, inertia = frame.inside(link.com), frame.turn.T @ link.inertia @ frame.turn
        coming = _coming(found.coming) if found.coming is not None and found.coming.link == i else ""
        texts[i] = (
            f"<body name={quoteattr(link.body)}{_attribute('pos', place)}{_axes(turn)}>"
            f"{_inertial(link.mass, com, inertia)}"
            f'<joint name={quoteattr(link.joint)} type="{"slide" if link.slides else "hinge"}"'
            f'{_attribute("pos", frame.anchor)} axis="{_text(frame.axis)}" armature="{link.armature!r}"'
            f"{joints.get(link.joint, '')}/>{coming}{''.join(texts[k] for k in _carried(tree, i))}</body>"
        )
    return "".join(texts[k] for k in _carried(tree, -1))


def _carried(tree: Tree, i: int) -> list[int]:
    return [k for k, link in enumerate(tree.links) if link.parent == i]


def _coming(load: ComingLoad) -> str:
    return f'<body name="{EVENT}">{_inertial(load.mass, load.place, np.zeros((3, 3)))}</body>'


def _inertial(mass: float, com: np.ndarray, inertia: np.ndarray) -> str:
    moments, axes = principal(inertia, LEAST)
    return f'<inertial pos="{_text(com)}"{_axes(axes)} mass="{max(mass, LEAST)!r}" diaginertia="{_text(moments)}"/>'


def _gear(model: Model, joint: str, built_in: tuple[str, ...]) -> float:
    """Force of a drive per unit of its command."""
    plant = model.plant
    if plant.tree is not None:
        gain, site = model.parameters.get(f"{joint}.gain", 1.0), f"actuator_{joint}"
    else:
        gain, site = model.parameters["input_gain"], "actuator"
    return gain * (_own(model, site, "gear", 1.0) if "gear" in built_in else 1.0)


def _built_in(model: Model, joint: str, built_in: tuple[str, ...]) -> str:
    """Damping and dry friction of a joint, as far as they are asked for."""
    found = ""
    for attribute, parameter in (("damping", "damping"), ("frictionloss", "friction")):
        if attribute in built_in:
            file = model.parameters.get(f"{joint}.{parameter}", 0.0)
            found += f' {attribute}="{file + _own(model, joint, attribute, 0.0)!r}"'
    return found


def _own(model: Model, site: str, parameter: str, absent: float) -> float:
    """What an effect at a site is as a parameter of MuJoCo's; `absent` where there is no such effect."""
    for name, values in model.effects.items():
        effect = kind_of(name)
        if name.startswith(f"{site}/") and effect.built_in == parameter:
            return values[effect.parameters[0].name]
    return absent


def _attribute(name: str, values: np.ndarray) -> str:
    return f' {name}="{_text(values)}"' if values.any() else ""


def _axes(turn: np.ndarray) -> str:
    if np.abs(turn - np.eye(3)).max() <= NEGLIGIBLE:
        return ""
    return f' xyaxes="{_text(turn[:, :2].T.ravel())}"'


def _text(values: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in values)
