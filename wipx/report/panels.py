"""The panels of which pictures consist: signals, errors, and their common style."""

import io
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.results import Trace
from wipx.report.charts import wants_logarithm
from wipx.report.numbers import scale_for, significant
from wipx.report.outcome import ModelComparison, judged_fit
from wipx.report.traces import between, break_at_restarts, decimate, improvement, prediction_error

RECORDED, NOMINAL, COMPLETED, FLOOR = "#b9c0c8", "#d55e00", "#0072b2", "#8a939e"  # Okabe and Ito 2008
MUTED, GRID = "#5b6470", "#e3e7eb"
SHOWN_WINDOWS = 6
DPI = 200
MOST_ROWS = 4000


def representative_stretch(result: ModelComparison) -> Trace | None:
    """The stretch of a recording that pictures show; None where nothing was recorded.

    The recording is the one of median improvement among the held-out ones (among all, where none was
    held out); of it, the `SHOWN_WINDOWS` windows in a row whose improvement exceeds that of three
    quarters of such stretches.
    """
    held_out = [trace for trace in result.traces if trace.held_out]
    trace = _quantile(held_out or list(result.traces), 0.5)
    if trace is None:
        return None
    length = SHOWN_WINDOWS * judged_fit(result).horizon
    begins = [begin for begin in trace.starts if begin + length <= trace.t[-1] + 1e-9]
    stretch = _quantile([between(trace, begin, begin + length) for begin in begins], 0.75)
    return break_at_restarts(decimate(stretch or trace, MOST_ROWS))


def _quantile(traces: list[Trace], share: float) -> Trace | None:
    """The trace that improves more than that share of them; None where none improves or worsens measurably."""
    gains = np.array([improvement(trace) for trace in traces])
    known = np.flatnonzero(np.isfinite(gains))
    if len(known) == 0:
        return traces[0] if traces else None
    ranked = known[np.argsort(gains[known])]
    return traces[ranked[round(share * (len(ranked) - 1))]]


def draw_signal(axes: Axes, trace: Trace, column: str, unit: str) -> None:
    """Draw one column of a trace, recorded and predicted, with its errors in the title."""
    recorded = trace.recorded[column]
    finite = recorded[np.isfinite(recorded)]
    scale = scale_for([np.abs(finite).max(initial=0.0)], unit)
    quiet(axes)
    axes.plot(trace.t, scale.factor * recorded, color=RECORDED, linewidth=4.0, label="recorded")
    axes.plot(trace.t, scale.factor * trace.nominal[column], "--", color=NOMINAL, linewidth=1.4, label="nominal model")
    axes.plot(trace.t, scale.factor * trace.completed[column], color=COMPLETED, linewidth=1.4, label="completed model")
    axes.set_xlim(trace.t[0], trace.t[-1])
    axes.grid(visible=False, axis="x")
    for start in trace.starts[(trace.starts > trace.t[0]) & (trace.starts < trace.t[-1])]:
        axes.axvline(start, color=GRID, linewidth=0.8, zorder=0)
    if len(finite) and np.ptp(finite) > 0.0:
        low, high, span = finite.min(), finite.max(), np.ptp(finite)
        bottom, top = axes.get_ylim()  # a nominal model that runs away must not flatten what was recorded
        axes.set_ylim(max(bottom, scale.factor * (low - 0.75 * span)), min(top, scale.factor * (high + 0.75 * span)))
    title = f"{with_unit(column, scale.unit)}   error here {_change(trace, column, unit)}"
    axes.set_title(title, loc="left", fontsize=10, color=MUTED, parse_math=False)


def _change(trace: Trace, column: str, unit: str) -> str:
    """Errors of both models in one trace, e.g. "21.0 to 2.10 mm" with an arrow."""
    nominal = prediction_error(trace, trace.nominal)[column]
    completed = prediction_error(trace, trace.completed)[column]
    scale = scale_for([nominal, completed], unit)
    before, after = significant(scale.factor * nominal), significant(scale.factor * completed)
    return f"{before} \N{RIGHTWARDS ARROW} {after} {scale.unit}"


def draw_errors(axes: Axes, heights: tuple[float, float, float], title: str, *, room: float = 0.18) -> None:
    """Draw the errors of nominal model, completed model and noise floor as bars.

    Args:
        axes: Where.
        heights: The errors, in the unit of the title.
        title: Above the bars.
        room: Above the highest bar, for its number, as a share of its height.
    """
    quiet(axes)
    finite = [height if np.isfinite(height) else 0.0 for height in heights]
    bars = axes.bar(("nominal", "completed", "noise\nfloor"), finite, color=(NOMINAL, COMPLETED, FLOOR), width=0.72)
    axes.bar_label(bars, [significant(height) for height in heights], padding=2, fontsize=9)
    if wants_logarithm(finite):
        axes.set_yscale("log")
        title = f"{title}, log scale"
    axes.margins(y=room)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.tick_params(left=False, labelleft=False, which="both")
    axes.set_title(title, loc="left", fontsize=10, color=MUTED, parse_math=False)


def quiet(axes: Axes) -> None:
    """Leave few lines, so that the curves stand out."""
    axes.grid(color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#c8cdd3")
    axes.tick_params(color="#c8cdd3", labelsize=9)


def with_unit(name: str, unit: str) -> str:
    """A label such as "x [mm]"."""
    return f"{name} [{unit}]" if unit else name


def png(figure: Figure) -> bytes:
    """The figure as the content of a PNG file."""
    return _content(figure, "png")


def picture(figure: Figure, path: Path) -> bytes:
    """The figure as the content of a file of the path's kind: .png or .pdf."""
    return _content(figure, path.suffix.removeprefix("."))


def _content(figure: Figure, kind: str) -> bytes:
    image = io.BytesIO()
    figure.savefig(image, format=kind, dpi=DPI, facecolor="white")
    return image.getvalue()
