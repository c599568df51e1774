"""Physics that the vocabulary lacks: cables, links that bend, hysteresis, something that moves in the hand."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wipx.proof.blind_robots.trees.links import Link, steiner
from wipx.proof.blind_robots.trees.physics import UnmodelledPhysics
from wipx.proof.blind_robots.trees.records import joint_records

Built = tuple[tuple[Link, ...], np.ndarray, np.ndarray, np.ndarray]


def built(unmodelled: UnmodelledPhysics, links: tuple[Link, ...], joints: np.ndarray, cable: np.ndarray) -> Built:
    """Links, records of joints and of the cable, and numbers of the joints that the owner knows."""
    return _BUILT[unmodelled.name](unmodelled, links, joints.copy(), cable.copy())


def _cable(unmodelled: UnmodelledPhysics, links: tuple[Link, ...], joints: np.ndarray, cable: np.ndarray) -> Built:
    for name in cable.dtype.names or ():
        cable[name] = unmodelled.values[name]
    return links, joints, cable, np.arange(len(links))


def _hysteresis(unmodelled: UnmodelledPhysics, links: tuple[Link, ...], joints: np.ndarray, cable: np.ndarray) -> Built:
    for name, value in unmodelled.values.items():
        joints[unmodelled.joint][name] = value
    return links, joints, cable, np.arange(len(links))


def _bending(unmodelled: UnmodelledPhysics, links: tuple[Link, ...], joints: np.ndarray, cable: np.ndarray) -> Built:
    """Cut a link in its middle and join the parts by a hinge with a spring, across its length."""
    i, values = unmodelled.joint, unmodelled.values
    whole = links[i]
    direction = whole.tip / whole.length
    middle = 0.5 * whole.tip
    # each half has half of the mass; the inertia is shared so that at rest nothing has changed
    shift = 0.25 * whole.length * direction
    rest = whole.inertia - whole.mass * steiner(shift)
    if np.linalg.eigvalsh(rest)[0] <= 0.0:
        shift = shift * 0.9 * np.sqrt(np.linalg.eigvalsh(whole.inertia)[0] / (whole.mass * shift @ shift))
        rest = whole.inertia - whole.mass * steiner(shift)
    lower = replace(whole, mass=0.5 * whole.mass, com=whole.com - shift, inertia=0.5 * rest)
    across = np.cross(direction, whole.axis)
    if np.linalg.norm(across) < 0.1:
        across = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
    upper = replace(
        whole, parent=i, slides=False, axis=across / np.linalg.norm(across), turn=np.eye(3), place=middle,
        mass=0.5 * whole.mass, com=whole.com + shift - middle, inertia=0.5 * rest, armature=0.0,
    )  # fmt: skip
    above = [
        replace(link, parent=_moved(link, i, middle)[0], place=_moved(link, i, middle)[1]) for link in links[i + 1 :]
    ]
    visible = np.array([*range(i + 1), *range(i + 2, len(links) + 1)])
    return (*links[:i], lower, upper, *above), _with_spring(joints, i + 1, values), cable, visible


def _moved(link: Link, i: int, middle: np.ndarray) -> tuple[int, np.ndarray]:
    """Parent and place of a link after link i was cut."""
    if link.parent < i:
        return link.parent, link.place
    return link.parent + 1, link.place - middle if link.parent == i else link.place


def _slosh(unmodelled: UnmodelledPhysics, links: tuple[Link, ...], joints: np.ndarray, cable: np.ndarray) -> Built:
    """Let a part of the last link's mass slide on a spring; at rest nothing has changed."""
    i, values = unmodelled.joint, unmodelled.values
    hand = links[i]
    point = hand.com
    axis = np.array([values[f"axis_{name}"] for name in "xyz"])
    load = replace(
        hand, parent=i, slides=True, axis=axis, turn=np.eye(3), place=point, mass=values["mass"], com=np.zeros(3),
        inertia=np.zeros((3, 3)), armature=0.0,
    )  # fmt: skip
    lighter = hand.with_mass_at(-values["mass"], point)
    visible = np.arange(len(links))
    changed = (*links[:i], lighter, *links[i + 1 :], load)
    return changed, _with_spring(joints, len(links), values), cable, visible


def _with_spring(joints: np.ndarray, at: int, values) -> np.ndarray:
    """Records with one more joint, which nobody drives and nobody sees."""
    extra = joint_records(1)
    extra["spring"], extra["viscous"] = values["stiffness"], values["damping"]
    return np.concatenate([joints[:at], extra, joints[at:]])


_BUILT: dict[str, Callable[[UnmodelledPhysics, tuple[Link, ...], np.ndarray, np.ndarray], Built]] = {
    "cable": _cable,
    "hysteresis": _hysteresis,
    "flexible_link": _bending,
    "slosh": _slosh,
}
