"""Estimates of the equilibrium pitch as pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wipx.core.estimation import EstimationResult, Judged
from wipx.report.adaptation_figures import COLOURS
from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, MUTED, picture, quiet

LARGEST = 5  # results beside each other


def draw_estimates(results: Sequence[EstimationResult], path: Path) -> None:
    """Draw estimated over true pitch with 90 % intervals, simulated robots above, recorded ones below, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    shown = list(results)[:LARGEST]
    figure = Figure(figsize=(0.6 + 3.2 * len(shown), 6.4), layout="constrained")
    grid = figure.subplots(2, len(shown), squeeze=False, sharex=True, sharey=True)
    reach = 1.1 * max(float(np.abs(j.pitch).max()) for r in shown for j in (r.simulated, r.recorded))
    for i, result in enumerate(shown):
        title = f"{result.estimator}, {result.length} samples, {result.method}"
        _draw_judged(grid[0, i], result.simulated, f"{title}\nsimulated", reach)
        _draw_judged(grid[1, i], result.recorded, f"{result.target} trials", reach)
        grid[1, i].set_xlabel("pitch at which the robot balances [rad]", color=MUTED)
    for axes in grid[:, 0]:
        axes.set_ylabel("estimate [rad]", color=MUTED)
    write_whole(path, picture(figure, path))


def draw_lengths(results: Sequence[EstimationResult], path: Path) -> None:
    """Draw the error over the length of the window and over the time of an estimate, one colour for each estimator.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(10.5, 4.0), layout="constrained")
    lengths, latency = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    names = list(dict.fromkeys(result.estimator for result in results))
    for name, colour in zip(names, COLOURS, strict=False):
        own = [result for result in results if result.estimator == name]
        at = sorted({result.length for result in own})
        for kind, style in (("recorded", "-"), ("simulated", ":")):
            errors = [np.median([getattr(r, kind).rmse for r in own if r.length == length]) for length in at]
            label = name if kind == "recorded" else None
            seconds = np.array(at) * own[0].period
            lengths.plot(seconds, 1e3 * np.array(errors), style, color=colour, marker="o", markersize=4, label=label)
        longest = [result for result in own if result.length == at[-1]]
        time, error = (float(np.median(v)) for v in ([r.latency for r in longest], [r.recorded.rmse for r in longest]))
        latency.plot(1e3 * time, 1e3 * error, "o", color=colour)
        latency.annotate(f" {name}", (1e3 * time, 1e3 * error), color=colour, fontsize=8)
    for axes, title in ((lengths, "window [s]; dotted: simulated robots"), (latency, "time of one estimate [ms]")):
        quiet(axes)
        axes.set_yscale("log")
        axes.set_xlabel(title, color=MUTED)
    latency.set_xscale("log")
    lengths.set_ylabel("RMSE of the equilibrium pitch [mrad]", color=MUTED)
    lengths.legend(frameon=False, fontsize=8)
    write_whole(path, picture(figure, path))


def _draw_judged(axes, judged: Judged, title: str, reach: float) -> None:
    quiet(axes)
    axes.plot([-reach, reach], [-reach, reach], color=MUTED, linewidth=1.0)
    span = np.abs(np.stack([judged.estimate - judged.low, judged.high - judged.estimate]))
    axes.errorbar(
        judged.pitch,
        judged.estimate,
        span,
        fmt="o",
        color=COMPLETED,
        ecolor=COMPLETED,
        markersize=3,
        alpha=0.6,
        elinewidth=0.7,
    )
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_title(f"{title}: RMSE {1e3 * judged.rmse:.2g} mrad", loc="left", fontsize=9)
