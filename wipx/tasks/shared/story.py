"""What the chain of task=pipeline leaves when all its stages are done: one page, and a few lines."""

import json
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.core.story import NamedEffect, SignalError, Story
from wipx.hardware.target import Target
from wipx.hardware.testbed import EmulatedTestbed
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.files.control import read_control
from wipx.tasks.files.estimation import read_estimation
from wipx.tasks.files.results import written_together
from wipx.tasks.shared.control_scenarios import ScenarioName


def leave_story(out: Path, target: Target, scenarios: tuple[ScenarioName, ...]) -> str:
    """Write story.html with its pictures to a folder that holds all stages; what an emulated robot hid is opened now.

    Returns:
        A few lines for the terminal.
    """
    from wipx.report.control_animation import animate
    from wipx.report.control_figures import draw_errors
    from wipx.report.estimation_figures import draw_estimates
    from wipx.report.story_page import story_in_words, write_story_page

    story = _story(out, target, scenarios)
    with written_together(out) as folder:
        if story.hidden is not None:
            write_model(story.hidden, folder / "hidden.yaml")
        draw_estimates([story.before, story.after], folder / "estimates.png")
        for scenario, results in story.control.items():
            draw_errors(results, folder / f"{scenario}.png")
        first = story.control[scenarios[0]]
        animate(first, max(first[0].loads, key=lambda name: abs(first[0].of(name)[0].pitch)), folder / "control.gif")
        pictures = {path.stem: path for path in (*folder.glob("*.png"), folder / "control.gif")}
        write_story_page(story, {"diagnosis": out / "diagnosis" / "diagnosis.png", **pictures}, folder / "story.html")
    return f"{story_in_words(story)}\n\npage: {out / 'story.html'}"


def _story(out: Path, target: Target, scenarios: tuple[ScenarioName, ...]) -> Story:
    source = RecordingSource(path=str(out / "recordings"))
    recordings = source.load()
    diagnosis, judged = _read(out / "diagnosis" / "diagnosis.json"), _read(out / "prediction" / "metrics.json")
    hidden = target.hidden() if isinstance(target, EmulatedTestbed) else None
    return Story(
        target=type(target).__name__,
        plant=source.describe().model.plant.kind,
        recordings=len(recordings),
        held_out=sum(recording.name.startswith("fresh") for recording in recordings),
        duration=round(recordings[0].duration, 1),
        verdict=diagnosis["verdict"],
        effects=tuple(_effect(found) for found in diagnosis["effects"]),
        horizon=judged["horizon_s"],
        errors=tuple(
            SignalError(column, value, judged["rms"][column], judged["noise_floor"][column])
            for column, value in judged["rms_nominal"].items()
        ),
        hidden=None if hidden is None else hidden.model,
        hidden_signals={} if hidden is None else hidden.beside_the_model(),
        before=read_estimation(out / "nominal"),
        after=read_estimation(out / "estimator"),
        control={
            name: (read_control(out / f"{name}-baseline"), read_control(out / f"{name}-ours")) for name in scenarios
        },
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({error}); remove its folder and run again") from error


def _effect(found: dict[str, Any]) -> NamedEffect:
    parameters = found["parameters"]
    return NamedEffect(
        found["name"],
        {name: (number["value"], *number["ci95"]) for name, number in parameters.items()},
        {name: number["unit"] for name, number in parameters.items()},
    )
