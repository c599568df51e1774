"""A picture of a robot, drawn from its tree: joints, links, drives and sensors, each with a colour and a label.

    picture = robot_picture(tree, {"elbow": 0.4}, {"elbow": 0.6, "actuator_elbow": 0.3, "link_hand": 0.1})
    svg(picture)          # of wipx.report.drawing, for a page
    draw(axes, picture)   # likewise, with matplotlib

Where joints and links are in the picture is worked out in `wipx.report.stick_figure`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.tree import Tree
from wipx.report.diagnosis_words import percent
from wipx.report.drawing import Drawing, Shape, Text
from wipx.report.stick_figure import StickFigure, best_view, figure_size, stick_figure

BOX = (400.0, 330.0)  # largest width and height of the figure
MARGIN, ROW, LETTER = 26.0, 18.0, 6.6  # around the figure, height of a label's row, mean width of a letter
MOST_IN_ONE_COLUMN = 9  # labels; more are put on both sides
JOINT, RING = 6.5, (8.5, 11.5)  # radii of a joint's disc, and of the half rings of its drive and sensor
KEY_WIDTH = 480.0
LEAST_SHARE = 0.005  # smaller ones are not written
HEAT = ((0.0, (250, 214, 170)), (0.5, (232, 137, 60)), (1.0, (107, 29, 0)))  # colours of shares of the mismatch


def robot_picture(
    tree: Tree,
    posture: Mapping[str, float] | None = None,
    shares: Mapping[str, float] | None = None,
    labels: Mapping[str, str] | None = None,
) -> Drawing:
    """The picture of a robot.

    Args:
        tree: The robot.
        posture: Positions of joints [rad or m]; those that are left out are at zero.
        shares: Share of the mismatch by site of contract section 6, each from 0 to 1: JOINT, actuator_JOINT,
            sensor_JOINT, link_BODY, actuator, environment. None draws neither drives nor sensors.
        labels: Texts in place of the usual ones, by joint, by link_BODY, by actuator or environment. A joint's label
            speaks for its drive and sensor too; an empty text leaves the label out.
    """
    q = np.array([(posture or {}).get(joint, 0.0) for joint in tree.joints])
    view, size = best_view(tree, q), figure_size(tree, q)
    layout = _Layout.of(stick_figure(tree, q, view, size), tree)
    given = shares or {}
    texts = _label_texts(tree, given) | dict(labels or {})
    anchors = {site: layout.anchor(site, tree) for site, text in texts.items() if text}
    ordered = sorted(anchors, key=lambda site: anchors[site][1])
    left, right = _columns(ordered, anchors)
    widths = [max((LETTER * len(texts[site]) for site in column), default=0.0) for column in (left, right)]
    height = max(layout.height + 2.0 * MARGIN, ROW * (max(len(left), len(right)) + 1))
    offset = np.array([MARGIN + (widths[0] + MARGIN if left else 0.0), 0.5 * (height - layout.height)])
    shapes = list(_figure_shapes(layout.moved(offset), tree, given, ringed=shares is not None))
    edges = (offset[0] - MARGIN, offset[0] + layout.width + MARGIN)
    leaders, written = [], []
    for column, edge, outward in ((left, edges[0], -1.0), (right, edges[1], 1.0)):
        heights = _rows([anchors[site][1] + offset[1] for site in column], height)
        for site, y in zip(column, heights, strict=True):
            leaders.append(Shape(np.array([anchors[site] + offset, (edge, y)]), "rule", width=0.8))
            strong = any(given.get(own, 0.0) >= LEAST_SHARE for own in (site, f"actuator_{site}", f"sensor_{site}"))
            written.append(Text(edge + 4.0 * outward, y, texts[site], "end" if outward < 0 else "start", strong, site))
    width = edges[1] + widths[1] + MARGIN
    if shares is not None:
        key_shapes, key_texts = _key(MARGIN, height + 6.0)
        shapes, written, height = [*shapes, *key_shapes], [*written, *key_texts], height + 34.0
        width = max(width, KEY_WIDTH)
    return Drawing(float(width), float(height), (*leaders, *shapes), tuple(written))


def heat(share: float) -> str:
    """Colour of a share of the mismatch, from pale at 0 to dark at 1."""
    at = [place for place, _ in HEAT]
    mixed = [np.interp(min(max(share, 0.0), 1.0), at, [colour[i] for _, colour in HEAT]) for i in range(3)]
    return "#" + "".join(f"{round(value):02x}" for value in mixed)


@dataclass(frozen=True)
class _Layout:
    """A figure in pixels, y downwards."""

    base: np.ndarray
    joints: np.ndarray
    ends: np.ndarray
    axes: np.ndarray
    ground: np.ndarray
    width: float
    height: float

    @classmethod
    def of(cls, figure: StickFigure, tree: Tree) -> "_Layout":
        """The figure, as large as `BOX` lets it be."""
        points = np.vstack([figure.base, figure.joints, figure.ends])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        extent = high - low
        scale = float(np.min(np.array(BOX) / np.maximum(extent, 1e-9)))
        turn = np.array([1.0, -1.0])

        def place(at: np.ndarray) -> np.ndarray:
            return (at - np.array([low[0], high[1]])) * scale * turn

        width, height = scale * extent
        return cls(
            place(figure.base),
            place(figure.joints),
            place(figure.ends),
            figure.axes * turn,
            figure.ground * turn,
            float(width),
            float(height),
        )

    def moved(self, offset: np.ndarray) -> "_Layout":
        """The same figure elsewhere."""
        places = (self.base + offset, self.joints + offset, self.ends + offset)
        return _Layout(*places, self.axes, self.ground, self.width, self.height)

    def link(self, i: int, tree: Tree) -> list[np.ndarray]:
        """Where link i ends: at the joints that it carries, else at its tip."""
        above = [self.joints[k] for k, link in enumerate(tree.links) if link.parent == i]
        return above or [self.ends[i]]

    def anchor(self, site: str, tree: Tree) -> np.ndarray:
        """The point that a label speaks of."""
        if site in tree.joints:
            return self.joints[tree.joints.index(site)]
        bodies = [f"link_{link.body}" for link in tree.links]
        if site in bodies:
            i = bodies.index(site)
            return 0.5 * (self.joints[i] + self.link(i, tree)[0])
        return self.base


def _label_texts(tree: Tree, shares: Mapping[str, float]) -> dict[str, str]:
    """Every joint with the shares of itself, its drive and its sensor; links and the rest where they have one."""
    texts = {}
    for joint in tree.joints:
        parts = {"": joint, "drive ": f"actuator_{joint}", "sensor ": f"sensor_{joint}"}
        said = [
            f"{word}{percent(shares[site])}" for word, site in parts.items() if shares.get(site, 0.0) >= LEAST_SHARE
        ]
        texts[joint] = f"{joint}: {', '.join(said)}" if said else joint
    others = {f"link_{link.body}": f"link {link.body}" for link in tree.links}
    others |= {"actuator": "all drives", "environment": "base"}
    for site, words in others.items():
        if shares.get(site, 0.0) >= LEAST_SHARE:
            texts[site] = f"{words}: {percent(shares[site])}"
    return texts


def _columns(ordered: list[str], anchors: Mapping[str, np.ndarray]) -> tuple[list[str], list[str]]:
    """Which labels are to the left and which to the right of the figure, both from top to bottom."""
    if len(ordered) <= MOST_IN_ONE_COLUMN:
        return [], ordered
    by_side = sorted(ordered, key=lambda site: anchors[site][0])
    left = set(by_side[: len(by_side) // 2])
    return [site for site in ordered if site in left], [site for site in ordered if site not in left]


def _rows(wanted: list[float], height: float) -> list[float]:
    """Heights near the wanted ones, which ascend, at least `ROW` apart and inside the picture."""
    placed = list(wanted)
    for i, y in enumerate(placed):
        placed[i] = max(y, 0.6 * ROW) if i == 0 else max(y, placed[i - 1] + ROW)
    bottom = height - 0.6 * ROW
    for i in reversed(range(len(placed))):
        placed[i] = min(placed[i], bottom)
        bottom = placed[i] - ROW
    return placed


def _figure_shapes(at: _Layout, tree: Tree, shares: Mapping[str, float], *, ringed: bool) -> Iterator[Shape]:
    yield from _ground_shapes(at, tree, shares.get("environment"))
    for i, link in enumerate(tree.links):
        below = at.base if link.parent < 0 else None
        if below is not None and not link.slides:
            yield Shape(np.array([below, at.joints[i]]), "floor", width=3.0)
    for i, link in enumerate(tree.links):
        share = shares.get(f"link_{link.body}", 0.0)
        colour = heat(share) if share >= LEAST_SHARE else "floor"
        for end in at.link(i, tree):
            yield Shape(np.array([at.joints[i], end]), colour, width=4.5, site=f"link_{link.body}")
    for i, link in enumerate(tree.links):
        yield from _joint_shapes(at.joints[i], at.axes[i], link.slides, link.joint, shares, ringed=ringed)


def _joint_shapes(
    at: np.ndarray, axis: np.ndarray, slides: bool, joint: str, shares: Mapping[str, float], *, ringed: bool
) -> Iterator[Shape]:
    """A disc and axis for a hinge, a box on its rail for a slide; half rings for drive (left) and sensor (right)."""
    length = float(np.linalg.norm(axis))
    if slides:
        along = axis / length if length > 0.05 else np.array([1.0, 0.0])
        yield Shape(np.array([at - 3.6 * RING[1] * along, at + 3.6 * RING[1] * along]), "muted", width=1.6, dashed=True)
    elif length > 0.2:
        yield Shape(np.array([at - 2.0 * RING[1] * axis, at + 2.0 * RING[1] * axis]), "muted", width=1.2)
    if ringed:
        yield _half_ring(at, -1.0, shares.get(f"actuator_{joint}", 0.0), f"actuator_{joint}")
        yield _half_ring(at, 1.0, shares.get(f"sensor_{joint}", 0.0), f"sensor_{joint}")
    share = shares.get(joint, 0.0)
    fill = heat(share) if share >= LEAST_SHARE else "card"
    if slides:
        across = np.array([-along[1], along[0]])
        corners = [at + 7.5 * (a * along) + 5.0 * (b * across) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        yield Shape(np.array(corners), "ink", fill, 1.6, site=joint)
    else:
        yield Shape(at + JOINT * _arc(0.0, 2.0 * np.pi, 20), "ink", fill, 1.6, site=joint)


def _half_ring(at: np.ndarray, side: float, share: float, site: str) -> Shape:
    """Half a ring around a joint, to the left (-1) or to the right (1)."""
    arc = _arc(-0.42 * np.pi, 0.42 * np.pi, 12) * (side, 1.0)
    fill = heat(share) if share >= LEAST_SHARE else "rule"
    return Shape(np.vstack([at + RING[0] * arc, at + RING[1] * arc[::-1]]), "card", fill, 0.8, site=site)


def _arc(begin: float, end: float, points: int) -> np.ndarray:
    angle = np.linspace(begin, end, points)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _ground_shapes(at: _Layout, tree: Tree, tilt: float | None) -> Iterator[Shape]:
    """A hatched line at the ground's origin."""
    share = tilt or 0.0
    colour = heat(share) if share >= LEAST_SHARE else "muted"
    below = 1.0 if np.mean(at.joints[:, 1]) <= at.base[1] else -1.0  # a robot that hangs has its ground above
    down = np.array([1.0, below])
    yield Shape(at.base + down * [(-22.0, 14.0), (22.0, 14.0)], colour, width=2.2, site="environment")
    for x in np.linspace(-16.0, 20.0, 5):
        yield Shape(at.base + down * [(x, 14.0), (x - 6.0, 21.0)], colour, width=1.2)
    yield Shape(at.base + down * [(0.0, 0.0), (0.0, 14.0)], colour, width=3.0)


def _key(x: float, y: float) -> tuple[list[Shape], list[Text]]:
    """What the signs and colours mean."""
    at = np.array([x + 52.0, y + 12.0])
    shapes = [replace(s, site="") for s in _joint_shapes(at, np.zeros(2), False, "", {}, ringed=True)]
    texts = [Text(at[0] - 16.0, at[1], "drive", "end"), Text(at[0] + 16.0, at[1], "sensor")]
    left, steps = at[0] + 86.0, 40
    for k in range(steps):
        corner = np.array([left + 2.5 * k, at[1]])
        box = corner + np.array([(0.0, -5.0), (2.6, -5.0), (2.6, 5.0), (0.0, 5.0)])
        shapes.append(Shape(box, None, heat(k / (steps - 1.0))))
    texts.append(Text(left + 2.5 * steps + 8.0, at[1], "0 to 100 % of the mismatch"))
    return shapes, texts
