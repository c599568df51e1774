"""What a reader must know before he relies on a diagnosis: of the recordings, and of sizes that are hardly possible."""

from collections.abc import Sequence

import numpy as np

from wipx.core.diagnosis import FoundEffect
from wipx.core.parameters import Parameter
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.diagnosis.rules import USUAL, AnswerRules
from wipx.effects.catalogue import effect_of
from wipx.effects.words import effect_in_words


def caveats(
    recordings: tuple[Recording, ...],
    rules: AnswerRules = USUAL.answer,
    cut_off: float | None = None,
    *,
    guessed_means: bool = False,
) -> tuple[str, ...]:
    """One sentence for each: a single recording, low-passed signals, mean commands, missing rows, uneven time steps.

    Args:
        recordings: Of one robot.
        rules: What is said.
        cut_off: Frequency above which no signal has any power [Hz]; None where they have.
        guessed_means: Whether the log turned out to be slower than the controller.
    """
    said = []
    if len(recordings) == 1:
        said.append(
            f"There is one recording only, {recordings[0].name}: what differs from run to run cannot show, "
            "and what is held out is a part of the same run."
        )
    if cut_off is not None:
        said.append(
            f"All signals were low-passed before they were logged: they have hardly any power above {cut_off:.2g} Hz. "
            "Gravity, friction and gains show; noise, delays, sticking and backlash do not."
        )
    if guessed_means:
        said.append(
            "The log seems to be slower than the controller: each row counts as the mean of several commands. "
            "Log every command to see more."
        )
    missing = {one.name: int(one.missing.sum()) for one in recordings if one.missing.any()}
    if missing:
        worst = max(missing, key=lambda name: missing[name])
        whole = next(len(one) for one in recordings if one.name == worst) + missing[worst]
        said.append(
            f"Rows are missing in {len(missing)} of {len(recordings)} recordings, most in {worst} "
            f"({missing[worst]} of {whole}); the command before a gap counts as held through it, but not as exact."
        )
    uneven = {one.name: _unevenness(one) for one in recordings}
    uneven = {name: varied for name, varied in uneven.items() if varied > rules.uneven}
    if uneven:
        worst = max(uneven, key=lambda name: uneven[name])
        said.append(
            f"Time steps vary in {len(uneven)} of {len(recordings)} recordings, most in {worst} "
            f"(by {100.0 * uneven[worst]:.0f} %); they are taken as logged."
        )
    return tuple(said)


def implausible(effects: Sequence[FoundEffect], plant: Plant, most: float) -> tuple[str, ...]:
    """One sentence for each named effect that has an owner wrong by a factor of more than `most`."""
    said = []
    for effect in effects:
        factors = [p.name for p in effect_of(effect.name, plant).parameters if is_factor(p)]
        for size in effect.parameters:
            off = size.low > most or size.high < 1.0 / most
            if size.name.rpartition(".")[2] in factors and off:
                said.append(
                    f"{effect_in_words(effect.name, plant.kind)}: {size.value:.3g} times what the description of the "
                    "robot says. Owners are seldom so wrong. It may stand in for physics that has no name here."
                )
    return tuple(sentence[0].upper() + sentence[1:] for sentence in said)


def is_factor(parameter: Parameter) -> bool:
    """Whether a number of an effect multiplies a number of the owner's."""
    return parameter.dimension == "ratio" and parameter.low < parameter.neutral == 1.0 < parameter.high


def _unevenness(recording: Recording) -> float:
    """Standard deviation of the time steps without gaps, relative to the usual one."""
    steps = np.diff(recording.t) * recording.rate
    return float(np.std(steps[recording.missing == 0]))
