"""Predictions of an exported robot as a picture: wipx, the file alone, the file with its runtime, and the recording."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.export_result import FILE, RUNTIME, WIPX, ExportErrors, WaysTrace
from wipx.report.files import write_whole
from wipx.report.numbers import scale_for
from wipx.report.panels import COMPLETED, GRID, MUTED, NOMINAL, RECORDED, png, quiet, with_unit

WIDTH = 9.0  # inches
SHOWN_WINDOWS = 6
STYLES = {
    WIPX: ("wipx", COMPLETED, "-", 2.6),
    FILE: ("file alone", NOMINAL, "--", 1.4),
    RUNTIME: ("file with runtime", "#009e73", ":", 1.8),
}


def draw_export(errors: ExportErrors, units: dict[str, str], title: str, path: Path) -> None:
    """Draw recorded against predicted signals and the errors of every way of simulating, as PNG.

    The stretch of half a dozen predictions is the one in which the file alone errs most.

    Args:
        errors: Of all ways.
        units: SI unit by column.
        title: Of the recordings.
        path: Of the picture.

    Raises:
        InputError: the file cannot be written.
    """
    columns = list(units)
    figure = Figure(figsize=(WIDTH, 1.0 + 1.9 * len(columns)), layout="constrained")
    grid = figure.add_gridspec(len(columns), 2, width_ratios=(3.0, 1.0))
    trace, begin, end = _telling_stretch(errors)
    for row, column in enumerate(columns):
        signal, bars = figure.add_subplot(grid[row, 0]), figure.add_subplot(grid[row, 1])
        _draw_signal(signal, trace, column, units[column], begin, end)
        _draw_errors(bars, errors, column, units[column])
        signal.tick_params(labelbottom=row == len(columns) - 1)
        bars.tick_params(labelbottom=row == len(columns) - 1)
        if row == 0:
            signal.legend(loc="lower left", bbox_to_anchor=(0.0, 1.15), ncols=4, frameon=False, borderaxespad=0.0)
    figure.axes[-2].set_xlabel("time [s]; predictions restart at every vertical line", color=MUTED)
    figure.suptitle(f"{title}: {trace.name}", x=0.01, ha="left", fontsize=11, parse_math=False)
    write_whole(path, png(figure))


def _telling_stretch(errors: ExportErrors) -> tuple[WaysTrace, float, float]:
    """The recording and the stretch of it in which the file alone is furthest from wipx."""
    best, found = -1.0, (errors.traces[0], float(errors.traces[0].t[0]), float(errors.traces[0].t[-1]))
    for trace in errors.traces:
        for i, begin in enumerate(trace.starts):
            last = trace.starts[min(i + SHOWN_WINDOWS, len(trace.starts)) - 1] + errors.horizon
            rows = (trace.t >= begin) & (trace.t < last)
            apart = sum(
                float(np.nansum((trace.predicted[FILE][c][rows] - trace.predicted[WIPX][c][rows]) ** 2))
                / max(float(np.nanvar(trace.recorded[c])), 1e-18)
                for c in trace.recorded
            )
            if apart > best:
                best, found = apart, (trace, float(begin), float(last))
    return found


def _draw_signal(axes: Axes, trace: WaysTrace, column: str, unit: str, begin: float, end: float) -> None:
    rows = (trace.t >= begin) & (trace.t < end)
    t, recorded = trace.t[rows], trace.recorded[column][rows]
    scale = scale_for([float(np.abs(recorded).max(initial=0.0))], unit)
    quiet(axes)
    axes.plot(t, scale.factor * recorded, color=RECORDED, linewidth=5.0, label="recorded")
    starts = trace.starts[(trace.starts > begin) & (trace.starts < end)]
    breaks = np.searchsorted(t, starts)
    for way, values in trace.predicted.items():
        label, color, style, width = STYLES[way]
        broken = np.insert(scale.factor * values[column][rows], breaks, np.nan)
        axes.plot(np.insert(t, breaks, starts), broken, style, color=color, linewidth=width, label=label)
    for start in starts:
        axes.axvline(start, color=GRID, linewidth=0.8, zorder=0)
    span = float(np.ptp(recorded)) if len(recorded) else 0.0
    if span:
        middle = scale.factor * 0.5 * float(recorded.max() + recorded.min())
        axes.set_ylim(middle - 0.9 * scale.factor * span, middle + 0.9 * scale.factor * span)
    axes.set_xlim(begin, end)
    axes.grid(visible=False, axis="x")
    axes.set_title(with_unit(column, scale.unit), loc="left", fontsize=10, color=MUTED, parse_math=False)


def _draw_errors(axes: Axes, errors: ExportErrors, column: str, unit: str) -> None:
    values = {way: rms[column] for way, rms in errors.rms.items()}
    scale = scale_for(values.values(), unit)
    quiet(axes)
    places = range(len(values))
    heights = [scale.factor * value for value in values.values()]
    axes.bar(places, heights, color=[STYLES[way][1] for way in values], width=0.6)
    axes.axhline(scale.factor * errors.noise_floor[column], color=MUTED, linewidth=1.0, linestyle=":")
    axes.set_xticks(list(places), [STYLES[way][0].replace(" ", "\n") for way in values], fontsize=8)
    axes.set_title(f"rms error [{scale.unit}], dotted: noise", loc="left", fontsize=9, color=MUTED, parse_math=False)
