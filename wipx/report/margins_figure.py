"""Controllers side by side: their stability margins, and the loads from which the robot recovers."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from wipx.core.margins import Margins, Recovery, RecoveryRegion
from wipx.report.files import write_whole
from wipx.report.numbers import compact, significant
from wipx.report.panels import COMPLETED, GRID, MUTED, NOMINAL, picture, quiet

LONGEST_BAR = 100.0  # gain factors beyond it are drawn to here
COLUMNS = 4  # at most


def draw_margins(margins: Mapping[str, Margins], path: Path) -> None:
    """Draw gain, phase and delay margins of each controller as bars, as PNG.

    Args:
        margins: By the controller's name.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    found = list(margins.values())
    names = [f"{name}\n(inner loop)" if m.inner else name for name, m in margins.items()]
    figure = Figure(figsize=(10.5, 1.4 + 0.38 * len(names)), layout="constrained")
    gain, phase, delay = figure.subplots(1, 3, sharey=True)
    rows = np.arange(len(names))[::-1]
    low = np.array([max(m.gain_low, 1.0 / LONGEST_BAR) for m in found])
    high = np.array([min(m.gain_high, LONGEST_BAR) for m in found])
    gain.barh(rows, high - low, left=low, color=COMPLETED, height=0.6)
    gain.axvline(1.0, color=NOMINAL, linewidth=1.2)
    gain.set_xscale("log")
    for row, end, m in zip(rows, high, found, strict=True):
        text = f"{_factor(m.gain_low)} to {_factor(m.gain_high)}"
        gain.annotate(text, (end, row), (4, 0), textcoords="offset points", va="center", fontsize=9)
    gain.set_xlim(0.6 * float(low.min()), 12.0 * float(high.max()))
    gain.xaxis.set_major_formatter(FuncFormatter(lambda factor, _: f"{factor:g}"))
    gain.tick_params(which="minor", bottom=False)
    _bars(phase, rows, np.rad2deg([m.phase for m in found]))
    _bars(delay, rows, np.array([1e3 * m.delay for m in found]))
    for axes, title in ((gain, "gain margin: factors"), (phase, "phase margin [deg]"), (delay, "delay margin [ms]")):
        quiet(axes)
        axes.grid(visible=False, axis="y")
        axes.set_title(title, loc="left", fontsize=10, color=MUTED)
    gain.set_yticks(rows, names)
    figure.suptitle("Margins at the command; filter, limits and dry friction left out", x=0.01, ha="left", fontsize=10)
    write_whole(path, picture(figure, path))


def draw_recovery(region: RecoveryRegion, path: Path) -> None:
    """Draw for each controller the loads from which the robot recovers, and where it comes to stand, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    lines = -(-len(region.controllers) // COLUMNS)
    columns = -(-len(region.controllers) // lines)
    figure = Figure(figsize=(1.2 + 2.6 * columns, 0.8 + 2.3 * lines), layout="constrained")
    grid = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    image = None
    for axes, (name, recovery) in zip(grid.flat, region.controllers.items(), strict=False):
        image = _draw_region(axes, region, recovery)
        axes.set_title(f"{name}: {round(100 * recovery.share)} %", loc="left", fontsize=10, parse_math=False)
    for axes in grid.flat[len(region.controllers) :]:
        axes.set_axis_off()
    for axes in grid.flat[max(0, len(region.controllers) - columns) : len(region.controllers)]:
        axes.set_xlabel("pitch of balance [rad]", color=MUTED)
        axes.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel("load [kg]", color=MUTED)
    if image is not None:
        figure.colorbar(image, ax=grid, label="standing distance from x = 0 [m]", shrink=0.8)
    figure.suptitle(
        f"Recovered loads, on a rail of +-{compact(region.rail)} m; crosses: stopped at its end, fallen, "
        f"or not calm after {compact(region.duration)} s",
        x=0.01,
        ha="left",
        fontsize=10,
    )
    write_whole(path, picture(figure, path))


def _draw_region(axes: Axes, region: RecoveryRegion, recovery: Recovery):
    """One controller's grid of loads; returns what the colours mean."""
    quiet(axes)
    axes.set_facecolor(GRID)
    axes.grid(visible=False)
    edges = (_edges(region.pitches), _edges(region.masses))
    shown = np.ma.masked_where(~recovery.recovered, recovery.standing)
    image = axes.pcolormesh(*edges, shown, cmap="viridis_r", vmin=0.0, vmax=region.rail)
    lost = np.argwhere(~recovery.recovered)
    axes.set_yticks(region.masses)
    axes.plot(region.pitches[lost[:, 1]], region.masses[lost[:, 0]], "x", color=NOMINAL, markersize=5)
    return image


def _edges(centres: np.ndarray) -> np.ndarray:
    """Borders of cells around ascending centres, shape (centres + 1,)."""
    if len(centres) == 1:
        return centres[0] + np.array([-0.5, 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2.0 * centres[0] - middle[0]], middle, [2.0 * centres[-1] - middle[-1]]])


def _bars(axes: Axes, rows: np.ndarray, sizes: np.ndarray) -> None:
    """Horizontal bars with their sizes beside them; infinite ones are as long as the longest."""
    longest = float(np.max(sizes[np.isfinite(sizes)], initial=1.0))
    bars = axes.barh(rows, np.minimum(sizes, longest), color=COMPLETED, height=0.6)
    axes.bar_label(
        bars, [significant(float(size)) if np.isfinite(size) else "any" for size in sizes], padding=4, fontsize=9
    )
    axes.margins(x=0.2)
    axes.locator_params(axis="x", nbins=5)


def _factor(gain: float) -> str:
    return significant(gain, 2) if np.isfinite(gain) else "\N{INFINITY}"
