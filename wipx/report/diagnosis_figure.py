"""A diagnosis as one picture: before and after, where or which law, and the evidence."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure

from wipx.core.diagnosis import ConsideredEffect, Diagnosis
from wipx.core.location import ErrorMap
from wipx.report.diagnosis_charts import (
    TitledCurve,
    bar_length,
    colour_top,
    force_range,
    full_bar,
    ranked_candidates,
    titled_curves,
)
from wipx.report.diagnosis_words import VERDICTS, nats
from wipx.report.files import write_whole
from wipx.report.outcome import judged_errors
from wipx.report.panels import (
    COMPLETED,
    FLOOR,
    MUTED,
    draw_errors,
    draw_signal,
    png,
    quiet,
    representative_stretch,
    with_unit,
)

SIZE = (13.0, 4.6)  # inches, at least
OF_SIGNAL = 0.9  # inches of height for each signal, at least
STAND_IN = "#9b4dbb"
HEAT = LinearSegmentedColormap.from_list("excess", ["#eef1f4", "#e8893c", "#6b1d00"])
SHOWN_CANDIDATES = 8


def draw_diagnosis(diagnosis: Diagnosis, path: Path) -> None:
    """Draw signals before and after, the leading law on the data (or where the mismatch is), and the evidence, as PNG.

    Raises:
        InputError: the file cannot be written.
    """
    height = max(SIZE[1], OF_SIGNAL * len(diagnosis.fit.completed))
    figure = Figure(figsize=(SIZE[0], height), layout="constrained")
    grid = figure.add_gridspec(1, 3, width_ratios=(1.25, 1.0, 1.0), wspace=0.03)
    _draw_before_and_after(figure.add_subfigure(grid[0, 0]), diagnosis)
    _draw_leading_law(figure.add_subfigure(grid[0, 1]), diagnosis)
    _draw_evidence(figure.add_subfigure(grid[0, 2]).subplots(), diagnosis)
    title = f"{diagnosis.title}. {VERDICTS[diagnosis.verdict]}"
    figure.suptitle(title, x=0.01, ha="left", fontsize=12, parse_math=False)
    write_whole(path, png(figure))


def _draw_before_and_after(panel: SubFigure, diagnosis: Diagnosis) -> None:
    shown = representative_stretch(diagnosis)
    if shown is None or not shown.recorded:
        _say(panel.subplots(), "no recording was long enough to predict")
        return
    rows = np.atleast_1d(panel.subplots(len(shown.recorded), 1, sharex=True))
    for axes, column in zip(rows, shown.recorded, strict=True):
        draw_signal(axes, shown, column, diagnosis.units.get(column, ""))
    kind = "held-out" if shown.held_out else "fitted"
    rows[-1].set_xlabel(f"time [s], {kind} recording {shown.name}", color=MUTED, parse_math=False)
    panel.legend(*rows[0].get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False, fontsize=9)


def _draw_leading_law(panel: SubFigure, diagnosis: Diagnosis) -> None:
    """The largest effect's law; without a curve the map; with nothing to locate the errors."""
    curves = titled_curves(diagnosis)
    if curves:
        _draw_curve(panel.subplots(), curves[0])
    elif diagnosis.location.map is not None:
        _draw_map(panel, diagnosis.location.map)
    else:
        errors = judged_errors(diagnosis)
        count = max(len(errors), 1)
        for axes, row in zip(np.atleast_1d(panel.subplots(count, 1, sharex=True)), errors, strict=False):
            heights = (row.nominal, row.completed, row.noise_floor)
            title = with_unit(f"error of {row.signal}", row.scale.unit)
            draw_errors(axes, heights, title, room=0.1 + 0.1 * count)  # low panels leave a number less room


def _draw_curve(axes: Axes, titled: TitledCurve) -> None:
    curve = titled.curve
    quiet(axes)
    axes.errorbar(
        curve.bins, curve.force, 2.0 * curve.spread, fmt="o", color=FLOOR, markersize=4, linewidth=1.0, label="data"
    )
    colour, label = (STAND_IN, "stand-in") if titled.stand_in else (COMPLETED, "law")
    axes.plot(curve.at, curve.law, color=colour, linewidth=2.0, label=label)
    axes.set_ylim(*force_range(curve))
    axes.set_xlabel(with_unit(curve.signal, curve.signal_unit), color=MUTED, parse_math=False)
    axes.set_ylabel(with_unit(curve.quantity, curve.force_unit), color=MUTED, parse_math=False)
    axes.set_title(titled.title, loc="left", fontsize=10, color=MUTED, parse_math=False)
    axes.legend(frameon=False, fontsize=9)


def _draw_map(panel: SubFigure, where: ErrorMap) -> None:
    axes = panel.subplots()
    quiet(axes)
    axes.grid(visible=False)
    image = axes.pcolormesh(*where.edges, where.excess.T, cmap=HEAT, vmin=0.0, vmax=colour_top(where.excess))
    panel.colorbar(image, ax=axes, fraction=0.06, pad=0.02).outline.set_visible(False)
    axes.set_xlabel(with_unit(where.signals[0], where.units[0]), color=MUTED, parse_math=False)
    axes.set_ylabel(with_unit(where.signals[1], where.units[1]), color=MUTED, parse_math=False)
    axes.set_title("excess error [nats per row]", loc="left", fontsize=10, color=MUTED)


def _draw_evidence(axes: Axes, diagnosis: Diagnosis) -> None:
    """Bars of logarithmic length, as on the page; the chosen candidates are among them whatever their gain."""
    shown = _leading_candidates(diagnosis)
    if not shown:
        _say(axes, "no candidate was considered")
        return
    lengths = [bar_length(candidate.gain, full_bar(diagnosis)) for candidate in shown]
    colours = [COMPLETED if candidate.chosen else FLOOR for candidate in shown]
    bars = axes.barh(range(len(shown)), lengths, color=colours, height=0.62)
    axes.bar_label(bars, [nats(candidate.gain) for candidate in shown], padding=3, fontsize=9)
    axes.set_yticks(range(len(shown)), [candidate.name.replace(" + ", "\n+ ") for candidate in shown], parse_math=False)
    axes.set_ylim(max(len(shown), SHOWN_CANDIDATES) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.2)
    axes.spines[["top", "right", "bottom", "left"]].set_visible(False)
    axes.tick_params(left=False, bottom=False, labelbottom=False, labelsize=9)
    axes.set_title("evidence [nats], log lengths\nblue: part of the answer", loc="left", fontsize=10, color=MUTED)


def _leading_candidates(diagnosis: Diagnosis) -> list[ConsideredEffect]:
    ranked = ranked_candidates(diagnosis)
    places = max(0, SHOWN_CANDIDATES - sum(candidate.chosen for candidate in ranked))
    others = [candidate for candidate in ranked if not candidate.chosen][:places]
    return [candidate for candidate in ranked if candidate.chosen or candidate in others]


def _say(axes: Axes, text: str) -> None:
    axes.axis("off")
    axes.text(0.5, 0.5, text, ha="center", va="center", color=MUTED)
