"""Controllers of a wheeled inverted pendulum under a payload that they do not know, side by side."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure

from wipx.core.recording import Recording
from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, RECORDED, png, quiet


def draw_payload(trials: Mapping[str, Recording], equilibrium: float, title: str, path: Path) -> None:
    """Draw position and pitch over time, as PNG.

    Args:
        trials: Two, by the controller's name.
        equilibrium: Pitch at which the robot balances with the payload [rad].
        title: Of the picture.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    figure.suptitle(title, x=0.01, ha="left", fontsize=10)
    way, pitch = figure.subplots(2, 1, sharex=True)
    way.axhline(0.0, color=RECORDED, linewidth=4.0, label="reference")
    pitch.axhline(equilibrium, color=RECORDED, linewidth=4.0, label="balance with the payload")
    for (name, run), colour in zip(trials.items(), (NOMINAL, COMPLETED), strict=True):
        way.plot(run.t, run["x"], color=colour, linewidth=1.4, label=name)
        pitch.plot(run.t, run["theta"], color=colour, linewidth=1.4)
    for axes, label in ((way, "x [m]"), (pitch, "theta [rad]")):
        quiet(axes)
        axes.set_title(label, loc="left", fontsize=10, color=MUTED)
        axes.legend(frameon=False, fontsize=9, loc="best")
    pitch.set_xlabel("time since the release [s]", color=MUTED)
    write_whole(path, png(figure))
