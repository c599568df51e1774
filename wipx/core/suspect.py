"""What recordings say of an effect that the user suspects."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from wipx.core.results import Estimate

Unnamed = Literal["small", "everywhere", "unproven"]  # why an effect of a completed model is not named


@dataclass(frozen=True)
class SuspectedSize:
    """A suspect with the suspected size, all other numbers refitted.

    Attributes:
        values: What was suspected, by symbol [SI].
        loss: Nats by which the answer is better; negative where the answer is worse.
        loss_to_free: Nats by which the same effect with a free size is better.
        against_free: Whether the free size decides: the answer names the effect or has another in its place, or the
            effect gains enough to be named. Otherwise the answer without the effect decides.
        limit: Nats of loss, to the one that decides, from which the size is excluded.
        excluded: Whether the recordings exclude the size, by 95 %.
        error_ratio: Prediction error on recordings it was not fitted to, over that of the answer.
    """

    values: Mapping[str, float]
    loss: float
    loss_to_free: float
    against_free: bool
    limit: float
    excluded: bool
    error_ratio: float


@dataclass(frozen=True)
class Suspect:
    """An effect that the user suspects, fitted beside the effects of the answer.

    Attributes:
        name: "site/kind".
        named: Whether it is part of the answer.
        in_place_of: Effects of the answer in whose place it was fitted: they cannot stand beside it.
        parameters: Its numbers, if they are free, with 95 % intervals.
        log_evidence_gain: Log-likelihood that it adds then to the other effects, in nats.
        required_gain: Nats that it needs to be named.
        heldout_gain: Share of the squared prediction error on recordings it was not fitted to that it removes then.
        transfers: Whether it makes recordings likelier that it was not fitted to.
        loss: Nats by which the answer is better than with this effect; zero or less unless it is `in_place_of` others.
        size: Result for the suspected size; None if none was given.
        sentence: All of it in words.
        unnamed: Why it is in the completed model, but not named; None where it is named, or not in the model.
    """

    name: str
    named: bool
    in_place_of: tuple[str, ...]
    parameters: tuple[Estimate, ...]
    log_evidence_gain: float
    required_gain: float
    heldout_gain: float
    transfers: bool
    loss: float
    size: SuspectedSize | None
    sentence: str = ""
    unnamed: Unnamed | None = None

    @property
    def supported(self) -> bool:
        """Whether the recordings speak for the effect: it is named, or gains what it needs."""
        return self.named or self.log_evidence_gain >= self.required_gain
