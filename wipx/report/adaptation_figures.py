"""Adaptations as pictures: how searches converge, and how simulated trajectories resemble recorded ones."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wipx.core.adaptation import AdaptationResult
from wipx.report.files import write_whole
from wipx.report.numbers import scale_for, significant
from wipx.report.panels import MUTED, RECORDED, picture, quiet

# Okabe and Ito 2008, a palette that colour-blind people can tell apart
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f3c8d", "#5b6470", "#a05d00")
UNITS = {"x": "m"}


def draw_convergence(runs: Sequence[AdaptationResult], path: Path) -> None:
    """Draw the best loss over evaluations and over time, one colour for each optimizer, as PNG.

    Every search is a faint line, that of the median final loss a strong one. Dotted: 1 % above the best.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    best = min(run.fit.value for run in runs)
    names = sorted(dict.fromkeys(run.optimizer for run in runs))
    for name, colour in zip(names, COLOURS, strict=False):
        own = sorted((run for run in runs if run.optimizer == name), key=lambda run: run.fit.value)
        for rank, run in enumerate(own):
            if run.history is None:
                continue
            typical = rank == (len(own) - 1) // 2
            for axes, course in ((left, run.history.evaluations), (right, run.history.seconds)):
                axes.step(
                    np.maximum(course, 1e-3),
                    run.history.best_loss / best,
                    where="post",
                    color=colour,
                    linewidth=1.8 if typical else 0.7,
                    alpha=1.0 if typical else 0.35,
                    label=name if typical and axes is left else None,
                )
    for axes, title in ((left, "evaluations of one candidate on all loads"), (right, "seconds on one core")):
        quiet(axes)
        axes.axhline(1.01, color=MUTED, linewidth=1.0, linestyle=":")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(title, color=MUTED)
    left.set_ylabel("best loss over the best of all", color=MUTED)
    figure.legend(loc="outside right center", frameon=False)
    write_whole(path, picture(figure, path))


def draw_trajectories(runs: Sequence[AdaptationResult], path: Path, *, classes: int = 4) -> None:
    """Draw each method's mean trajectories beside the recorded ones, one column for each load, as PNG.

    Args:
        runs: One for each method, of one robot.
        path: The file.
        classes: Loads that are shown, spread over the equilibrium pitches; held-out ones first.

    Raises:
        InputError: the file cannot be written.
    """
    shown = _spread([c.name for c in sorted(runs[0].classes, key=lambda c: (not c.held_out, c.equilibrium))], classes)
    columns = runs[0].coordinates
    figure = Figure(figsize=(2.9 * len(shown), 1.2 + 2.2 * len(columns)), layout="constrained")
    grid = figure.subplots(len(columns), len(shown), squeeze=False, sharex=True)
    for j, column in enumerate(columns):
        for i, name in enumerate(shown):
            _draw_class(grid[j, i], runs, name, j, column)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    for axes in grid[-1]:
        axes.set_xlabel("time since the release [s]", color=MUTED)
    write_whole(path, picture(figure, path))


def _draw_class(axes, runs: Sequence[AdaptationResult], name: str, joint: int, column: str) -> None:
    entries = [(run, next(c for c in run.classes if c.name == name)) for run in runs]
    first = entries[0][1]
    unit = UNITS.get(column, "rad")
    scale = scale_for([float(np.abs(first.recorded[:, joint]).max())], unit)
    quiet(axes)
    axes.plot(first.t, scale.factor * first.recorded[:, joint], color=RECORDED, linewidth=4.0, label="recorded")
    for (run, entry), colour in zip(entries, COLOURS, strict=False):
        axes.plot(entry.t, scale.factor * entry.simulated[:, joint], color=colour, linewidth=1.4, label=run.method)
    reach = scale.factor * first.recorded[:, joint]
    margin = 0.35 * float(np.ptp(reach)) + 1e-9
    axes.set_ylim(float(reach.min()) - margin, float(reach.max()) + margin)
    axes.set_ylabel(f"{column} [{scale.unit}]", color=MUTED)
    if joint == 0:
        seen = "held out" if first.held_out else "fitted"
        axes.set_title(f"{name} ({seen}), balances at {significant(first.equilibrium, 2)} rad", loc="left", fontsize=9)


def _spread(names: list[str], count: int) -> list[str]:
    """`count` of the names, evenly spread."""
    if len(names) <= count:
        return names
    return [names[round(i * (len(names) - 1) / (count - 1))] for i in range(count)]
