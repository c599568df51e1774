"""The outcome as pictures: for a README, a paper's draft or an experiment log."""

from pathlib import Path

from matplotlib.figure import Figure

from wipx.core.results import IdentificationResult
from wipx.report.charts import wants_logarithm
from wipx.report.files import write_whole
from wipx.report.outcome import judged_errors, search_summary
from wipx.report.panels import COMPLETED, MUTED, draw_errors, draw_signal, png, quiet, representative_stretch, with_unit

WIDTH = 9.0  # inches; at `panels.DPI` twice the 900 pixels it is read at


def draw_fit(result: IdentificationResult, path: Path) -> None:
    """Draw recorded against predicted signals and the errors, as PNG.

    The recording is that of `panels.representative_stretch`.

    Raises:
        InputError: the file cannot be written.
    """
    rows = judged_errors(result)
    figure = Figure(figsize=(WIDTH, 1.0 + 2.1 * len(rows)), layout="constrained")
    grid = figure.add_gridspec(len(rows), 2, width_ratios=(3.0, 1.0))
    shown = representative_stretch(result)
    for row, errors in enumerate(rows):
        bars = figure.add_subplot(grid[row, 1])
        heights = (errors.nominal, errors.completed, errors.noise_floor)
        draw_errors(bars, heights, title=with_unit(f"error of {errors.signal}", errors.scale.unit))
        if shown is not None and errors.signal in shown.recorded:
            signal = figure.add_subplot(grid[row, 0])
            draw_signal(signal, shown, errors.signal, result.units.get(errors.signal, ""))
            signal.tick_params(labelbottom=row == len(rows) - 1)
    if shown is not None:
        figure.axes[-1].set_xlabel("time [s]; predictions restart at every vertical line", color=MUTED)
        figure.axes[1].legend(loc="lower left", bbox_to_anchor=(0.0, 1.1), ncols=3, frameon=False, borderaxespad=0.0)
        kind = "held-out" if shown.held_out else "fitted"
        title = f"{result.title}: {kind} recording {shown.name}"
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, parse_math=False)
    write_whole(path, png(figure))


def draw_search(result: IdentificationResult, path: Path) -> None:
    """Draw the best loss over evaluations, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    history = result.history
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    axes = figure.add_subplot()
    quiet(axes)
    axes.step(history.evaluations, history.best_loss, where="post", color=COMPLETED, linewidth=1.8)
    axes.plot(history.evaluations[-1:], history.best_loss[-1:], "o", color=COMPLETED, markersize=5)
    if wants_logarithm(history.best_loss.tolist()):
        axes.set_yscale("log")
    axes.set_xlabel("evaluations", color=MUTED)
    axes.set_ylabel("best loss", color=MUTED)
    axes.set_title(search_summary(result), loc="left", fontsize=10, parse_math=False)
    write_whole(path, png(figure))
