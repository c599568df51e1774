"""Two robots under the same load beside each other, as a moving picture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from wipx.core.control_result import ControlResult, ControlTrial
from wipx.core.load import Load
from wipx.report.panels import COMPLETED, MUTED, NOMINAL

PICTURES = 10  # per second; a GIF counts time in hundredths of a second
LONGEST = 8.0  # [s]
TALLEST = 0.75  # [m] length of the body as it is drawn
TITLE = 1.05  # [m] above the rail, where no robot reaches
MARGIN = 0.35  # [m] of the picture beyond the rail's ends
DPI = 80


def animate(results: Sequence[ControlResult], load: str, path: Path) -> None:
    """Write the first trial with a load under each controller, one above the other, as GIF.

    Args:
        results: Of one scenario, drawn from above to below.
        load: Name of the load.
        path: The file.

    Raises:
        OSError: the file cannot be written.
    """
    figure = Figure(figsize=(9.0, 2.4 * len(results)), dpi=DPI, layout="constrained")
    panels = figure.subplots(len(results), 1, squeeze=False)[:, 0]
    colours = (NOMINAL, *(COMPLETED,) * len(results))
    robots = [
        _Robot(axes, result, result.of(load)[0], result.loads[load], colour)
        for axes, result, colour in zip(panels, results, colours, strict=False)
    ]
    t = robots[0].trial.course.t
    shown = np.searchsorted(t, np.arange(0.0, min(LONGEST, t[-1]), 1.0 / PICTURES) - 1e-9)
    film = FuncAnimation(figure, lambda i: [part for r in robots for part in r.move(i)], frames=shown.tolist())
    film.save(path, writer=PillowWriter(fps=PICTURES), dpi=DPI)


class _Robot:
    """Rail, wheel, body and load in a panel.

    Attributes:
        trial: What it does.
    """

    def __init__(self, axes: Axes, result: ControlResult, trial: ControlTrial, load: Load, colour: str) -> None:
        self.trial, self._load, self._radius = trial, load, result.wheel_radius
        end = result.rail + 2.0 * self._radius
        axes.set_xlim(-end - MARGIN, end + MARGIN)
        axes.set_ylim(-0.08, TITLE + 0.1)
        axes.set_aspect("equal")
        axes.axis("off")
        axes.plot([-end, end], [0.0, 0.0], color=MUTED, linewidth=2.0)
        for side in (-end, end):
            axes.plot([side, side], [0.0, 0.22], color=MUTED, linewidth=4.0)
        axes.plot([0.0, 0.0], [-0.06, 0.0], color=MUTED, linewidth=1.5)
        self._wheel = Circle((0.0, self._radius), self._radius, color=colour)
        axes.add_patch(self._wheel)
        self._body: Line2D = axes.plot([], [], color=colour, linewidth=5.0, solid_capstyle="round")[0]
        self._arm: Line2D = axes.plot([], [], color=MUTED, linewidth=2.0)[0]
        self._weight: Line2D = axes.plot([], [], "s", color="#333a41", markersize=6.0 + 4.0 * load.mass)[0]
        title = f"{result.controller}: {load.mass:g} kg that it does not know"
        axes.text(-end, TITLE, title, color=colour, fontsize=11, va="center")
        self._state = axes.text(end, TITLE, "", color=MUTED, fontsize=11, va="center", ha="right")

    def move(self, i: int) -> tuple:
        """Draw sample i of the course."""
        course = self.trial.course
        x, theta = course.x[i], course.theta[i]
        along, across = np.array([-np.sin(theta), np.cos(theta)]), np.array([np.cos(theta), np.sin(theta)])
        axle = np.array([x, self._radius])
        joint = axle + self._load.height * along
        weight = joint + self._load.side * across
        self._wheel.center = (float(x), self._radius)
        self._body.set_data(*np.stack([axle, axle + TALLEST * along]).T)
        self._arm.set_data(*np.stack([joint, weight]).T)
        self._weight.set_data([weight[0]], [weight[1]])
        stopped = self.trial.stopped is not None and course.t[i] >= self.trial.stopped
        self._state.set_text(f"stopped: {self.trial.failure}" if stopped else f"{course.t[i]:.1f} s")
        return self._wheel, self._body, self._arm, self._weight, self._state
