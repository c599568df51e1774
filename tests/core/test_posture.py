"""Where links stand in space."""

import numpy as np

from wipx.core.posture import posture
from wipx.core.tree import Link, Tree


def link(name: str, parent: int, *, slides: bool = False, rotation: np.ndarray | None = None) -> Link:
    place = np.array([0.0 if parent < 0 else 0.5, 0.0, 0.0])
    turn = np.eye(3) if rotation is None else rotation
    return Link(name, name, parent, slides, turn, place, 1.0, place, np.eye(3), np.eye(3), np.zeros(3))


def test_two_hinges_reach_where_trigonometry_says():
    tree = Tree((link("a", -1), link("b", 0)), np.array([0.0, 0.0, -9.81]))
    at = posture(tree, np.array([0.4, 0.3]))
    np.testing.assert_allclose(at.origins[1], [0.5 * np.cos(0.4), 0.5 * np.sin(0.4), 0.0])
    tip = at.point(1, np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(tip - at.origins[1], [np.cos(0.7), np.sin(0.7), 0.0])


def test_a_slide_moves_along_its_own_axis():
    upward_to_x = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    tree = Tree((link("a", -1), link("b", 0, slides=True, rotation=upward_to_x)), np.zeros(3))
    at = posture(tree, np.array([np.pi / 2.0, 0.2]))
    np.testing.assert_allclose(at.origins[1], [0.0, 0.7, 0.0], atol=1e-12)
