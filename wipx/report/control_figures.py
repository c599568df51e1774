"""Control under unknown loads as pictures: absolute errors over time, for each load, as the paper draws them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.control_result import ControlResult, ControlTrial
from wipx.report.adaptation_figures import COLOURS as OTHERS
from wipx.report.files import write_whole
from wipx.report.numbers import significant
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, picture, quiet

COLOURS = (NOMINAL, COMPLETED, *OTHERS[2:])  # the baseline comes first, ours second
BROAD, FINE = 3.6, 1.4  # lines


def draw_errors(results: Sequence[ControlResult], path: Path) -> None:
    """Draw distance to the reference and to the balance over time, one column for each load, as PNG.

    Strong lines: mean of the trials. A line ends where the first of its robots was stopped, marked by a cross.

    Args:
        results: One for each controller or method, of one scenario and the same loads.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    loads = list(results[0].loads)
    figure = Figure(figsize=(0.8 + 2.5 * len(loads), 5.0), layout="constrained")
    grid = figure.subplots(2, len(loads), squeeze=False, sharex=True, sharey="row")
    labels = _labels(results)
    for i, load in enumerate(loads):
        for k, (result, label, colour) in enumerate(zip(results, labels, COLOURS, strict=False)):
            width = BROAD if k == 0 and len(results) > 1 else FINE  # others may lie upon the first
            for axes, signal in zip(grid[:, i], ("x", "theta"), strict=True):
                _draw_mean(axes, result.of(load), signal, label, colour, width)
        grid[0, i].set_title(f"balances at {significant(results[0].of(load)[0].pitch, 2)} rad", loc="left", fontsize=9)
        grid[1, i].set_xlabel("time [s]", color=MUTED)
        for axes in grid[:, i]:
            quiet(axes)
            if results[0].begin > 0.0:
                axes.axvline(results[0].begin, color=MUTED, linewidth=0.8, linestyle=":")
    grid[0, 0].set_ylabel("|x - x_ref| [m]", color=MUTED)
    grid[1, 0].set_ylabel("|pitch - balance| [rad]", color=MUTED)
    handles, names = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=len(names), frameon=False)
    write_whole(path, picture(figure, path))


def _labels(results: Sequence[ControlResult]) -> list[str]:
    """What differs between the results."""
    if len({result.method for result in results}) > 1:
        return [f"{result.controller}, {result.method}" for result in results]
    return [result.controller for result in results]


def _draw_mean(axes: Axes, trials: Sequence[ControlTrial], signal: str, label: str, colour: str, width: float) -> None:
    t = trials[0].course.t
    errors = np.stack([_errors(trial, signal) for trial in trials])
    end = min((trial.stopped for trial in trials if trial.stopped is not None), default=t[-1])
    moving = t <= end
    mean = errors.mean(axis=0)[moving]
    for error in errors:
        axes.plot(t[moving], error[moving], color=colour, linewidth=0.5, alpha=0.3)
    axes.plot(t[moving], mean, color=colour, linewidth=width, label=label)
    if end < t[-1]:
        axes.plot(t[moving][-1:], mean[-1:], "x", color=colour, markersize=7, markeredgewidth=2.0)


def _errors(trial: ControlTrial, signal: str) -> np.ndarray:
    """Absolute errors of x or theta, shape (K,)."""
    course = trial.course
    return np.abs(course.x - course.x_ref if signal == "x" else course.theta - course.balance)
