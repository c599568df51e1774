"""A page that replays a recording of a robot beside its nominal simulation, and says what its columns are taken for."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.plant import Plant
from wipx.core.results import FitErrors, Trace
from wipx.core.tree import Tree
from wipx.report.charts import json_number, packed
from wipx.report.diagnosis_words import capitalised
from wipx.report.drawing import svg
from wipx.report.files import write_whole
from wipx.report.html import render
from wipx.report.numbers import scale_for, significant
from wipx.report.robot_picture import robot_picture
from wipx.report.stick_figure import best_view, stick_figure
from wipx.report.traces import break_at_restarts, decimate

MOST_FRAMES, MOST_ROWS = 500, 3000
BOX, MARGIN = (520.0, 380.0), 24.0  # [pixels] of the moving figure


@dataclass(frozen=True)
class Replay:
    """A recording beside the nominal simulation.

    Attributes:
        title: Of the robot.
        plant: A robot from a model file.
        trace: The recording, with predictions of the nominal model.
        errors: Of these predictions.
        reasons: What the columns of each joint are taken for, by joint.
        doubts: What is not sure, one sentence each.
        commands: To go on with.
    """

    title: str
    plant: Plant
    trace: Trace
    errors: FitErrors
    reasons: Mapping[str, str]
    doubts: tuple[str, ...]
    commands: tuple[str, ...]


def write_replay_page(replay: Replay, path: Path) -> None:
    """Write the page.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, replay_page(replay).encode("utf-8"))


def replay_page(replay: Replay) -> str:
    """The page's HTML; every text is escaped."""
    tree, trace = replay.plant.tree, replay.trace
    assert tree is not None
    middle = {joint: float(trace.recorded[joint][len(trace.t) // 2]) for joint in tree.joints}
    return render(
        "replay.html",
        style=("page.css", "replay.css"),
        script=("charts.js", "replay.js"),
        data={"frames": _frames(tree, trace), "joints": _joints(replay)},
        content={
            "title": replay.title,
            "recording": trace.name,
            "horizon": replay.errors.horizon,
            "picture": svg(robot_picture(tree, middle), "Joints of the robot"),
            "rows": _rows(replay),
            "doubts": [capitalised(doubt) for doubt in replay.doubts],
            "commands": replay.commands,
        },
    )


def _rows(replay: Replay) -> list[dict[str, str]]:
    """One row a joint: what it is taken for, how far it moved, and how well the nominal model predicts it."""
    rows = []
    for joint, reason in replay.reasons.items():
        unit = replay.plant.unit_of(joint)
        error, floor = replay.errors.nominal[joint], replay.errors.noise_floor[joint]
        scale = scale_for([error, floor], unit)
        values = replay.trace.recorded[joint]
        rows.append(
            {
                "joint": joint,
                "reason": reason,
                "span": f"{significant(float(values.min()))} to {significant(float(values.max()))} {unit}",
                "error": f"{significant(scale.factor * error)} {scale.unit}",
                "floor": f"{significant(scale.factor * floor)} {scale.unit}",
            }
        )
    return rows


def _joints(replay: Replay) -> list[dict]:
    """The signals of each joint, ready to draw."""
    thinned = break_at_restarts(decimate(replay.trace, MOST_ROWS))
    found = []
    for joint in replay.reasons:
        command = f"u_{joint}"
        found.append(
            {
                "name": joint,
                "unit": replay.plant.unit_of(joint),
                "t": packed(thinned.t),
                "recorded": packed(thinned.recorded[joint]),
                "nominal": packed(thinned.nominal[joint]),
                "command": packed(thinned.command[command]) if command in thinned.command else None,
                "commandUnit": replay.plant.unit_of(command) if command in thinned.command else "",
            }
        )
    return found


def _frames(tree: Tree, trace: Trace) -> dict:
    """Points of the figure over time in pixels: base, joints, tips; and which of them lines join."""
    rows = np.unique(np.linspace(0, len(trace.t) - 1, MOST_FRAMES).round().astype(int))
    recorded = np.stack([trace.recorded[joint][rows] for joint in tree.joints], axis=1)
    nominal = np.stack([trace.nominal[joint][rows] for joint in tree.joints], axis=1)
    view = best_view(tree, recorded[len(rows) // 2])

    def points(q: np.ndarray) -> np.ndarray:
        figure = stick_figure(tree, q, view, 0.0)  # joints stay where they are: nothing jumps
        return np.vstack([figure.base, figure.joints, figure.ends])

    seen = np.array([points(q) for q in recorded])
    simulated = np.array([points(q) if np.all(np.isfinite(q)) else np.full_like(seen[0], np.nan) for q in nominal])
    low, high = np.nanmin(seen, axis=(0, 1)), np.nanmax(seen, axis=(0, 1))
    scale = float(np.min((np.array(BOX) - 2.0 * MARGIN) / np.maximum(high - low, 1e-9)))
    width, height = scale * (high - low) + 2.0 * MARGIN

    def pixels(at: np.ndarray) -> np.ndarray:
        return (at - np.array([low[0], high[1]])) * (scale, -scale) + MARGIN

    count = len(tree.links)
    lines = []
    for i, link in enumerate(tree.links):
        if link.parent >= 0 or not link.slides:
            lines.append([link.parent + 1, i + 1])
        if np.isfinite(seen[0, 1 + count + i, 0]):
            lines.append([i + 1, 1 + count + i])
    return {
        "t": [json_number(float(t)) for t in trace.t[rows]],
        "points": 1 + 2 * count,
        "joints": count,
        "lines": lines,
        "width": float(width),
        "height": float(height),
        "recorded": packed(pixels(seen).ravel()),
        "nominal": packed(pixels(simulated).ravel()),
    }
