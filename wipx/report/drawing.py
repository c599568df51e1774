"""Drawings of lines, polygons and texts in pixels, y downwards: as SVG for a page, or with matplotlib."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.axes import Axes

# Names of colours of a page, with those that they have in its light scheme (templates/page.css).
LIGHT = {"ink": "#1a1f26", "muted": "#5b6470", "rule": "#c8cdd3", "card": "#ffffff", "floor": "#8a939e"}


@dataclass(frozen=True)
class Shape:
    """A line or a polygon.

    Attributes:
        points: Shape (n, 2).
        stroke: Colour of its line: a name of the page's colours (keys of `LIGHT`) or "#rrggbb"; None for no line.
        fill: Colour of its area, likewise; None for a line.
        width: Of its line.
        dashed: Whether its line is.
        site: Site that it stands for; empty for none.
    """

    points: np.ndarray
    stroke: str | None = None
    fill: str | None = None
    width: float = 1.0
    dashed: bool = False
    site: str = ""


@dataclass(frozen=True)
class Text:
    """A text whose middle line runs through (x, y); `anchor` is start, middle or end of it."""

    x: float
    y: float
    text: str
    anchor: str = "start"
    strong: bool = False
    site: str = ""


@dataclass(frozen=True)
class Drawing:
    """Shapes and the texts over them, in pixels, y downwards.

    Attributes:
        width: Of the whole.
        height: Of the whole.
        shapes: In the order in which they are drawn.
        texts: Drawn over them.
    """

    width: float
    height: float
    shapes: tuple[Shape, ...]
    texts: tuple[Text, ...]


def svg(drawing: Drawing, name: str = "Picture of the robot") -> "Markup":
    """The drawing as an SVG element; parts that stand for a site have it in `data-site`, and a tooltip."""
    from markupsafe import Markup

    head = '<svg class="robot" viewBox="0 0 {w:.0f} {h:.0f}" width="{w:.0f}" role="img" aria-label="{name}">'
    parts = [Markup(head).format(w=drawing.width, h=drawing.height, name=name)]
    for shape in drawing.shapes:
        parts.append(
            Markup(
                '<{kind} points="{points}" style="{style}" data-site="{site}"><title>{site}</title></{kind}>'
            ).format(
                kind="polygon" if shape.fill else "polyline",
                points=" ".join(f"{x:.1f},{y:.1f}" for x, y in shape.points),
                style=f"fill:{_css(shape.fill)};stroke:{_css(shape.stroke)};stroke-width:{shape.width:g};"
                f"stroke-linecap:round;stroke-linejoin:round;stroke-dasharray:{'5 4' if shape.dashed else 'none'}",
                site=shape.site,
            )
        )
    for text in drawing.texts:
        parts.append(
            Markup(
                '<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="12.5" dy="0.35em" style="{style}" '
                'data-site="{site}">{text}</text>'
            ).format(
                x=text.x,
                y=text.y,
                anchor=text.anchor,
                style=f"fill:{_css('ink' if text.strong else 'muted')};font-weight:{600 if text.strong else 400}",
                site=text.site,
                text=text.text,
            )
        )
    return Markup("").join([*parts, Markup("</svg>")])


def draw(axes: "Axes", drawing: Drawing) -> None:
    """Draw the drawing into axes of matplotlib; its letters grow with the axes' width."""
    from matplotlib.patches import Polygon

    axes.set_axis_off()
    axes.set_xlim(0.0, drawing.width)
    axes.set_ylim(drawing.height, 0.0)
    axes.set_aspect("equal")
    extent = axes.get_window_extent()
    scale = min(extent.width / drawing.width, extent.height / drawing.height) * 72.0 / axes.figure.dpi
    for shape in drawing.shapes:
        line = {"linewidth": scale * shape.width, "linestyle": (0, (4, 3)) if shape.dashed else "-"}
        if shape.fill is None:
            colour = _hex(shape.stroke)
            axes.plot(*shape.points.T, color=colour, solid_capstyle="round", dash_capstyle="round", **line)
        else:
            axes.add_patch(
                Polygon(shape.points, facecolor=_hex(shape.fill), edgecolor=_hex(shape.stroke), zorder=3, **line)
            )
    sides = {"start": "left", "middle": "center", "end": "right"}
    for text in drawing.texts:
        axes.text(
            text.x,
            text.y,
            text.text,
            ha=sides[text.anchor],
            va="center_baseline",
            fontsize=12.0 * scale,
            color=LIGHT["ink" if text.strong else "muted"],
            fontweight="bold" if text.strong else "normal",
            parse_math=False,
            zorder=4,
        )


def _css(colour: str | None) -> str:
    if colour is None:
        return "none"
    return f"var(--{colour}, {LIGHT[colour]})" if colour in LIGHT else colour


def _hex(colour: str | None) -> str:
    return "none" if colour is None else LIGHT.get(colour, colour)
