"""The result of a diagnosis: the type that `wipx.diagnose` returns, tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wipx.core.model import Model
from wipx.core.results import Estimate, FitErrors, Trace

Verdict = Literal["consistent", "mismatch", "unexplained"]


@dataclass(frozen=True)
class Curve:
    """A force over one signal, with what the recordings themselves say of it.

    Attributes:
        quantity: What the ordinate shows, in a word or two, e.g. "torque".
        signal: Column or rate on the abscissa, e.g. "x_dot".
        signal_unit: Its SI unit.
        force_unit: SI unit of the ordinate.
        at: Abscissa of the law, shape (N,).
        law: The law there, shape (N,) [force_unit].
        bins: Abscissa of the data's own estimate, shape (B,).
        force: Force that the recordings need beside the rest of the model, mean of each bin, shape (B,).
        spread: Standard error of each mean, shape (B,).
    """

    quantity: str
    signal: str
    signal_unit: str
    force_unit: str
    at: np.ndarray
    law: np.ndarray
    bins: np.ndarray
    force: np.ndarray
    spread: np.ndarray


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

    def value(self, symbol: str) -> float:
        """Its number of that symbol [SI]."""
        return next(p.value for p in self.parameters if p.name == f"{self.name}.{symbol}")


@dataclass(frozen=True)
class Region:
    """An interval of a signal that holds much of the mismatch.

    Attributes:
        signal: Column, rate or command.
        low: Lower end [SI].
        high: Upper end.
        share: Of the excess error that lies inside.
    """

    signal: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class Period:
    """A stretch of time that holds much of the mismatch of a recording.

    Attributes:
        recording: Its name.
        low: Begin [s].
        high: End [s].
        share: Of that recording's excess error that lies inside.
    """

    recording: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class ErrorMap:
    """Where the nominal model is wrong: excess of its squared innovations over what the completed model leaves.

    Attributes:
        signals: Names of abscissa and ordinate.
        units: Their units.
        edges: Bin edges of both, shapes (A + 1,) and (B + 1,).
        excess: Mean excess per row and bin, shape (A, B) [nats]; NaN where the robot never was.
        runs: Names of the recordings.
        times: Middle of the time bins of each recording [s].
        along: Mean excess per row in these bins, one array per recording [nats].
    """

    signals: tuple[str, str]
    units: tuple[str, str]
    edges: tuple[np.ndarray, np.ndarray]
    excess: np.ndarray
    runs: tuple[str, ...]
    times: tuple[np.ndarray, ...]
    along: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Location:
    """Where the mismatch is.

    Attributes:
        sites: Share by site; they sum to one, empty where nothing is missing.
        regions: Intervals of the state space.
        times: Stretches of time.
        map: For the picture; None where nothing is missing.
    """

    sites: Mapping[str, float]
    regions: tuple[Region, ...]
    times: tuple[Period, ...]
    map: ErrorMap | None


@dataclass(frozen=True)
class Unexplained:
    """What the named effects leave over.

    Attributes:
        significant: Whether something is.
        p_value: Of the strongest residual force if nothing were left, corrected for the number of tests.
        site: Joint at which it acts; None where nothing is significant.
        shape: What it looks like, in words, e.g. "a force over x_dot"; empty where nothing is significant.
        resembles: Effects beyond the vocabulary that would explain it.
        curve: The nonparametric force that was fitted in its place; None without one.
    """

    significant: bool
    p_value: float
    site: str | None
    shape: str
    resembles: tuple[str, ...]
    curve: Curve | None


@dataclass(frozen=True)
class LeftForce:
    """The force on a joint that the completed model lacks.

    Attributes:
        site: The joint.
        size: Root mean square [unit].
        unit: "N" or "N m".
        lasting: Time in which its correlation with itself falls to 1/e [s].
        kind: What it is like: "law" over a signal, "periodic" in a coordinate, "swing" at a frequency, "gain" of a
            command that drifts, or "random".
        signal: Of which; None for a random force.
        period: In the signal's unit, of a periodic force or a swing; None for others.
        share: Of its variance that goes with the signal, on stretches of time that it was not fitted to.
    """

    site: str
    size: float
    unit: str
    lasting: float
    kind: str
    signal: str | None
    period: float | None
    share: float


@dataclass(frozen=True)
class HorizonErrors:
    """Errors of predictions some time after their start, on held-out recordings.

    Attributes:
        horizon: That time [s].
        nominal: Root mean square errors of the nominal model by column.
        completed: Those of the completed model.
    """

    horizon: float
    nominal: Mapping[str, float]
    completed: Mapping[str, float]


@dataclass(frozen=True)
class Remainder:
    """How much of the mismatch the completed model leaves, and what it looks like.

    Attributes:
        share_gone: Share of the squared prediction error above the sensors' floor that is gone, on held-out recordings.
        times_floor: Error that stays as a multiple of the sensors' floor, by column.
        matters: Whether it matters for predictions of half a second.
        horizons: Errors by time since the start of a prediction.
        forces: On each joint.
    """

    share_gone: float
    times_floor: Mapping[str, float]
    matters: bool
    horizons: tuple[HorizonErrors, ...]
    forces: tuple[LeftForce, ...]


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
class Experiment:
    """An excitation, and how well it would tell apart what these recordings leave open.

    Attributes:
        name: Of the menu, e.g. "multisine".
        how: What a person does, one sentence.
        separation: Standard deviations by which it would separate the open question.
    """

    name: str
    how: str
    separation: float


@dataclass(frozen=True)
class NextExperiment:
    """What to record next.

    Attributes:
        question: What is open, one sentence.
        best: The excitation that settles it best.
        menu: All that were simulated, the best first.
        reference: Columns of the file that the controller can run: t and x_ref or theta_ref, or u; empty where
            the experiment needs none.
        release: Coordinate of the last joint from which the robot is released [rad, or m without a pitch].
        mass: Known mass that is added to the body [kg].
        repeats: How often it is to be done.
    """

    question: str
    best: Experiment
    menu: tuple[Experiment, ...]
    reference: Mapping[str, np.ndarray]
    release: float = 0.0
    mass: float = 0.0
    repeats: int = 1


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
        minor: Whether it is part of the answer, but too small to be named.
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
    minor: bool = False

    @property
    def supported(self) -> bool:
        """Whether the recordings speak for the effect: it is named, or gains what it needs."""
        return self.named or self.log_evidence_gain >= self.required_gain


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
        minor: Effects of the completed model that are too small beside what no law describes to be named.
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
