"""Inertial numbers of the links of a tree, for many models at once, and what they amount to at rest."""

import math

import numpy as np

from wipx.core.model import ModelBatch
from wipx.core.tree import Link, Tree
from wipx.sim.tree import equations as E


def inertial_numbers(batch: ModelBatch, link: Link) -> np.ndarray:
    """Mass, mass times centre, inertia about the link's origin (xx, yy, zz, xy, xz, yz), shape (10, P).

    Numbers of the body's own frame and effects at the link (payload, com_offset, inertia) are part of them.
    """
    if not link.mass:  # between two joints of one body
        return np.zeros((E.NUMBERS, batch.size))
    numbers = body_numbers(link, *body_of(batch, link))
    payload = f"link_{link.body}/payload"
    if payload in batch.model.effects:
        place = np.stack([batch.column(f"{payload}.{axis}") for axis in "xyz"])
        numbers = numbers + body_numbers(link, batch.column(f"{payload}.mass"), place, np.zeros(1))
    return numbers


def body_of(batch: ModelBatch, link: Link) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body of a link with a mass, without its payload, as `body_numbers` takes it."""
    body, effects = link.body, batch.model.effects
    com = np.stack([batch.column(f"{body}.com_{axis}") for axis in "xyz"])
    scale = batch.column(f"{body}.inertia")
    if f"link_{body}/com_offset" in effects:
        com = com + np.stack([batch.column(f"link_{body}/com_offset.{axis}") for axis in "xyz"])
    if f"link_{body}/inertia" in effects:
        scale = scale * batch.column(f"link_{body}/inertia.scale")
    return batch.column(f"{body}.mass"), com, scale


def body_numbers(link: Link, mass: np.ndarray, com: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """The ten numbers of a link with P bodies in turn, shape (10, P).

    Args:
        link: The link.
        mass: Of the body, shape (P,) or (1,) [kg].
        com: Its centre in the frame of the link's body, shape (3, P) or (3, 1) [m].
        scale: Its inertia about the centre over that in the link's file, shape (P,) or (1,).
    """
    return _numbers(mass, link.body_rotation @ com + link.body_place[:, None], scale * link.inertia[..., None])


def _numbers(mass: np.ndarray, com: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Of masses (P,), centres (3, P) and inertias about them (3, 3, P)."""
    moment = mass * com
    xx, yy, zz = moment * com
    found = np.empty((E.NUMBERS, max(moment.shape[1], inertia.shape[2])))
    found[0], found[1:4] = mass, moment
    found[4], found[5], found[6] = inertia[0, 0] + yy + zz, inertia[1, 1] + xx + zz, inertia[2, 2] + xx + yy
    found[7] = inertia[0, 1] - moment[0] * com[1]
    found[8] = inertia[0, 2] - moment[0] * com[2]
    found[9] = inertia[1, 2] - moment[1] * com[2]
    return found


def numbers_of(mass: float, com: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """The ten numbers (10,) of a mass, its centre (3,) and the inertia about it (3, 3)."""
    return _numbers(np.array([mass]), com[:, None], inertia[..., None])[:, 0]


def lumped(numbers: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass (3,) and inertia about it (3, 3) from the ten numbers of a link (10,)."""
    mass, first = float(numbers[0]), numbers[1:4]
    com = first / mass if mass else np.zeros(3)
    xx, yy, zz, xy, xz, yz = numbers[4:].tolist()
    about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return mass, com, about - mass * (com @ com * np.eye(3) - np.outer(com, com))


def gravity(batch: ModelBatch, tree: Tree) -> np.ndarray:
    """Gravity in the frame of the base, which may be tilted, shape (3, P) [m/s^2]."""
    size = np.zeros(batch.size)
    if "environment/base_tilt" not in batch.model.effects:
        return tree.gravity[:, None] + size
    roll, pitch = (batch.column(f"environment/base_tilt.{name}") for name in ("roll", "pitch"))
    zero, one = size, size + 1.0
    about_x = np.array([[one, zero, zero], [zero, np.cos(roll), -np.sin(roll)], [zero, np.sin(roll), np.cos(roll)]])
    about_y = np.array([[np.cos(pitch), zero, np.sin(pitch)], [zero, one, zero], [-np.sin(pitch), zero, np.cos(pitch)]])
    return np.einsum("ijp,jkp,i->kp", about_y, about_x, tree.gravity)


def rest_inertia(tree: Tree) -> np.ndarray:
    """Diagonal of the mass matrix with all joints at zero, shape (N,) [kg or kg m^2]."""
    poses = [E.pose(link, 0.0, math.sin(0.0), math.cos(0.0)) for link in tree.links]
    inertias = [link_inertia(link) for link in tree.links]
    matrix = E.mass_matrix(tree, poses, inertias, [link.armature for link in tree.links])
    return np.array([matrix[i, i] for i in range(len(tree.links))], dtype=float)


def link_inertia(link: Link) -> E.Inertia:
    """Inertial numbers of a link as its file has them."""
    numbers = _numbers(np.array([link.mass]), link.com[:, None], link.inertia[..., None])
    mass, x, y, z, *rest = numbers[:, 0].tolist()
    return E.Inertia(mass, (x, y, z), *rest)
