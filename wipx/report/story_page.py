"""The whole chain on one page: what was recorded, what the simulation lacked, and what completing it is good for."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from wipx.core.control_result import ControlResult
from wipx.core.story import NamedEffect, SignalError, Story
from wipx.effects.words import effect_in_words
from wipx.report.control_table import improvement
from wipx.report.diagnosis_words import VERDICTS, capitalised
from wipx.report.files import write_whole
from wipx.report.html import render
from wipx.report.numbers import compact, scale_for, significant, with_interval

UNIT = {"x": "m", "theta": "rad"}


@dataclass(frozen=True)
class Line:
    """An effect as a row: what it is, and its numbers.

    Attributes:
        words: In plain words.
        name: As "site/kind".
        numbers: One for each parameter.
    """

    words: str
    name: str
    numbers: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """Baseline and ours in one scenario.

    Attributes:
        scenario: What was done.
        picture: Name of its picture.
        caption: What is seen.
        rows: Cells: balance, stopped and errors of both.
    """

    scenario: str
    picture: str
    caption: str
    rows: tuple[tuple[str, ...], ...]


def write_story_page(story: Story, pictures: Mapping[str, Path], path: Path) -> None:
    """Write the page; pictures become part of it.

    Args:
        story: What happened.
        pictures: PNG or GIF files: diagnosis, estimates, control, and one for each scenario.
        path: The file.

    Raises:
        InputError: the file cannot be written.
    """
    content = {
        "story": story,
        "robot": robot_in_words(story),
        "verdict": VERDICTS[story.verdict],
        "headline": story_in_words(story),
        "tiles": [_tile(error) for error in story.errors],
        "found": [_found(effect, story.plant) for effect in story.effects],
        "hidden": _hidden(story),
        "estimates": _estimates(story),
        "comparisons": [_comparison(name, *results) for name, results in story.control.items()],
        "pictures": {name: _inline(picture) for name, picture in pictures.items()},
    }
    page = render("story.html", style=("page.css", "story.css"), script=(), data={}, content=content)
    write_whole(path, page.encode("utf-8"))


def robot_in_words(story: Story) -> str:
    """What was driven; an emulated robot is called so."""
    kind = "emulated testbed" if story.hidden is not None else "robot"
    return f"{story.plant} ({kind})"


def story_in_words(story: Story) -> str:
    """The chain in a few sentences, each with its figures."""
    errors = ", ".join(
        f"{e.column} {significant(e.nominal * s.factor)} to {significant(e.completed * s.factor)} {s.unit}"
        for e, s in ((error, _scale(error)) for error in story.errors)
    )
    before, after = (1e3 * found.recorded.rmse for found in (story.before, story.after))
    sentences = [
        _named(story),
        f"Prediction error over {compact(story.horizon)} s on recordings that nothing had seen: {errors}.",
        f"Balance of loaded robots, estimated from {compact(_seconds(story))} s of motion: error {significant(before)} "
        f"mrad if learned in the nominal simulation, {significant(after)} mrad if learned in the completed one.",
    ]
    for name, (baseline, ours) in story.control.items():
        better = improvement(baseline, ours, "rmse_x", list(ours.loads))
        sentences.append(
            f"{capitalised(name)} under {len(ours.loads)} unknown loads: {_kept(ours)} of {len(ours.trials)} trials "
            f"without a stop ({_kept(baseline)} for the baseline), position error smaller by {round(better.mean)} %."
        )
    return "\n".join(sentences)


def _named(story: Story) -> str:
    if not story.effects:
        return "No effect was found missing."
    words = [effect_in_words(effect.name, story.plant) for effect in story.effects]
    return f"Found missing: {'; '.join(words)}."


def _tile(error: SignalError) -> dict[str, str]:
    scale = _scale(error)
    return {
        "signal": f"{error.column}: prediction error",
        "before": significant(error.nominal * scale.factor),
        "after": significant(error.completed * scale.factor),
        "unit": scale.unit,
        "remark": f"{significant(error.nominal / error.completed, 2)} times smaller, "
        f"{significant(error.completed / error.noise_floor, 2)} times the sensor-noise floor",
    }


def _scale(error: SignalError):
    return scale_for((error.nominal, error.completed), UNIT.get(error.column, "rad"))


def _found(effect: NamedEffect, plant: str) -> Line:
    numbers = []
    for name, ends in effect.values.items():
        shown = with_interval(*ends)
        unit = "" if effect.units[name] == "1" else f" {effect.units[name]}"
        numbers.append(f"{name} = {shown.value}{unit} {shown.ends}")
    return Line(capitalised(effect_in_words(effect.name, plant)), effect.name, tuple(numbers))


def _hidden(story: Story) -> list[Line]:
    """What an emulated robot really has."""
    if story.hidden is None:
        return []
    physics = [
        Line(
            capitalised(effect_in_words(name, story.plant)),
            name,
            tuple(f"{symbol} = {compact(value)}" for symbol, value in values.items()),
        )
        for name, values in story.hidden.effects.items()
    ]
    signals = (f"{n} = {compact(v) if isinstance(v, float) else v}" for n, v in story.hidden_signals.items())
    return [*physics, Line("Sensors and loop", "SI units", tuple(signals))]


def _estimates(story: Story) -> list[tuple[str, ...]]:
    rows = []
    for where, result in (("the nominal simulation", story.before), ("the completed simulation", story.after)):
        errors = (f"{significant(1e3 * judged.rmse)}" for judged in (result.simulated, result.recorded))
        rows.append((where, *errors, f"{round(100.0 * result.recorded.coverage)} %"))
    return rows


def _comparison(name: str, baseline: ControlResult, ours: ControlResult) -> Comparison:
    rows = []
    for load in ours.loads:
        own = [(result.of(load), result) for result in (baseline, ours)]
        x = improvement(baseline, ours, "rmse_x", [load])
        pitch = improvement(baseline, ours, "rmse_pitch", [load])
        rows.append(
            (
                f"{compact(ours.loads[load].mass)} kg, balances at {own[0][0][0].pitch:+.2f} rad",
                *(f"{sum(t.failure is not None for t in trials)} of {len(trials)}" for trials, _ in own),
                *(significant(_mean([t.rmse_x for t in trials])) for trials, _ in own),
                f"{round(x.mean)} %",
                f"{round(pitch.mean)} %",
            )
        )
    return Comparison(name, name, _names(baseline, ours), tuple(rows))


def _names(baseline: ControlResult, ours: ControlResult) -> str:
    if baseline.controller == ours.controller:
        return f"Both are controller={ours.controller}."
    return f"Baseline: controller={baseline.controller}; ours: controller={ours.controller}."


def _kept(result: ControlResult) -> int:
    return len(result.trials) - result.failures


def _seconds(story: Story) -> float:
    return (story.after.length - 1) * story.after.period


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _inline(picture: Path) -> str:
    """A picture as an address that holds it."""
    kind = picture.suffix.removeprefix(".")
    return f"data:image/{kind};base64,{base64.b64encode(picture.read_bytes()).decode('ascii')}"
