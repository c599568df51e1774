"""How well the loop of a trial kept time, as a picture."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wipx.core.loop_quality import LoopQuality
from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, png, quiet

BINS = 50
SMALLEST = 1e-3  # [ms] smaller ones are drawn there


def draw_loop_quality(quality: LoopQuality, title: str, path: Path) -> None:
    """Draw histograms of period error and ages, and where replies and steps are missing, as PNG.

    Args:
        quality: Of one trial.
        title: Of the picture.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    rows = figure.subplot_mosaic([["period", "imu", "motor"], ["course", "course", "course"]], height_ratios=(1.4, 1.0))
    summary = quality.summary()
    listed = (
        ("period", "period_error", np.abs(quality.period_errors), "error of the period"),
        ("imu", "imu_age", quality.imu_ages, "age of the IMU's sample"),
        ("motor", "motor_age", quality.motor_ages, "age of the motor's answer"),
    )
    for panel, name, values, label in listed:
        axes = rows[panel]
        quiet(axes)
        shown = np.maximum(1e3 * values, SMALLEST)
        edges = np.geomspace(SMALLEST, max(2.0 * shown.max(initial=SMALLEST), 1.0), BINS)
        axes.hist(shown, bins=edges.tolist(), color=COMPLETED)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(f"{label} [ms]", color=MUTED)
        shares = summary.get(name, {})
        for value in shares.values():
            axes.axvline(max(1e3 * value, SMALLEST), color=NOMINAL, linewidth=0.9)
        said = ", ".join(f"{1e3 * value:.2g} ({share.removeprefix('p')} %)" for share, value in shares.items())
        axes.set_title(said, loc="left", fontsize=9, color=NOMINAL)
    rows["period"].set_ylabel("steps", color=MUTED)
    _draw_course(rows["course"], quality)
    write_whole(path, png(figure))


def _draw_course(axes: Axes, quality: LoopQuality) -> None:
    """Periods over time; steps that were skipped and lost replies are marked."""
    quiet(axes)
    periods = quality.period + quality.period_errors
    axes.plot(np.cumsum(periods), 1e3 * periods, color=COMPLETED, linewidth=0.8)
    late = [overrun.t for overrun in quality.overruns]
    axes.plot(late, np.zeros(len(late)), "|", color=NOMINAL, markersize=12, markeredgewidth=0.7, clip_on=False)
    axes.plot(quality.lost_replies, np.zeros(len(quality.lost_replies)), "x", color=NOMINAL, clip_on=False)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("time [s]", color=MUTED)
    axes.set_ylabel("period [ms]", color=MUTED)
    said = f"{quality.skipped} steps skipped (ticks), {len(quality.lost_replies)} replies lost (crosses)"
    axes.set_title(said, loc="left", fontsize=9, color=MUTED)
