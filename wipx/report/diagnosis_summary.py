"""A diagnosis as a few lines for the terminal."""

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.effects.words import effect_in_words
from wipx.report.diagnosis_words import (
    VERDICTS,
    capitalised,
    combined_sentence,
    minor_sentence,
    nats,
    next_step,
    percent,
    remainder_sentences,
    tie_sentence,
    unexplained_sentence,
    value_in_words,
)
from wipx.report.outcome import headline


def summary(diagnosis: Diagnosis) -> str:
    """Verdict, effects with intervals, ties, errors, what is left over and what to record next."""
    kind = diagnosis.model.plant.kind
    lines = [f"{diagnosis.title} ({kind}): {VERDICTS[diagnosis.verdict]}", diagnosis.sentence, ""]
    for effect in diagnosis.effects:
        lines += _effect_lines(effect, kind)
    lines += [f"  {combined_sentence(law, kind)}" for law in diagnosis.combined]
    if diagnosis.minor:
        lines.append(f"  {minor_sentence(diagnosis)}")
    if diagnosis.corrected:
        corrected = ", ".join(value_in_words(number) for number in diagnosis.corrected)
        lines.append(f"  corrected: {corrected}")
    lines += [headline(diagnosis), unexplained_sentence(diagnosis)]
    if diagnosis.unexplained.significant:
        lines += [f"  {sentence}" for sentence in remainder_sentences(diagnosis)]
    lines += [f"asked: {suspect.sentence}" for suspect in diagnosis.suspects]
    following = next_step(diagnosis.next_experiment)
    if following is not None:
        lines.append(f"next: {following}")
    lines += [f"note: {note}" for note in diagnosis.notes]
    return "\n".join(lines)


def _effect_lines(effect: FoundEffect, plant_kind: str) -> list[str]:
    values = ", ".join(value_in_words(number) for number in effect.parameters)
    evidence = f"evidence {nats(effect.log_evidence_gain)} nats, held-out gain {percent(effect.heldout_gain)}"
    lines = [f"  {capitalised(effect_in_words(effect.name, plant_kind))}: {values}; {evidence}"]
    tie = tie_sentence(effect, plant_kind)
    return [*lines, f"    {tie}"] if tie else lines
