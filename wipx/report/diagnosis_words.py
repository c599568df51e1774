"""A diagnosis in sentences and short texts, which page, terminal and `diagnosis.json` share."""

import math
from collections.abc import Mapping
from types import MappingProxyType

from wipx.core.diagnosis import Combined, Diagnosis, FoundEffect
from wipx.core.location import Period, Region
from wipx.core.next_experiment import NextExperiment
from wipx.core.remainder import LeftForce
from wipx.core.results import Estimate
from wipx.core.suspect import Unnamed
from wipx.effects.words import effect_in_words, in_a_row, site_in_words
from wipx.report.numbers import MISSING, compact, significant, with_interval

VERDICTS = MappingProxyType(
    {
        "consistent": "Consistent: nothing is missing",
        "mismatch": "Mismatch: physics is missing",
        "unexplained": "Unexplained: known effects are not enough",
    }
)
PLANTS = MappingProxyType(
    {
        "wip": "wheeled inverted pendulum",
        "cartpole": "cart-pole",
        "pendulum": "pendulum",
        "linear_axis": "linear axis",
        "double_pendulum": "double pendulum",
        "robot": "robot from a model file",
    }
)
UNNAMED: Mapping[Unnamed, str] = MappingProxyType(
    {
        "unproven": "Predictions are better with {them}, but that may be chance, or the work of other effects.",
        "small": "Predictions hardly need {them}: what is so small may be a part of what no law describes.",
        "everywhere": "Nearly every machine has a little of {them}, and predictions are better with {them}.",
    }
)  # why effects of the completed model are not named
SURE = 0.999  # probabilities beyond are not told apart
NO_CHANCE = 1e-3  # probability of chance below which something is certain, though it may be small


def capitalised(text: str) -> str:
    """A text with its first letter in upper case, the others as they are."""
    return text[:1].upper() + text[1:]


def percent(share: float) -> str:
    """A share in per cent, e.g. "81 %"; a dash where there is none."""
    if not math.isfinite(share):
        return MISSING
    text = f"{100.0 * share:.0f}" if abs(share) >= 0.0995 or share == 0.0 else f"{100.0 * share:.1f}"
    return f"{text} %"


def probability(value: float) -> str:
    """A probability in per cent that never claims certainty; a dash where there is none."""
    if not math.isfinite(value):
        return MISSING
    if value > SURE:
        return f"> {100.0 * SURE:.1f} %"
    return f"{100.0 * value:.1f} %" if value >= 1.0 - SURE else f"< {100.0 * (1.0 - SURE):.1f} %"


def nats(value: float) -> str:
    """A log-likelihood with the digits that matter: no more than one decimal; a dash where there is none."""
    if not math.isfinite(value):
        return MISSING
    return f"{value:.0f}" if abs(value) >= 99.95 else f"{round(value, 1) + 0.0:.1f}"


def p_value(value: float) -> str:
    """A p value, e.g. "p = 0.31"; empty where there is none."""
    if not math.isfinite(value):
        return ""
    return f"p = {significant(value, 2)}" if value >= 1e-4 else "p < 0.0001"


def symbol_of(name: str) -> str:
    """The symbol in the name "site/kind.symbol" of a number."""
    return name.rpartition(".")[2] if "/" in name else name


def value_in_words(estimate: Estimate) -> str:
    """A number, its unit, its 95 % interval and how it moves, e.g. "F_c = 3.10 N [2.93, 3.29]"."""
    unit = "" if estimate.unit == "1" else f" {estimate.unit}"
    return f"{symbol_of(estimate.name)} = {shown_value(estimate)}{unit} {shown_interval(estimate)}{_moving(estimate)}"


def _moving(estimate: Estimate) -> str:
    """From where to where a number moves from run to run."""
    if estimate.from_run_to_run is None:
        return ""
    low, high = estimate.from_run_to_run
    return f", {compact(low)} to {compact(high)} from run to run"


def shown_value(estimate: Estimate) -> str:
    """The value with the digits that its interval leaves meaningful."""
    return with_interval(estimate.value, estimate.low, estimate.high).value


def shown_interval(estimate: Estimate) -> str:
    """The 95 % interval in brackets; words where an end is unknown."""
    if not (math.isfinite(estimate.low) and math.isfinite(estimate.high)):
        return "(not determined)"
    return with_interval(estimate.value, estimate.low, estimate.high).ends


def values_in_words(parameters: Mapping[str, float]) -> str:
    """Values by symbol, e.g. "F_c = 3.1, v_s = 0.05"; SI units."""
    return ", ".join(f"{symbol} = {compact(value)}" for symbol, value in parameters.items())


def tie_sentence(effect: FoundEffect, plant_kind: str) -> str:
    """What these recordings cannot tell an effect from; empty where there is nothing."""
    if not effect.equivalent:
        return ""
    others = " or ".join(effect_in_words(name, plant_kind) for name in effect.equivalent)
    return f"These recordings cannot tell {effect_in_words(effect.name, plant_kind)} from {others}."


