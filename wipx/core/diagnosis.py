"""The result of a diagnosis: the type that `wipx.diagnose` returns, tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from wipx.core.curve import Curve
from wipx.core.location import Location
from wipx.core.model import Model
from wipx.core.next_experiment import NextExperiment
from wipx.core.remainder import Remainder, Unexplained
from wipx.core.results import Estimate, FitErrors, Trace
from wipx.core.suspect import Suspect, Unnamed

Verdict = Literal["consistent", "mismatch", "unexplained"]


@dataclass(frozen=True)
class Alternative:
    """Another effect in the place of one that was found.

    Attributes:
        name: "site/kind".
        separation: How far the recordings are from it, in standard deviations.
        parameters: Its values if it were the one, by symbol [SI].
    """

    name: str
    separation: float
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Combined:
    """One law that the vocabulary lacks in the place of several effects that were found.

    Attributes:
        name: "site/kind".
        instead_of: The effects.
        lead: Penalised log-likelihood that it has beyond theirs [nats]; about zero where recordings cannot tell.
        parameters: Its values if it were the one, by symbol [SI].
    """

    name: str
    instead_of: tuple[str, ...]
    lead: float
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class FoundEffect:
    """Physics that was left out.

    Attributes:
        name: "site/kind".
        law: Its equation.
        source: Paper or book.
        outside_vocabulary: Whether the vocabulary of contract section 3 lacks it.
        parameters: Its numbers with 95 % intervals.
        equivalent: Effects that these recordings cannot tell from it.
        rivals: Other effects in its place, the closest first; `equivalent` among them.
        log_evidence_gain: Log-likelihood that it adds, in nats, beside the other effects.
        heldout_gain: Share of the squared prediction error on recordings it was not fitted to that it removes.
        present_probability: Of this name among those that could stand in its place.
        share: Of the explained mismatch.
        curve: Its law on the data; None where a curve over one signal does not show it.
        unnamed: Why it is in the completed model, but not named; None for an effect that is named.
    """

    name: str
    law: str
    source: str
    outside_vocabulary: bool
    parameters: tuple[Estimate, ...]
    equivalent: tuple[str, ...]
    rivals: tuple[Alternative, ...]
    log_evidence_gain: float
    heldout_gain: float
    present_probability: float
    share: float
    curve: Curve | None
    unnamed: Unnamed | None = None

    def value(self, symbol: str) -> float:
        """Its number of that symbol [SI]."""
        return next(p.value for p in self.parameters if p.name == f"{self.name}.{symbol}")


@dataclass(frozen=True)
class ConsideredEffect:
    """An effect, or several, that was considered.

    Attributes:
        name: "site/kind", joined by " + ".
        gain: Log-likelihood over the model it was compared with, in nats.
        chosen: Whether it is part of the answer.
        reason: Why or why not, in words.
    """

    name: str
    gain: float
    chosen: bool
    reason: str


@dataclass(frozen=True)
class Bound:
    """How large an effect that was not found could be at most.

    Attributes:
        name: "site/kind.symbol" of the number that measures it.
        low: Lower end of the 95 % interval [unit].
        high: Upper end.
        unit: SI unit.
    """

    name: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Diagnosis:
    """The answer: is physics missing, where, which, how much, and what is still open.

    Attributes:
        title: Of the page, e.g. the dataset's name.
        source: Folder of the recordings.
        units: SI unit by column, rates and commands included.
        verdict: Contract section 5.
        sentence: The answer in one sentence.
        nominal: The model before.
        model: The completed model.
        effects: What was left out, the largest first.
        corrected: Uncertain nominal numbers and what they became.
        location: Where the mismatch is.
        fit: Prediction errors on the recordings that were fitted.
        held_out: The same, each recording predicted by a model that was fitted to the others.
        unexplained: What is left over.
        candidates: What was considered, in the order of the search.
        bounds: How large effects that were not found could be.
        weak: What these recordings cannot say, one sentence each.
        next_experiment: What to record next; None where nothing is open or the loop cannot be simulated.
        traces: Recordings beside predictions, held-out ones first.
        notes: Warnings a reader must know, one sentence each.
        seconds: That the diagnosis took.
        combined: Laws that the vocabulary lacks and that explain several of the effects at once as well.
        suspects: Hypotheses that were tested after the answer was complete, and what these recordings say of them.
        remainder: What the completed model leaves; None if it was not computed.
        minor: Effects of the completed model that are not named.
    """

    title: str
    source: str
    units: Mapping[str, str]
    verdict: Verdict
    sentence: str
    nominal: Model
    model: Model
    effects: tuple[FoundEffect, ...]
    corrected: tuple[Estimate, ...]
    location: Location
    fit: FitErrors
    held_out: FitErrors
    unexplained: Unexplained
    candidates: tuple[ConsideredEffect, ...]
    bounds: tuple[Bound, ...]
    weak: tuple[str, ...]
    next_experiment: NextExperiment | None
    traces: tuple[Trace, ...]
    notes: tuple[str, ...]
    seconds: float
    combined: tuple[Combined, ...] = ()
    suspects: tuple[Suspect, ...] = ()
    remainder: Remainder | None = None
    minor: tuple[FoundEffect, ...] = ()
