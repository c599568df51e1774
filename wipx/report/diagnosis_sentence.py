"""The answer of a diagnosis in words."""

from collections.abc import Sequence

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.results import FitErrors
from wipx.effects.words import in_a_row, kind_at
from wipx.report.diagnosis_words import percent
from wipx.report.numbers import compact

NEARLY = 1.3  # times the noise floor, errors up to which are told as being at it


def sentence(diagnosis: Diagnosis) -> str:
    """The answer in one sentence or two: what was left out, how much of the mismatch is gone, and how much stays."""
    kind = diagnosis.nominal.plant.kind
    parts = [_with_sizes(alike, kind) for alike in _by_kind(diagnosis.effects)]
    listed = in_a_row(parts)
    verb, them = ("was", "it") if len(diagnosis.effects) == 1 else ("were", "them")
    stays = _stays(diagnosis.held_out)
    unproven = any(effect.unnamed == "unproven" for effect in diagnosis.minor)
    if not parts and diagnosis.verdict == "consistent":
        nothing = "Nothing is certainly missing" if unproven else "Nothing is missing that these recordings show"
        return f"{nothing}: {stays}."
    if not parts:
        explains = "certainly explains" if unproven else "explains"
        return f"No effect of the vocabulary {explains} what is missing: {stays}."
    share = diagnosis.held_out.explained_share
    found = f"{listed[:1].upper()}{listed[1:]} {verb} left out; adding {them} removes {percent(share)} of the mismatch"
    return f"{found}, and {stays}."


def _stays(errors: FitErrors) -> str:
    """The error that stays beside the sensors' floor."""
    over = f"predictions over {errors.horizon:g} s err"
    if errors.times_the_floor <= NEARLY:
        return f"{over} as little as sensor noise lets them"
    return f"{over} {compact(errors.times_the_floor, 2)} times as much as sensor noise makes them"


def _by_kind(effects: Sequence[FoundEffect]) -> list[list[FoundEffect]]:
    """Effects of one kind, whose first numbers have one unit, stand together."""
    groups: dict[tuple[str, str], list[FoundEffect]] = {}
    for effect in effects:
        unit = effect.parameters[0].unit if effect.parameters else ""
        groups.setdefault((effect.name.partition("/")[2], unit), []).append(effect)
    return list(groups.values())


def _with_sizes(effects: Sequence[FoundEffect], plant_kind: str) -> str:
    """Effects of one kind in words with their first numbers."""
    kind = effects[0].name.partition("/")[2]
    words = kind_at([effect.name.partition("/")[0] for effect in effects], kind, plant_kind)
    if not effects[0].parameters:
        return words
    firsts = [effect.parameters[0] for effect in effects]
    unit = "" if firsts[0].unit == "1" else f" {firsts[0].unit}"
    sizes = in_a_row([f"{first.value:.3g}" for first in firsts])
    return f"{words} ({firsts[0].name.rpartition('.')[2]} = {sizes}{unit})"
