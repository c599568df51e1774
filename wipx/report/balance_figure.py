"""Controllers of a robot that balances with a payload, side by side: way, and angle of the joint without a drive."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from wipx.core.balance_result import BalanceTrial
from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, MUTED, NOMINAL, RECORDED, png, quiet


def draw_balance(trials: Sequence[BalanceTrial], payload: float, path: Path) -> None:
    """Draw position and pitch over time, as PNG.

    Args:
        trials: Two, that of the nominal balance first.
        payload: In the hand [kg].
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    way, angle = figure.subplots(2, 1, sharex=True)
    longest = max(trials, key=lambda trial: len(trial.columns["t"]))
    slide = next(name.removesuffix("_ref") for name in longest.columns if name.endswith("_ref"))
    way.plot(longest.columns["t"], longest.columns[f"{slide}_ref"], color=RECORDED, linewidth=4.0, label="reference")
    angle.axhline(longest.true, color=RECORDED, linewidth=4.0, label="balance with the payload")
    for trial, colour in zip(trials, (NOMINAL, COMPLETED), strict=True):
        way.plot(trial.columns["t"], trial.columns[slide], color=colour, linewidth=1.4, label=f"LQR, {trial.name}")
        angle.plot(trial.columns["t"], trial.columns[trial.joint], color=colour, linewidth=1.4)
    for axes, title in ((way, f"{slide} [m]"), (angle, f"{longest.joint} [rad]")):
        quiet(axes)
        axes.set_title(title, loc="left", fontsize=10, color=MUTED)
        axes.legend(frameon=False, fontsize=9, loc="best")
    angle.set_xlabel("time [s]", color=MUTED)
    figure.suptitle(f"{payload:g} kg in the hand, unknown to the controllers", x=0.01, ha="left", fontsize=10)
    write_whole(path, png(figure))
