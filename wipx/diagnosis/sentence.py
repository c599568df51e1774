"""The answer of a diagnosis in words."""

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.results import FitErrors
from wipx.core.words import effect_in_words

FAR_OFF = 5.0  # times the noise floor, errors from which predictions count as far off


def sentence(diagnosis: Diagnosis) -> str:
    """The answer in one sentence or two."""
    kind = diagnosis.nominal.plant.kind
    share = explained_share(diagnosis)
    parts = [_with_size(effect, kind) for effect in diagnosis.effects]
    listed = parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + f" and {parts[-1]}" if parts else ""
    verb = "was" if len(parts) == 1 else "were"
    named = f"{listed[:1].upper()}{listed[1:]} {verb} left out; adding {'it' if len(parts) == 1 else 'them'} explains"
    if diagnosis.verdict == "consistent" and (ratio := times_the_floor(diagnosis.held_out)) > FAR_OFF:
        return (
            "No missing effect shows itself from row to row, but predictions over "
            f"{diagnosis.held_out.horizon:g} s are {ratio:.0f} times worse than sensor noise makes them: "
            "record other excitations."
        )
    if diagnosis.verdict == "consistent":
        return "The nominal model explains the recordings up to noise: nothing is missing."
    if diagnosis.verdict == "mismatch":
        return f"{named} {share:.0%} of the mismatch."
    if any(effect.beyond for effect in diagnosis.effects):
        return f"{named} {share:.0%} of the mismatch; the vocabulary has no name for {diagnosis.unexplained.shape}."
    shape = diagnosis.unexplained.shape
    rest = f"{shape[:1].upper()}{shape[1:]} that no effect of the vocabulary explains"
    return f"{rest} is left over." if not parts else f"{named} a part of the mismatch. {rest} is left over."


def explained_share(diagnosis: Diagnosis) -> float:
    """Share of the explainable squared prediction error on held-out recordings that the completed model removes."""
    errors = diagnosis.held_out
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
