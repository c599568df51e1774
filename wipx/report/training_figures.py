"""Training sets as pictures: which equilibrium pitches they hold, and what their windows look like."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from wipx.report.files import write_whole
from wipx.report.panels import COMPLETED, FLOOR, MUTED, NOMINAL, png, quiet

BINS = 30
SHOWN = 20  # windows


def draw_labels(pitches: Mapping[str, np.ndarray], path: Path) -> None:
    """Draw how often each equilibrium pitch occurs in each part of a training set, stacked, as PNG.

    Args:
        pitches: By part, shape (N,) each [rad].
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    quiet(axes)
    everything = np.concatenate(list(pitches.values()))
    edges = np.linspace(everything.min(), everything.max() + 1e-9, BINS + 1)
    names = [f"{part} ({len(values)})" for part, values in pitches.items()]
    axes.hist(list(pitches.values()), bins=edges.tolist(), stacked=True, label=names, color=[FLOOR, NOMINAL, COMPLETED])
    axes.set_xlabel("equilibrium pitch [rad]", color=MUTED)
    axes.set_ylabel("robots", color=MUTED)
    figure.legend(loc="outside upper right", ncols=len(names), frameon=False)
    write_whole(path, png(figure))


def draw_windows(t: np.ndarray, windows: np.ndarray, pitch: np.ndarray, path: Path) -> None:
    """Draw position and pitch of some robots, coloured by the pitch at which they balance, as PNG.

    Args:
        t: Time since the release, shape (L,) [s].
        windows: Shape (N, L, 2) [m, rad].
        pitch: At which they balance, shape (N,) [rad]; those that are shown are evenly spread over it.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    order = np.argsort(pitch)
    shown = order[np.unique(np.linspace(0, len(order) - 1, SHOWN).round().astype(int))]
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 2)
    colours = ScalarMappable(Normalize(float(pitch.min()), float(pitch.max()) + 1e-9), "viridis")
    for axes, j, label in zip(panels, (0, 1), ("x [m]", "theta [rad]"), strict=True):
        quiet(axes)
        for i in shown:
            axes.plot(t, windows[i, :, j], color=colours.to_rgba(pitch[i]), linewidth=1.0)
        axes.set_xlabel("time since the release [s]", color=MUTED)
        axes.set_ylabel(label, color=MUTED)
    figure.colorbar(colours, ax=panels, label="equilibrium pitch [rad]")
    write_whole(path, png(figure))
