"""The answer of a diagnosis in words."""

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.results import FitErrors
from wipx.core.words import effect_in_words

NEARLY = 1.3  # times the noise floor, errors up to which are told as being at it
FAR_OFF = 5.0  # times the noise floor, errors from which predictions count as far off


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
    share = explained_share(diagnosis.held_out)
    found = f"{listed[:1].upper()}{listed[1:]} {verb} left out; adding {them} removes {share:.0%} of the mismatch"
    return f"{found}, and {stays}."


def _stays(errors: FitErrors) -> str:
    """The error that stays beside the sensors' floor."""
    times = times_the_floor(errors)
    if times <= NEARLY:
        return f"predictions over {errors.horizon:g} s err as little as sensor noise lets them"
    return f"predictions over {errors.horizon:g} s err {times:.2g} times as much as white sensor noise makes them"


def explained_share(errors: FitErrors) -> float:
    """Share of the explainable squared prediction error on held-out recordings that the completed model removes."""
    removed = total = 0.0
    for name, floor in errors.noise_floor.items():
        scale = max(floor, 1e-12) ** 2
        total += max(errors.nominal[name] ** 2 - floor**2, 0.0) / scale
        removed += max(errors.nominal[name] ** 2 - max(errors.completed[name] ** 2, floor**2), 0.0) / scale
    return removed / total if total > 0.0 else 0.0


def times_the_floor(errors: FitErrors) -> float:
    """The largest error of the completed model over its noise floor."""
    return max(errors.completed[name] / max(floor, 1e-15) for name, floor in errors.noise_floor.items())


def _with_size(effect: FoundEffect, kind: str) -> str:
    """An effect in words with its first number."""
    words = effect_in_words(effect.name, kind)
    if not effect.parameters:
        return words
    first = effect.parameters[0]
    unit = "" if first.unit == "1" else f" {first.unit}"
    return f"{words} ({first.name.rpartition('.')[2]} = {first.value:.3g}{unit})"
