"""The answer of a diagnosis in words."""

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.results import FitErrors
from wipx.effects.words import effect_in_words
from wipx.report.diagnosis_words import percent
from wipx.report.numbers import compact

NEARLY = 1.3  # times the noise floor, errors up to which are told as being at it


def sentence(diagnosis: Diagnosis) -> str:
    """The answer in one sentence or two: what was left out, how much of the mismatch is gone, and how much stays."""
    kind = diagnosis.nominal.plant.kind
    parts = [_with_size(effect, kind) for effect in diagnosis.effects]
    listed = parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + f" and {parts[-1]}" if parts else ""
    verb, them = ("was", "it") if len(parts) == 1 else ("were", "them")
    stays = _stays(diagnosis.held_out)
    if not parts and diagnosis.verdict == "consistent":
        return f"Nothing is missing that these recordings show: {stays}."
    if not parts:
        return f"No effect of the vocabulary explains what is missing: {stays}."
    share = diagnosis.held_out.explained_share
    found = f"{listed[:1].upper()}{listed[1:]} {verb} left out; adding {them} removes {percent(share)} of the mismatch"
    return f"{found}, and {stays}."


def _stays(errors: FitErrors) -> str:
    """The error that stays beside the sensors' floor."""
    over = f"predictions over {errors.horizon:g} s err"
    if errors.times_the_floor <= NEARLY:
        return f"{over} as little as sensor noise lets them"
    return f"{over} {compact(errors.times_the_floor, 2)} times as much as white sensor noise makes them"


def _with_size(effect: FoundEffect, kind: str) -> str:
    """An effect in words with its first number."""
    words = effect_in_words(effect.name, kind)
    if not effect.parameters:
        return words
    first = effect.parameters[0]
    unit = "" if first.unit == "1" else f" {first.unit}"
    return f"{words} ({first.name.rpartition('.')[2]} = {first.value:.3g}{unit})"
