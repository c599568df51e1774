"""The diagnosis: nominal model and recordings in, verdict, location, names, numbers and what is open out."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.diagnosis import (
    Alternative,
    Candidate,
    Diagnosis,
    FoundEffect,
    NextExperiment,
    Unexplained,
    Verdict,
)
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import Estimate
from wipx.core.words import effect_in_words
from wipx.diagnosis.curves import law_curve
from wipx.diagnosis.experiment import Question, next_experiment
from wipx.diagnosis.fitting import Fit, Fitter
from wipx.diagnosis.follower import Follower
from wipx.diagnosis.heldout import Transfer, judged, row_likelihoods, transfer
from wipx.diagnosis.hypothesis import Hypothesis, Setting
from wipx.diagnosis.leftover import Leftover, Shape, leftovers, shapes_of
from wipx.diagnosis.location import located
from wipx.diagnosis.log import Log
from wipx.diagnosis.nested import CONTAINS, simpler
from wipx.diagnosis.numbers import bounds, estimates, is_wide
from wipx.diagnosis.observer import NoiseLevels
from wipx.diagnosis.robust import inflation
from wipx.diagnosis.sanity import check_plausible
from wipx.diagnosis.screening import prospects
from wipx.diagnosis.selection import LEAST_GAIN, Selection
from wipx.diagnosis.sentence import FAR_OFF, sentence, times_the_floor
from wipx.diagnosis.stand_in import curve_of, with_curve
from wipx.effects.catalogue import effect_of
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.identify.windows import check_long_enough
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import StateFeedback

HORIZON = 0.5  # [s] of predictions, contract section 4
ALIKE = 3.0  # standard deviations below which recordings do not tell two effects apart
SIGNIFICANT = 1e-4  # p value, corrected, of a leftover
LEFTOVER_GAIN = 20.0  # nats that a leftover must be worth
LEFTOVER_SHARE = 0.02  # and of what is explained
DOUBTFUL = 50.0  # nats below which an effect that does not transfer is dropped
CLOSE_CALL = 60.0  # nats within which a rival is fitted with the noise of the answer too
TOLERATED = 0.05  # by which squared errors of held-out predictions may grow with a fifth effect or a later one
IRRELEVANT = 0.1  # of the noise floor, a change of predictions that does not matter
SHORTEST_HALVED = 2.0  # [s]

Watcher = Callable[[str, float], None]


def in_two(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """Recordings as they are; one alone in two halves, each of which can be held out from the other."""
    if len(recordings) != 1 or recordings[0].duration < SHORTEST_HALVED:
        return recordings
    whole = recordings[0]
    middle = len(whole) // 2
    return (
        replace(whole.rows(0, middle), name=f"{whole.name}, first half"),
        replace(whole.rows(middle, len(whole)), name=f"{whole.name}, second half"),
    )


def unwatched(stage: str, share: float) -> None:
    """A watcher that looks away."""


@dataclass(frozen=True)
class Robot:
    """What a diagnosis knows of a robot beforehand.

    Attributes:
        nominal: What its owner believes.
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        feedback: The controller that closed the loop, and its rate [Hz]; None if unknown.
    """

    nominal: Model
    uncertainty: Mapping[str, float]
    feedback: tuple[StateFeedback, float] | None = None


def diagnose(
    recordings: tuple[Recording, ...],
    robot: Robot,
    simulator: AnalyticSimulator,
    *,
    title: str = "",
    source: str = "robot.yaml",
    lead: float = 0.3,
    rng: np.random.Generator | None = None,
    watcher: Watcher = unwatched,
) -> Diagnosis:
    """Find out what physics a nominal model lacks.

    Args:
        recordings: Of one robot; several with different excitations tell most.
        robot: The nominal model.
        simulator: The engine.
        title: Of the page.
        source: Where the recordings come from.
        lead: Time before a prediction from which its state is estimated [s].
        rng: Draws the excitations of the next experiment; None for always the same.
        watcher: Told the stage and the share that is done.

    Raises:
        InputError: a recording is too short, or the recordings contradict the nominal model grossly.
    """
    begun = time.perf_counter()
    check_long_enough(recordings)
    case = _Case.of(in_two(recordings), robot, simulator, lead)
    watcher("noise of the nominal model", 0.02)
    start = Hypothesis.of(case.setting, (), {})
    nominal = case.fitter.polished(case.fitter.fit(start, case.first_levels))
    selection = Selection(case.fitter, case.setting, nominal, case.transfers)
    watcher("looking for missing effects", 0.1)
    first = selection.extensions(nominal)
    if case.is_driven:
        check_plausible(case.fitter, case.setting, selection.nominal, first[0] if first else nominal, source)
    watcher("looking for combinations", 0.3)
    chosen = selection.run()
    watcher("what is left over", 0.6)
    chosen = case.confirmed(selection, chosen)
    shapes = shapes_of(case.fitter, chosen)
    rest = case.remaining(selection, chosen, shapes)
    watcher("held-out recordings", 0.75)
    answer = case.answer(selection, rest, shapes)
    watcher("next experiment", 0.9)
    proposal = case.proposal(selection, rest.fit, answer, robot.feedback, rng or np.random.default_rng(0))
    answer = replace(answer, next_experiment=proposal)
    watcher("done", 1.0)
    return replace(answer, title=title, source=source, seconds=time.perf_counter() - begun)


@dataclass(frozen=True)
class _Rest:
    """The final fit and what it leaves over."""

    fit: Fit
    strongest: Leftover | None
    p_value: float
    significant: bool
    resembles: tuple[str, ...]
    spread: np.ndarray


@dataclass(frozen=True)
class _Case:
    """Everything that the stages of one diagnosis share."""

    fitter: Fitter
    setting: Setting
    first_levels: NoiseLevels
    judge: Judge
    recordings: tuple[Recording, ...]

    @classmethod
    def of(cls, recordings: tuple[Recording, ...], robot: Robot, simulator: AnalyticSimulator, lead: float) -> "_Case":
        plant = robot.nominal.plant
        log = Log.of(recordings, plant)
        noise = sensor_noise(recordings, plant)
        rates = [_rate_noise(recordings, plant.rates[c - log.joints]) for c in log.channels if c >= log.joints]
        levels = NoiseLevels(np.full(log.joints, 0.01), np.array([*noise, *rates]))
        setting = Setting(robot.nominal, robot.uncertainty, scales_of(robot.nominal, recordings))
        fitter = Fitter(Follower.of(simulator, log, robot.nominal))
        return cls(fitter, setting, levels, Judge(simulator, noise, HORIZON, lead), recordings)

    @property
    def log(self) -> Log:
        """The recordings."""
        return self.fitter.follower.log

    @property
    def is_driven(self) -> bool:
        """Whether any command ever changes."""
        return bool(np.ptp(self.log.inputs.commands, axis=0).max() > 0.0)

    def transfers(self, smaller: Fit, larger: Fit) -> bool:
        """Whether a fit with more effects predicts held-out recordings about as well as one with fewer."""
        return self._heldout_gain(transfer(self.fitter, larger), smaller) > -TOLERATED

    def confirmed(self, selection: Selection, fit: Fit) -> Fit:
        """Without effects that change no prediction to speak of, or do not transfer to held-out recordings."""
        if not fit.effects:
            return fit
        repeated = transfer(self.fitter, fit)
        with_it = self.judge.predict(fit.hypothesis.model, self.recordings)
        for effect in reversed(fit.effects):
            rest = tuple(e for e in fit.effects if e != effect)
            reduced = selection.fitted(rest, fit) if rest else selection.nominal
            without = self.judge.predict(reduced.hypothesis.model, self.recordings)
            change = np.concatenate(with_it) - np.concatenate(without)
            irrelevant = bool(np.all(np.sqrt(np.nanmean(change**2, axis=0)) < IRRELEVANT * self.judge.noise))
            known = row_likelihoods(self.fitter, reduced, reduced.white).sum(axis=1)
            gain = selection.evidence(reduced, fit)
            # An effect that gains much and does not transfer points to something else that is missing.
            lost = float(np.sum(repeated.likelihoods - known)) <= 0.0 and gain < DOUBTFUL
            if irrelevant or lost:
                reason = (
                    "changes no prediction to speak of" if irrelevant else "does not transfer to held-out recordings"
                )
                selection.considered.append(Candidate(effect, gain, False, reason))
                return self.confirmed(selection, reduced)
        return fit

    def remaining(self, selection: Selection, fit: Fit, shapes: list[Shape]) -> _Rest:
        """What the named effects leave over, and a stand-in for it."""
        found = leftovers(self.fitter, fit, shapes)
        strongest = max(found, key=lambda leftover: leftover.gain if leftover.p_value < SIGNIFICANT else 0.0)
        p_value = min(1.0, min(leftover.p_value for leftover in found) * len(shapes))
        explained = fit.motion_likelihood - selection.nominal.motion_likelihood
        worth = max(LEFTOVER_GAIN, LEFTOVER_SHARE * explained)
        significant = p_value < SIGNIFICANT and strongest.gain >= worth
        if not significant and not self._is_far_off(fit):
            return _Rest(fit, None, p_value, False, (), np.zeros(0))
        resembles, named = self._beyond(selection, fit, worth)
        if not significant:
            return _Rest(named or fit, None, p_value, named is not None, resembles, np.zeros(0))
        forces = [leftover for leftover in found if leftover.shape.kind != "resonance"]
        widest = max(forces, key=lambda leftover: leftover.gain)
        stood_in, spread = with_curve(self.fitter, self.setting, fit, widest)
        if named is not None and named.log_likelihood > stood_in.log_likelihood:
            named = self._without_superfluous(selection, named)
            return _Rest(named, strongest, p_value, True, resembles, np.zeros(0))
        for effect in fit.effects:
            if selection.evidence(self._reduced(selection, stood_in, effect), stood_in) < LEAST_GAIN:
                return self.remaining(selection, selection.without(fit, effect), shapes)
        return _Rest(stood_in, widest, p_value, True, resembles, spread)

    def _is_far_off(self, fit: Fit) -> bool:
        """Whether predictions are much worse than sensor noise makes them."""
        errors, _ = self.judge.compare(self.setting.nominal, fit.hypothesis.model, self.recordings, held_out=False)
        return times_the_floor(errors) > FAR_OFF

    def _without_superfluous(self, selection: Selection, fit: Fit) -> Fit:
        """Without effects that one from beyond the vocabulary has made superfluous."""
        for effect in fit.effects[:-1]:
            rest = tuple(e for e in fit.effects if e != effect)
            smaller = selection.fitted(rest, fit)
            if not selection.worthwhile(smaller, fit):
                return self._without_superfluous(selection, smaller)
        return fit

    def _beyond(self, selection: Selection, fit: Fit, worth: float) -> tuple[tuple[str, ...], Fit | None]:
        """Effects beyond the vocabulary that explain what is left, and the fit with the best of them."""
        ranked = prospects(self.fitter, self.setting, fit, beyond=True)
        best: dict[str, Fit] = {}
        for prospect in ranked:
            if prospect.gain < 0.3 * ranked[0].gain or prospect.gain < 0.3 * worth or len(best) == 3:
                break
            if prospect.effect not in best:
                values = {**fit.hypothesis.values, **prospect.values}
                hypothesis = Hypothesis.of(self.setting, (*fit.effects, prospect.effect), values)
                best[prospect.effect] = self.fitter.polished(self.fitter.fit(hypothesis, fit.levels), rounds=2)
        good = {name: found for name, found in best.items() if found.log_likelihood - fit.log_likelihood > worth}
        ordered = sorted(good, key=lambda name: -selection.score(good[name], fit))
        return tuple(ordered), good[ordered[0]] if ordered else None

    def answer(self, selection: Selection, rest: _Rest, shapes: list[Shape]) -> Diagnosis:
        """Everything a person wants to know."""
        nominal, fit = self.setting.nominal, rest.fit
        repeated = transfer(self.fitter, fit)
        held_out, traces = judged(self.judge, nominal, repeated.models, self.recordings)
        fitted, _ = self.judge.compare(nominal, fit.hypothesis.model, self.recordings, held_out=False)
        ends = estimates(self.fitter, fit, selection.nominal)
        effects = self._effects(selection, rest, repeated, ends, shapes)
        verdict: Verdict = "unexplained" if rest.significant else "mismatch" if effects else "consistent"
        unexplained = self._unexplained(rest)
        location = located(self.fitter, selection.nominal, fit, effects, unexplained.site)
        draft = Diagnosis(
            title="",
            source="",
            units=self._units(),
            verdict=verdict,
            sentence="",
            nominal=nominal,
            model=fit.hypothesis.model,
            effects=effects,
            corrected=tuple(e for e in ends if e.name in self.setting.uncertainty),
            location=location,
            fit=fitted,
            held_out=held_out,
            unexplained=unexplained,
            candidates=tuple(selection.considered),
            bounds=bounds(selection.prospects_of(fit), self.log.plant),
            weak=self._weak(effects),
            next_experiment=None,
            traces=traces,
            notes=(),
            seconds=0.0,
        )
        return replace(draft, sentence=sentence(draft))

    def proposal(
        self,
        selection: Selection,
        fit: Fit,
        answer: Diagnosis,
        feedback: tuple[StateFeedback, float] | None,
        rng: np.random.Generator,
    ) -> NextExperiment | None:
        """The experiment that settles what is tied or weak; None where nothing is."""
        tied = [(effect.name, name) for effect in answer.effects for name in effect.equivalent]
        rivals = [
            other
            for effect, name in tied
            for other in selection.replacements(fit, effect)
            if name in other.effects and effect not in other.effects
        ]
        weak = tuple(p.name for effect in answer.effects for p in effect.parameters if is_wide(p))
        if not rivals and not weak:
            return None
        questions = [f"{effect} or {name}" for effect, name in tied] + [f"how large is {name}" for name in weak]
        question = Question(f"Open: {', '.join(questions)}.", tuple(rivals), weak)
        closed, rate = feedback if feedback is not None else (None, self.recordings[0].rate)
        simulator = self.fitter.follower.simulator
        return next_experiment(question, fit, self.setting, self.log, simulator, closed, rate, rng)

    def _units(self) -> dict[str, str]:
        plant = self.log.plant
        return {name: plant.unit_of(name) for name in (*plant.coordinates, *plant.rates, *plant.commands)} | {"t": "s"}

    def _effects(
        self,
        selection: Selection,
        rest: _Rest,
        repeated: Transfer,
        ends: tuple[Estimate, ...],
        shapes: list[Shape],
    ) -> tuple[FoundEffect, ...]:
        fit = rest.fit
        reduced = {effect: self._reduced(selection, fit, effect) for effect in fit.effects}
        gains = {effect: max(selection.evidence(reduced[effect], fit), 0.0) for effect in fit.effects}
        total = sum(gains.values()) or 1.0
        found = []
        for effect in sorted(fit.effects, key=lambda e: -gains[e]):
            law = effect_of(effect, self.log.plant)
            rivals, probability = self._rivals(selection, fit, effect)
            found.append(
                FoundEffect(
                    effect,
                    law.law,
                    law.source,
                    law.beyond,
                    tuple(e for e in ends if e.name.startswith(f"{effect}.")),
                    tuple(rival.name for rival in rivals if rival.separation < ALIKE),
                    rivals,
                    gains[effect],
                    self._heldout_gain(repeated, reduced[effect]),
                    probability,
                    gains[effect] / total,
                    law_curve(self.fitter, self._taken_out(fit, effect), fit, effect, shapes),
                )
            )
        return tuple(found)

    def _reduced(self, selection: Selection, fit: Fit, effect: str) -> Fit:
        """The fit without one effect, its stand-in kept."""
        rest = tuple(e for e in fit.effects if e != effect)
        setting = self._setting_of(fit)
        if setting is self.setting:
            return selection.fitted(rest, fit) if rest else selection.nominal
        hypothesis = Hypothesis.of(setting, rest, fit.hypothesis.values)
        return self.fitter.polished(self.fitter.fit(hypothesis, fit.levels), rounds=2)

    def _taken_out(self, fit: Fit, effect: str) -> Fit:
        """A fit with one effect taken out and all other numbers kept: what it lacks is that effect, nothing else."""
        rest = tuple(e for e in fit.effects if e != effect)
        hypothesis = Hypothesis.of(self._setting_of(fit), rest, fit.hypothesis.values)
        found = self.fitter.fit(hypothesis, fit.levels, steps=0)
        return replace(found, jacobian=found.jacobian[:, :0])

    def _setting_of(self, fit: Fit) -> Setting:
        """The robot, with the stand-in of a fit where it has one."""
        model = fit.hypothesis.space.model
        extra = {
            name: values
            for name, values in model.effects.items()
            if name not in fit.effects and name not in self.setting.nominal.effects
        }
        if not extra:
            return self.setting
        return Setting(self.setting.nominal.with_effects(extra), self.setting.uncertainty, self.setting.scales)

    def _heldout_gain(self, repeated: Transfer, reduced: Fit) -> float:
        """Share of the squared prediction error that an effect removes from recordings it was not fitted to."""
        columns = self.log.plant.coordinates
        with_it = [self.judge.predict(m, (r,))[0] for m, r in zip(repeated.models, self.recordings, strict=True)]
        without = self.judge.predict(reduced.hypothesis.model, self.recordings)
        after = before = 0.0
        for recording, now, then in zip(self.recordings, with_it, without, strict=True):
            recorded = recording.stack(columns)
            after += float(np.nansum(((now - recorded) / self.judge.noise) ** 2))
            before += float(np.nansum(((then - recorded) / self.judge.noise) ** 2))
        return 1.0 - after / before if before > 0.0 else 0.0

    def _rivals(self, selection: Selection, fit: Fit, effect: str) -> tuple[tuple[Alternative, ...], float]:
        """Effects that could stand in the place of one, the closest first, and the probability of its name."""
        overstated = inflation(fit, self.log, fit.hypothesis.parameters_of(effect))
        rivals, weights = [], []
        rest = set(fit.effects) - {effect}
        base = selection.without(fit, effect)
        for other in selection.replacements(fit, effect):
            name = next(iter(set(other.effects) - rest), effect)
            if name == effect or _is_richer(other, name, effect, self.log):
                continue
            if selection.evidence(base, fit) - selection.evidence(base, other) < CLOSE_CALL:
                again = self.fitter.polished(self.fitter.fit(other.hypothesis, fit.levels))
                other = max(other, again, key=lambda found: found.log_likelihood)
            loss = selection.evidence(base, fit) - selection.evidence(base, other)
            values = {k.rpartition(".")[2]: v for k, v in other.hypothesis.values.items() if k.startswith(f"{name}.")}
            rivals.append(Alternative(name, float(np.sqrt(max(2.0 * loss / overstated, 0.0))), values))
            weights.append(np.exp(min(selection.score(other, base) - selection.score(fit, base), 0.0) / overstated))
        rivals.sort(key=lambda rival: rival.separation)
        return tuple(rivals), float(1.0 / (1.0 + sum(weights)))

    def _unexplained(self, rest: _Rest) -> Unexplained:
        beyond = [name for name in rest.fit.effects if effect_of(name, self.log.plant).beyond]
        if rest.significant and beyond:
            words = " and ".join(effect_in_words(name, self.log.plant.kind) for name in beyond)
            return Unexplained(True, rest.p_value, beyond[0].partition("/")[0], words, rest.resembles, None)
        if not rest.significant or rest.strongest is None:
            return Unexplained(False, rest.p_value, None, "", (), None)
        shape = rest.strongest.shape
        site = self.log.plant.joints[shape.joint]
        words = {
            "force": f"a force over {shape.signal} on {site}",
            "gain": "an actuator gain that drifts over time",
            "friction": f"dry friction on {site} that changes with {shape.signal}",
            "resonance": f"something that swings with {site} at about {shape.signal} Hz",
        }[shape.kind]
        curve = curve_of(shape, rest.fit, rest.spread, self.log) if len(rest.spread) else None
        return Unexplained(True, rest.p_value, site, words, rest.resembles, curve)

    def _weak(self, effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
        found = []
        for effect in effects:
            for p in effect.parameters:
                if is_wide(p):
                    found.append(f"{p.name} is known to {p.low:.3g} ... {p.high:.3g} {p.unit} only")
            for name in effect.equivalent:
                found.append(f"{effect.name} cannot be told from {name}")
        return tuple(found)


def _rate_noise(recordings: tuple[Recording, ...], column: str) -> float:
    """Standard deviation of a recorded rate's noise, by second differences."""
    values = np.concatenate([np.diff(r[column], 2) for r in recordings])
    return max(1.4826 * float(np.median(np.abs(values))) / np.sqrt(6.0), 1e-9)


def _is_richer(other: Fit, name: str, effect: str, log: Log) -> bool:
    """Whether a rival is the same law with more to it that is not needed."""
    contained = f"{name.partition('/')[0]}/{CONTAINS.get(name.partition('/')[2])}"
    replaced = simpler(other, log)
    return contained == effect or (replaced is not None and effect in replaced)
