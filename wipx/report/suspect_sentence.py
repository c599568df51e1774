"""What the recordings say of a suspect, in words."""

from collections.abc import Mapping

from wipx.core.suspect import Suspect, SuspectedSize, Unnamed
from wipx.report.diagnosis_words import nats, symbol_of, value_in_words
from wipx.report.numbers import compact, significant

NOTHING = 0.05  # nats that are not told from none
STANDING: Mapping[Unnamed | None, str] = {
    None: "named",
    "small": "in the completed model, but too small to be named",
    "everywhere": "in the completed model, but every machine has a little of it",
    "unproven": "in the completed model, but not proven",
}
AS_GOOD = 0.05  # relative change of the held-out error that is not told from none


def suspect_sentence(suspect: Suspect, *, unexplained: bool) -> str:
    """One sentence: the free size and its evidence, then the verdict on the suspected size.

    Args:
        suspect: What was found; its own `sentence` is not read.
        unexplained: Whether the answer leaves something over, so that no exclusion is final.
    """
    parts = [f"{suspect.name}: {_free_size(suspect)}"]
    if not suspect.named and not suspect.transfers:
        parts.append("does not transfer to held-out recordings")
    if suspect.size is not None:
        parts.append(_suspected_size(suspect, suspect.size, unexplained=unexplained))
    elif not suspect.supported:
        parts.append("too little to be named")
    return "; ".join(parts) + "."


def _free_size(suspect: Suspect) -> str:
    numbers = ", ".join(map(value_in_words, suspect.parameters))
    if suspect.named:
        return f"{STANDING[suspect.unnamed]}, {numbers}"
    gain = f"gain {nats(suspect.log_evidence_gain)} nats of the {nats(suspect.required_gain)} needed"
    if suspect.supported:
        gain = f"gain {nats(suspect.log_evidence_gain)} nats, enough to be named ({nats(suspect.required_gain)} needed)"
    if not suspect.in_place_of:
        return f"would be {numbers} and {gain}"
    others = " and ".join(suspect.in_place_of)
    return f"in the place of {others} would be {numbers} and {gain}, {_compared(suspect.loss, 'the answer')}"


def _suspected_size(suspect: Suspect, size: SuspectedSize, *, unexplained: bool) -> str:
    """The verdict on the suspected size, compared with the model that decides."""
    units = {symbol_of(number.name): "" if number.unit == "1" else f" {number.unit}" for number in suspect.parameters}
    values = ", ".join(f"{symbol} = {compact(value)}{units[symbol]}" for symbol, value in size.values.items())
    loss, other = (size.loss_to_free, "that size") if size.against_free else (size.loss, "the answer")
    compared = f"{values} is {_compared(loss, other)}"
    if size.excluded:
        doubt = ", if nothing else is missing" if unexplained else ""
        none = ", which has none of it" if size.against_free and not suspect.named and not suspect.in_place_of else ""
        return f"{compared}: excluded{doubt}, {'but ' if _is_as_good(size) else ''}{_error(size)}{none}"
    if suspect.supported:
        return f"{compared}: the size agrees"
    if not size.against_free and size.loss_to_free > size.limit:
        compared += f" and {_compared(size.loss_to_free, 'that size')}"
    if size.loss < -size.limit:
        return f"{compared}: it fits better, but gains too little to be named, {_error(size)}"
    limit = f"{nats(size.limit)} would exclude it"
    return f"{compared} ({limit}): these recordings neither show nor exclude it, {_error(size)}"


def _compared(loss: float, other: str) -> str:
    """A difference of log-likelihoods from another model."""
    if abs(loss) < NOTHING:
        return f"as good as {other}"
    return f"{nats(abs(loss))} nats {'worse' if loss > 0.0 else 'better'} than {other}"


def _error(size: SuspectedSize) -> str:
    if _is_as_good(size):
        return "held-out predictions are as good as the answer's"
    return f"held-out error {significant(size.error_ratio, 2)} times that of the answer"


def _is_as_good(size: SuspectedSize) -> bool:
    return abs(size.error_ratio - 1.0) < AS_GOOD
