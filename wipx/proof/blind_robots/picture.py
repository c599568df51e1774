"""Which hidden physics was answered by what, as a picture."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from wipx.proof.blind_robots.table import is_right

RIGHT, WRONG, MUTED, GRID = "#0072b2", "#d55e00", "#5b6470", "#e3e7eb"  # Okabe and Ito 2008
ROW = 0.24  # [inch]
MARGIN = 2.6  # [inch], for the names
DPI = 200


def draw_confusions(counts: Mapping[tuple[str, str], int], path: Path) -> None:
    """Draw how often hidden physics (rows) was answered by what (columns), as PNG.

    Args:
        counts: By (hidden, answered).
        path: The file.
    """
    hidden = sorted({pair[0] for pair in counts})
    answers = sorted({pair[1] for pair in counts}, key=lambda name: (name not in hidden, name))
    size = (MARGIN + ROW * max(len(answers), 12), MARGIN + ROW * max(len(hidden), 3))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set_xlim(-0.5, len(answers) - 0.5)
    axes.set_ylim(len(hidden) - 0.5, -0.5)
    for (true, answered), count in counts.items():
        column, row = answers.index(answered), hidden.index(true)
        total = sum(number for (name, _), number in counts.items() if name == true)
        colour = RIGHT if is_right(true, answered) else WRONG
        axes.add_patch(_cell(column, row, colour, count / total))
        ink = "white" if count > 0.5 * total else "black"
        axes.text(column, row, str(count), ha="center", va="center", fontsize=8, color=ink)
    axes.set_xticks(np.arange(len(answers)), answers, rotation=90, fontsize=8, color=MUTED)
    axes.set_yticks(np.arange(len(hidden)), hidden, fontsize=8, color=MUTED)
    axes.set_xlabel("answered", color=MUTED)
    axes.set_ylabel("hidden", color=MUTED)
    axes.grid(color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title("Cases with at most one effect", loc="left", fontsize=10)
    figure.savefig(path, format="png", dpi=DPI, facecolor="white")


def _cell(column: int, row: int, colour: str, share: float) -> Rectangle:
    return Rectangle((column - 0.45, row - 0.45), 0.9, 0.9, color=colour, alpha=0.35 + 0.65 * share, linewidth=0.0)
