"""The picture of a robot: legible for two and for twenty joints, with what it is told about sites."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from wipx.core.tree import Link, Tree
from wipx.report.drawing import draw, svg
from wipx.report.robot_picture import ROW, heat, robot_picture
from wipx.report.stick_figure import APART, best_view, figure_size, stick_figure

TURNS = (np.eye(3), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))
DOWN = np.array([0.0, 0.0, -9.81])


def link(i: int, parent: int, place: tuple[float, float, float], *, turned: int = 0, slides: bool = False) -> Link:
    com = np.array([0.1, 0.0, 0.0])
    own = (np.eye(3), np.zeros(3))
    return Link(
        f"joint_{i}", f"body_{i}", parent, slides, TURNS[turned], np.array(place), 1.0, com, 0.01 * np.eye(3), *own
    )


def chain(count: int) -> Tree:
    """Every second joint turned by a right angle, and every third one at the place of the one below."""
    places = [(0.0 if i % 3 == 2 or i == 0 else 0.2, 0.0, 0.0) for i in range(count)]
    return Tree(tuple(link(i, i - 1, place, turned=i % 2) for i, place in enumerate(places)), DOWN)


def branches() -> Tree:
    """A slide that carries two arms of two joints."""
    arms = [(1, 0, 0.1), (2, 1, 0.3), (3, 0, -0.1), (4, 3, 0.3)]
    links = [link(i, parent, (0.0, y, 0.2), turned=i % 2) for i, parent, y in arms]
    return Tree((link(0, -1, (0.0, 0.0, 0.0), slides=True), *links), DOWN)


@pytest.mark.parametrize("tree", [chain(2), chain(20), branches()], ids=["2", "20", "branches"])
def test_every_joint_is_named_once_and_no_label_covers_another(tree: Tree):
    picture = robot_picture(tree, {joint: 0.3 for joint in tree.joints})
    assert sorted(text.text for text in picture.texts) == sorted(tree.joints)
    for side in ("start", "end"):
        rows = sorted(text.y for text in picture.texts if text.anchor == side)
        assert np.all(np.diff(rows) >= ROW - 1e-9)
        assert all(0.0 < y < picture.height for y in rows)


def test_joints_that_coincide_are_drawn_apart():
    tree, q = chain(7), np.full(7, 0.4)
    size = figure_size(tree, q)
    joints = stick_figure(tree, q, best_view(tree, q), size).joints
    gaps = np.linalg.norm(joints[:, None] - joints[None], axis=-1)[np.triu_indices(7, 1)]
    assert gaps.min() > 0.9 * APART * size


def test_gravity_points_down():
    tree = Tree((link(0, -1, (0.0, 0.0, 0.0)), link(1, 0, (0.3, 0.0, 0.0))), np.array([0.0, 9.81, 0.0]))
    view = best_view(tree, np.zeros(2))
    assert view.flat(np.array([0.0, 1.0, 0.0]))[1] == pytest.approx(-1.0)


def test_shares_colour_their_sites_and_are_written():
    shares = {"joint_1": 0.5, "actuator_joint_1": 0.25, "sensor_joint_0": 0.15, "link_body_0": 0.1}
    picture = robot_picture(chain(2), shares=shares)
    fills = {shape.site: shape.fill or shape.stroke for shape in picture.shapes if shape.site}
    assert all(fills[site] == heat(share) for site, share in shares.items())
    texts = {text.site: text.text for text in picture.texts}
    assert texts["joint_1"] == "joint_1: 50 %, drive 25 %"
    assert texts["joint_0"] == "joint_0: sensor 15 %"
    assert texts["link_body_0"] == "link body_0: 10 %"


def test_a_label_of_ones_own_is_taken_and_escaped():
    picture = robot_picture(chain(2), labels={"joint_1": "<b>&", "joint_0": ""})
    page = svg(picture)
    assert "&lt;b&gt;&amp;" in page
    assert ">joint_0</text>" not in page
    assert 'data-site="joint_1"' in page


def test_matplotlib_draws_the_same_texts():
    axes = Figure(figsize=(4.0, 3.0)).add_axes((0.0, 0.0, 1.0, 1.0))
    draw(axes, robot_picture(branches(), shares={"joint_0": 1.0}))
    assert "joint_0: 100 %" in [text.get_text() for text in axes.texts]
