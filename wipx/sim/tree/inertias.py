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
    body = link.body
    if not link.mass:  # between two joints of one body
        return np.zeros((E.NUMBERS, batch.size))
    mass = batch.column(f"{body}.mass")
    com = np.stack([batch.column(f"{body}.com_{axis}") for axis in "xyz"])
    scale = batch.column(f"{body}.inertia")
    effects = batch.model.effects
    if f"link_{body}/com_offset" in effects:
        com = com + np.stack([batch.column(f"link_{body}/com_offset.{axis}") for axis in "xyz"])
    if f"link_{body}/inertia" in effects:
        scale = scale * batch.column(f"link_{body}/inertia.scale")
    numbers = _numbers(mass, _placed(link, com), scale * link.inertia[..., None])
    if f"link_{body}/payload" in effects:
        place = np.stack([batch.column(f"link_{body}/payload.{axis}") for axis in "xyz"])
        extra = batch.column(f"link_{body}/payload.mass")
        numbers = numbers + _numbers(extra, _placed(link, place), np.zeros((3, 3, 1)))
    return numbers


def _placed(link: Link, place: np.ndarray) -> np.ndarray:
    """Points (3, P) of the body's frame in the link's."""
    return link.body_rotation @ place + link.body_place[:, None]


def _numbers(mass: np.ndarray, com: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Of masses (P,), centres (3, P) and inertias about them (3, 3, P)."""
    about = inertia + mass * (np.sum(com**2, axis=0) * np.eye(3)[..., None] - com[:, None] * com[None])
    entries = [about[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return np.stack([mass, *(mass * com), *entries])


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
