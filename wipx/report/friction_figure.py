"""A joint's friction over its velocity, beside the usual model (the paper's Fig. 3)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, picture, quiet


@dataclass(frozen=True)
class FrictionSweep:
    """Friction of a joint whose velocity swings once to and fro.

    Attributes:
        t: Time, shape (K,) [s].
        velocity: Shape (K,) [rad/s].
        friction: Of the model, positive against positive motion, shape (K,) [N m].
        baseline: Coulomb plus viscous friction, shape (K,) [N m].
        zoom: Velocity up to which the second panel reaches [rad/s].
    """

    t: np.ndarray
    velocity: np.ndarray
    friction: np.ndarray
    baseline: np.ndarray
    zoom: float


def draw_friction(sweep: FrictionSweep, title: str, path: Path) -> None:
    """Draw friction over velocity, the same near rest, and over time, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(10.5, 3.6), layout="constrained")
    whole, near, course = figure.subplots(1, 3)
    for axes in (whole, near):
        quiet(axes)
        axes.plot(sweep.velocity, sweep.baseline, color=NOMINAL, linewidth=1.4, label="Coulomb + viscous")
        axes.plot(sweep.velocity, sweep.friction, color=COMPLETED, linewidth=1.4, label="Eq. 5")
        axes.set_xlabel("velocity [rad/s]", color=MUTED)
    whole.set_ylabel("friction against the motion [N m]", color=MUTED)
    near.set_xlim(-sweep.zoom, sweep.zoom)
    near.set_title("near rest: dead zone and lag", loc="left", fontsize=9)
    quiet(course)
    slow = np.abs(sweep.velocity) < sweep.zoom
    crossing = float(sweep.t[np.flatnonzero(slow)[len(np.flatnonzero(slow)) // 2]])
    course.plot(1e3 * (sweep.t - crossing), sweep.baseline, color=NOMINAL, linewidth=1.4)
    course.plot(1e3 * (sweep.t - crossing), sweep.friction, color=COMPLETED, linewidth=1.4)
    reach = 1e3 * float(np.ptp(sweep.t[slow])) if slow.any() else 1.0
    course.set_xlim(-0.05 * reach, 0.05 * reach)
    course.set_xlabel("time about a reversal [ms]", color=MUTED)
    whole.legend(frameon=False, loc="lower right", fontsize=8)
    figure.suptitle(title, x=0.01, ha="left", fontsize=10)
    write_whole(path, picture(figure, path))
