"""A log as one picture: its signals over time, with the recordings that they give."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.log_preview import ColumnSummary, LogPreview, Trace
from wipx.report.files import write_whole
from wipx.report.panels import GRID, MUTED, png, quiet

WIDTH = 10.0  # inches
KEPT = "#e8f1f8"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999")  # Okabe and Ito 2008
MOST_NAMES = 8  # of signals in a legend
KINDS = {  # title of a panel by what the names of its columns end with; the first that fits counts
    "reported force": lambda name: name.endswith("_measured"),
    "rate": lambda name: name.endswith("_dot"),
    "reference": lambda name: name.endswith("_ref"),
    "command": lambda name: name == "u" or name.startswith(("u_", "u1", "u2")),
    "position": lambda name: True,
}
LABEL = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}  # legible on top of curves


def draw_preview(preview: LogPreview, path: Path) -> None:
    """Draw every column over the whole log, the recordings shaded, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    panels = _panels(preview)
    figure = Figure(figsize=(WIDTH, 1.1 + 1.9 * max(len(panels), 1)), layout="constrained")
    axes = figure.subplots(max(len(panels), 1), 1, sharex=True, squeeze=False)[:, 0]
    for (kind, columns), one in zip(panels.items(), axes, strict=False):
        _draw(one, kind, columns, preview)
    _name_recordings(axes[0], preview)
    axes[-1].set_xlabel("time since the log's beginning [s]; shaded: recordings", color=MUTED)
    title = f"{Path(preview.source).name}: {len(preview.recordings)} recordings"
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, parse_math=False)
    write_whole(path, png(figure))


def _panels(preview: LogPreview) -> dict[str, list[ColumnSummary]]:
    """Columns that share a panel: of one kind and unit."""
    order = ("position", "rate", "command", "reported force", "reference")
    panels: dict[str, list[ColumnSummary]] = {}
    for column in preview.columns:
        kind = next(kind for kind, fits in KINDS.items() if fits(column.name))
        panels.setdefault(f"{kind} [{column.unit or 'as logged'}]", []).append(column)
    return dict(sorted(panels.items(), key=lambda item: order.index(item[0].partition(" [")[0])))


def _draw(axes: Axes, title: str, columns: list[ColumnSummary], preview: LogPreview) -> None:
    quiet(axes)
    for piece in preview.recordings:
        offset = preview.offsets[piece.episode]
        axes.axvspan(offset + piece.begin, offset + piece.end, color=KEPT, zorder=0, linewidth=0)
    for number, column in enumerate(columns):
        trace, colour = preview.traces[column.name], _colour(column.name, preview)
        label = column.name if number < MOST_NAMES else None
        t, low, high = _broken(trace)
        axes.plot(t, 0.5 * (low + high), color=colour, linewidth=0.9, label=label)
        if np.any(high > low):
            axes.fill_between(t, low, high, color=colour, alpha=0.35, linewidth=0)
    axes.grid(visible=False, axis="x")
    axes.set_title(title, loc="left", fontsize=10, color=MUTED, parse_math=False)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    axes.axhline(0.0, color=GRID, linewidth=0.8, zorder=0)


def _colour(name: str, preview: LogPreview) -> str:
    """One colour for all that belongs to a joint."""
    joints = list(dict.fromkeys(_joint(column.name) for column in preview.columns))
    return COLOURS[joints.index(_joint(name)) % len(COLOURS)]


def _joint(name: str) -> str:
    return name.removesuffix("_measured").removesuffix("_ref").removesuffix("_dot").removeprefix("u_")


def _broken(trace: Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, lowest and highest values, interrupted where the log is."""
    steps = np.diff(trace.t)
    after = np.flatnonzero(steps > 10.0 * np.median(steps)) + 1 if len(steps) else np.zeros(0, dtype=int)
    t = np.insert(trace.t, after, trace.t[after - 1])
    return t, np.insert(trace.low, after, np.nan), np.insert(trace.high, after, np.nan)


def _name_recordings(axes: Axes, preview: LogPreview) -> None:
    if len(preview.recordings) > 20:
        return
    for piece in preview.recordings:
        middle = preview.offsets[piece.episode] + 0.5 * (piece.begin + piece.end)
        place = axes.get_xaxis_transform()
        axes.text(middle, 0.98, piece.name, ha="center", va="top", fontsize=7, transform=place, bbox=LABEL)
