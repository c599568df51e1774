"""Estimated sizes of effects over groups of runs of one machine, each with its interval."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.sizes import SizeSeries
from wipx.report.files import write_whole
from wipx.report.numbers import scale_for
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, png, quiet

COLUMNS = 3  # panels of a rig, at most
ROOM = 0.3  # of the range of the values, above and below; intervals that are wider are cut off


def draw_consistency(series: Sequence[SizeSeries], path: Path) -> None:
    """Draw a row of panels for each rig, as PNG; an interval is a bar, the authors' figure a line.

    Args:
        series: The most important ones of a rig first; of one rig, the first `COLUMNS` are drawn.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    rows: dict[str, list[SizeSeries]] = {}
    for one in series:
        rows.setdefault(one.rig, []).append(one)
    figure = Figure(figsize=(10.5, 0.7 + 1.8 * max(len(rows), 1)), layout="constrained")
    grid = figure.subplots(max(len(rows), 1), COLUMNS, squeeze=False)
    for axes in grid.flat:
        axes.set_visible(False)
    for line, (rig, ones) in zip(grid, rows.items(), strict=False):
        for axes, one in zip(line, ones, strict=False):
            axes.set_visible(True)
            _draw(axes, one)
        line[0].set_ylabel(rig.replace(" (", "\n("), fontsize=8, color=MUTED)
    title = "Sizes from disjoint groups of runs with 95 % intervals; dotted lines separate the ways of splitting"
    figure.suptitle(f"{title}, orange: the authors' figure", x=0.01, ha="left", fontsize=10)
    write_whole(path, png(figure))


def _draw(axes: Axes, series: SizeSeries) -> None:
    sizes = series.sizes
    values = np.array([size.value for size in sizes])
    scale = scale_for(np.abs(values), sizes[0].unit)
    below = np.array([max(size.value - size.low, 0.0) for size in sizes])
    above = np.array([max(size.high - size.value, 0.0) for size in sizes])
    at = np.arange(len(sizes))
    quiet(axes)
    ends = scale.factor * np.nan_to_num(np.array([below, above]))
    axes.errorbar(at, scale.factor * values, yerr=ends, fmt="o", color=COMPLETED, markersize=3.5, linewidth=1.2)
    if series.published is not None:
        axes.axhline(scale.factor * series.published, color=NOMINAL, linewidth=1.2)
    for place in np.flatnonzero([a != b for a, b in zip(series.ways, series.ways[1:], strict=False)]):
        axes.axvline(float(place) + 0.5, color=MUTED, linewidth=0.8, linestyle=":")
    shown = [*values, *([] if series.published is None else [series.published])]
    spread = max(max(shown) - min(shown), float(np.median(below + above)), 1e-12)
    axes.set_ylim(
        scale.factor * (min(shown) - ROOM * spread - np.median(below)),
        scale.factor * (max(shown) + ROOM * spread + np.median(above)),
    )
    axes.set_xlim(-0.6, max(len(sizes) - 0.4, 0.6))
    axes.set_xticks([])
    axes.grid(visible=False, axis="x")
    unit = "" if scale.unit == "1" else f" [{scale.unit}]"
    axes.set_title(f"{sizes[0].effect} {sizes[0].symbol}{unit}", loc="left", fontsize=8, parse_math=False)