def minor_sentence(diagnosis: Diagnosis) -> str:
    """What the completed model has beside the named effects; empty where there is nothing."""
    kind = diagnosis.model.plant.kind

    def told(effects: list[FoundEffect]) -> str:
        numbers = [", ".join(value_in_words(number) for number in effect.parameters) for effect in effects]
        laws = [f"{effect_in_words(each.name, kind)} ({own})" for each, own in zip(effects, numbers, strict=True)]
        return in_a_row(laws)

    sentences: list[str] = []
    for why, because in UNNAMED.items():
        effects = [effect for effect in diagnosis.minor if effect.unnamed == why]
        if effects:
            is_one = len(effects) == 1
            begin = "The model also has" if sentences else "Also in the completed model:"
            sentences.append(f"{begin} {told(effects)}. {because.format(them='it' if is_one else 'them')}")
    return " ".join(sentences)


def combined_sentence(law: Combined, plant_kind: str) -> str:
    """That several effects may be one law which the vocabulary lacks."""
    effects = " and ".join(effect_in_words(name, plant_kind) for name in law.instead_of)
    one = f"{effect_in_words(law.name, plant_kind)} ({values_in_words(law.parameters)})"
    return f"{capitalised(effects)} may be one: {one}; these recordings cannot tell."


def region_sentence(region: Region, units: Mapping[str, str]) -> str:
    """Where in the state space much of the mismatch is."""
    unit = units.get(region.signal, "")
    interval = _interval(region.low, region.high, unit)
    return f"{percent(region.share)} of the excess error lies where {region.signal} is {interval}."


def period_sentence(period: Period) -> str:
    """When much of the mismatch of a recording is."""
    return (
        f"{percent(period.share)} of the excess error of {period.recording} lies at times "
        f"{_interval(period.low, period.high, 's')}."
    )


def unexplained_sentence(diagnosis: Diagnosis) -> str:
    """What the named effects leave over, in one or two sentences."""
    left = diagnosis.unexplained
    chance = p_value(left.p_value)
    aside = f" ({chance})" if chance else ""
    if not left.significant and left.p_value < NO_CHANCE:
        return f"What is left over is not chance, but too small to be named{aside}."
    if not left.significant:
        return f"Nothing significant is left over{aside}."
    kind = diagnosis.model.plant.kind
    place = f" at {site_in_words(left.site, kind)}" if left.site else ""
    shape = f": {left.shape}" if left.shape else ""
    grade = "It matters for predictions." if is_grave(diagnosis) else "It is small: predictions hardly suffer."
    sentence = f"A part is left over{place}{aside} that no effect of the vocabulary explains{shape}. {grade}"
    named = {effect.name for effect in diagnosis.effects}
    others = [effect_in_words(name, kind) for name in left.resembles if name not in named]
    if others:
        sentence += f" It resembles {' or '.join(others)}, which the vocabulary does not have."
    return sentence


def is_grave(diagnosis: Diagnosis) -> bool:
    """Whether what is left over matters for predictions."""
    return diagnosis.remainder is None or diagnosis.remainder.matters


def remainder_sentences(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What the completed model leaves on each joint, one sentence each."""
    if diagnosis.remainder is None:
        return ()
    kind = diagnosis.model.plant.kind
    return tuple(
        f"On {site_in_words(force.site, kind)} a force of {compact(force.size, 2)} {force.unit} (root mean square) "
        f"stays, correlated over {compact(force.lasting, 2)} s; {_goes_with(force, diagnosis)}."
        for force in diagnosis.remainder.forces
    )


def _goes_with(force: LeftForce, diagnosis: Diagnosis) -> str:
    """What a force that is left goes with."""
    if force.kind == "random" or force.signal is None:
        return "it goes with no signal, turn or period, and may be random"
    share = f"{percent(force.share)} of it"
    unit = diagnosis.units.get(force.signal, "")
    if force.kind == "law":
        return f"{share} goes with {force.signal}"
    if force.kind == "gain":
        return f"{share} follows {force.signal} with a gain that drifts"
    assert force.period is not None
    if force.kind == "swing":
        return f"{share} swings at {compact(1.0 / force.period, 2)} Hz"
    return f"{share} comes again every {compact(force.period, 3)} {unit} of {force.signal}{_turns(force, diagnosis)}"


def _turns(force: LeftForce, diagnosis: Diagnosis) -> str:
    """How often that is in a turn of the wheel; empty where there is no wheel."""
    radius = diagnosis.model.parameters.get("wheel_radius")
    if radius is None or force.signal != "x" or not force.period:
        return ""
    return f", {compact(2.0 * math.pi * radius / force.period, 2)} times in a turn of the wheel"


def next_step(following: NextExperiment | None) -> str | None:
    """What to record next and why, as text; None where nothing is open."""
    if following is None:
        return None
    return f"{_ended(following.question)} {_ended(following.best.how)}"


def _interval(low: float, high: float, unit: str) -> str:
    after = f" {unit}" if unit else ""
    if not math.isfinite(low):
        return f"below {compact(high, 3)}{after}"
    if not math.isfinite(high):
        return f"above {compact(low, 3)}{after}"
    return f"between {compact(low, 3)} and {compact(high, 3)}{after}"


def _ended(sentence: str) -> str:
    return sentence if sentence.endswith((".", "?", "!")) else f"{sentence}."
