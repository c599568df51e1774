"""The answer put together: effects with numbers and rivals, what is unexplained or weak, and what to record next."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wipx.core.diagnosis import Alternative, Combined, ConsideredEffect, Diagnosis, FoundEffect, Verdict
from wipx.core.limits import JointLimits
from wipx.core.model import Model
from wipx.core.next_experiment import NextExperiment
from wipx.core.remainder import Remainder, Unexplained
from wipx.core.results import Estimate, FitErrors, Trace
from wipx.diagnosis.answer.combined_laws import combined
from wipx.diagnosis.answer.law_curves import law_curve
from wipx.diagnosis.answer.location import located
from wipx.diagnosis.candidates.stand_ins import CLOSE_SHARE
from wipx.diagnosis.decision.confirmation import Rest
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.decision.estimates import bounds, estimates, is_wide
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.held_out import Transfer, judged, transfer
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import inflation
from wipx.diagnosis.next_experiment.choice import Question, next_experiment
from wipx.diagnosis.residuals.discrepancy import curve_of
from wipx.diagnosis.residuals.remaining_forces import horizon_errors, left_forces
from wipx.diagnosis.residuals.residual_tests import Shape
from wipx.diagnosis.selection.criteria import evidence, score
from wipx.diagnosis.selection.nested_laws import reduced_effects, simple_law
from wipx.diagnosis.selection.search import Search
from wipx.effects.catalogue import effect_of
from wipx.effects.words import effect_in_words, in_a_row, site_in_words
from wipx.report.diagnosis_sentence import sentence
from wipx.sim.simulator import StateFeedback


def answered(context: Context, search: Search, rest: Rest, shapes: list[Shape]) -> Diagnosis:
    """Everything a person wants to know."""
    nominal, fit, rules = context.setting.nominal, rest.fit, context.rules
    repeated = transfer(context.fitter, fit)
    judge = context.judge_of(fit)
    trusted = judge.tuned(nominal, context.recordings)
    # where nothing is named, predictions learn how far to trust the model, as those of the nominal one do
    model = replace(fit.hypothesis.model, bandwidths=(judge.bandwidths or {}) if fit.effects else nominal.bandwidths)
    held_out, traces = judged(judge, trusted, repeated.models, context.recordings)
    fitted, _ = judge.compare(trusted, model, context.recordings, held_out=False)
    ends = estimates(context.fitter, fit, search.nominal)
    effects, minor = _effects(context, search, rest, repeated, ends, shapes)
    unruly = context.unruly_joints(fit)
    wrong = not context.is_quiet(fit) or context.is_worse(fit) or bool(unruly)
    far = fitted.times_the_floor > rules.trust.near_floor
    left, matters = rest.significant or (far and wrong), far and (rest.significant or wrong)
    verdict: Verdict = "unexplained" if left else "mismatch" if effects else "consistent"
    unexplained = replace(_unexplained(context, rest, unruly), significant=left)
    parts = search.split(fit)
    laws = [combined(context.beside(part), part, own) for part, own in parts] if not rest.significant else []
    as_one = tuple(law for of_part in laws for law in of_part)
    before, after = (context.fitter.seen_by_row(each)[1] for each in (search.nominal, fit))
    location = located(context.by_row, before, after, effects, unexplained.site)
    draft = Diagnosis(
        title="",
        source="",
        units=_units(context),
        verdict=verdict,
        sentence="",
        nominal=nominal,
        model=model,
        effects=effects,
        corrected=tuple(e for e in ends if e.name in context.setting.uncertainty),
        location=location,
        fit=fitted,
        held_out=held_out,
        unexplained=unexplained,
        candidates=tuple(_in_hindsight(candidate, effects) for candidate in rest.considered),
        bounds=bounds(search.store.candidates_for(fit), context.data.plant),
        weak=(*_weak(effects, rules.answer.wide), *_as_one(as_one, nominal.plant.kind)),
        next_experiment=None,
        traces=traces,
        notes=(),
        seconds=0.0,
        combined=as_one,
        remainder=_remainder(context, model, held_out, traces, matters=matters),
        minor=minor,
    )
    return replace(draft, sentence=sentence(draft))


def _remainder(
    context: Context, model: Model, held_out: FitErrors, traces: tuple[Trace, ...], *, matters: bool
) -> Remainder:
    """How much stays, and what it looks like."""
    floors = {name: max(floor, 1e-15) for name, floor in held_out.noise_floor.items()}
    return Remainder(
        held_out.explained_share,
        {name: held_out.completed[name] / floor for name, floor in floors.items()},
        matters,
        horizon_errors(traces),
        left_forces(
            context.by_row.simulator, context.data, context.judge.noise, model, context.rules.residuals.telling
        ),
    )


def _in_hindsight(candidate: ConsideredEffect, effects: tuple[FoundEffect, ...]) -> ConsideredEffect:
    """A candidate, chosen only if it is still part of the answer."""
    named = {effect.name for effect in effects}
    return replace(candidate, chosen=candidate.chosen and set(candidate.name.split(" + ")) <= named)


def _effects(
    context: Context,
    search: Search,
    rest: Rest,
    repeated: Transfer,
    ends: tuple[Estimate, ...],
    shapes: list[Shape],
) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """Effects that are named, and those that are not."""

    def told(piece: tuple[Search, Fit]) -> list[FoundEffect]:
        part, own = piece
        again = repeated if own is rest.fit else transfer(part.store.fitter, own)
        return _effects_of_part(context.beside(part), part, replace(rest, fit=own), again, ends, shapes)

    parts = context.fitter.simulator.side_by_side(told, search.split(rest.fit, with_stand_ins=True))
    found = sorted((effect for part in parts for effect in part), key=lambda effect: -effect.log_evidence_gain)
    named = [effect for effect in found if effect.unnamed is None]
    total = sum(effect.log_evidence_gain for effect in named) or 1.0
    shared = tuple(replace(effect, share=effect.log_evidence_gain / total) for effect in named)
    return shared, tuple(effect for effect in found if effect.unnamed is not None)


def _effects_of_part(
    context: Context,
    search: Search,
    rest: Rest,
    repeated: Transfer,
    ends: tuple[Estimate, ...],
    shapes: list[Shape],
) -> list[FoundEffect]:
    """What is told of the effects of a part, in their order; their shares are left open.

    Named ones have rivals, beside what is proven: an unproven effect may be one of them.
    """
    found, fit = [], rest.fit
    proven = search.store.reduced(fit, *rest.unproven) if rest.unproven else fit
    for effect in fit.effects:
        reduced = search.store.reduced(fit, effect)
        law = effect_of(effect, context.data.plant)
        rivals, probability = ((), 1.0) if rest.unnamed(effect) else _rivals(context, search, proven, effect)
        found.append(
            FoundEffect(
                effect,
                law.law,
                law.source,
                law.is_outside(context.data.plant),
                tuple(e for e in ends if e.name.startswith(f"{effect}.")),
                tuple(rival.name for rival in rivals if rival.separation < context.rules.answer.told_apart),
                rivals,
                max(evidence(reduced, fit), 0.0),
                context.held_out.gain(context.fitter, repeated, reduced),
                probability,
                0.0,
                law_curve(*context.fitter.seen_by_row(fit), effect, shapes),
                rest.unnamed(effect),
            )
        )
    return found


def _rivals(context: Context, search: Search, fit: Fit, effect: str) -> tuple[tuple[Alternative, ...], float]:
    """Effects that could stand in the place of one, the closest first, and the probability of its name.

    A richer law of the same physics could where it explains more, though not so much that it is told apart.
    """
    overstated = inflation(fit, fit.hypothesis.parameters_of(effect))
    rivals, weights = [], []
    rest = set(fit.effects) - {effect}
    base = search.store.reduced(fit, effect)
    for other in search.store.replacements(fit, effect):
        name = next(iter(set(other.effects) - rest), effect)
        if name == effect or (_is_richer(other, name, effect, context.data) and score(other, base) <= score(fit, base)):
            continue
        starts = _starts(context, fit, other, effect, name)
        start = context.fitter.ranked(starts, fit.levels)[0]
        close = evidence(other, fit) < max(context.fitter.close_call, CLOSE_SHARE * evidence(base, fit))
        if close or start is not starts[0]:
            again = context.fitter.converged(context.fitter.fit(start, fit.levels))
            other = max(other, again, key=lambda found: found.log_likelihood)
        loss = evidence(base, fit) - evidence(base, other)
        values = {k.rpartition(".")[2]: v for k, v in other.hypothesis.values.items() if k.startswith(f"{name}.")}
        rivals.append(Alternative(name, context.fitter.separation(fit, other, loss, overstated), values))
        weights.append(np.exp(min(score(other, base) - score(fit, base), 0.0) / overstated))
    rivals.sort(key=lambda rival: rival.separation)
    return tuple(rivals), float(1.0 / (1.0 + sum(weights)))


def _starts(context: Context, fit: Fit, rival: Fit, effect: str, name: str) -> list[Hypothesis]:
    """A rival as found; with the answer's values of what they share; with the value of the effect it replaces too.

    The last is the best for two effects of one equation: a bias of the angle, a centre of mass beside the axis.
    """
    own = rival.hypothesis.values
    shared = {**own, **fit.hypothesis.values}
    values = [own, shared]
    mine = [p for p in rival.hypothesis.space.free if p.name.startswith(f"{name}.")]
    theirs = [p for p in fit.hypothesis.space.free if p.name.startswith(f"{effect}.")]
    if len(mine) == len(theirs) == 1 and mine[0].unit == theirs[0].unit:
        values.append({**shared, mine[0].name: shared[theirs[0].name]})
    return [Hypothesis.of(context.setting.with_curve_of(fit.hypothesis), rival.effects, each) for each in values]


def _is_richer(other: Fit, name: str, effect: str, data: RecordingBatch) -> bool:
    """Whether a rival is the same law with more to it."""
    replaced = reduced_effects(other, data)
    return simple_law(name) == effect or (replaced is not None and effect in replaced)


def _unexplained(context: Context, rest: Rest, unruly: tuple[str, ...]) -> Unexplained:
    laws = {name: effect_of(name, context.data.plant) for name in rest.fit.effects}
    foreign = [name for name, law in laws.items() if not context.fitter.looks_for(name, law)]
    outside_vocabulary = [name for name in foreign if name not in rest.minor]
    if rest.significant and outside_vocabulary:
        words = " and ".join(effect_in_words(name, context.data.plant.kind) for name in outside_vocabulary)
        return Unexplained(True, rest.p_value, outside_vocabulary[0].partition("/")[0], words, rest.resembles, None)
    if unruly and (not rest.significant or rest.strongest is None):
        places = in_a_row([site_in_words(joint, context.data.plant.kind) for joint in unruly])
        words = f"predictions of {places} err far more than noise makes them"
        return Unexplained(True, rest.p_value, unruly[0], words, rest.resembles, None)
    if not rest.significant or rest.strongest is None:
        return Unexplained(False, rest.p_value, None, "", (), None)
    shape = rest.strongest.shape
    site = context.data.plant.joints[shape.joint]
    words = {
        "force": f"a force over {shape.signal} on {site}",
        "gain": "an actuator gain that drifts over time",
        "friction": f"dry friction on {site} that changes with {shape.signal}",
        "resonance": f"something that swings with {site} at about {shape.signal} Hz",
    }[shape.kind]
    curve = curve_of(shape, rest.fit, rest.spread, context.data) if len(rest.spread) else None
    return Unexplained(True, rest.p_value, site, words, rest.resembles, curve)


def _weak(effects: tuple[FoundEffect, ...], wide: float) -> tuple[str, ...]:
    found = []
    for effect in effects:
        for p in effect.parameters:
            if is_wide(p, wide):
                found.append(f"{p.name} is known to {p.low:.3g} ... {p.high:.3g} {p.unit} only")
        for name in effect.equivalent:
            found.append(f"{effect.name} cannot be told from {name}")
        if effect.heldout_gain < 0.0:
            found.append(f"{effect.name}: fitted to all recordings but one, it does not predict that one better")
    return tuple(found)


def _as_one(laws: tuple[Combined, ...], plant_kind: str) -> tuple[str, ...]:
    found = []
    for law in laws:
        sizes = ", ".join(f"{symbol} = {value:.3g}" for symbol, value in law.parameters.items())
        words = f"{effect_in_words(law.name, plant_kind)} ({sizes}), which the vocabulary lacks"
        found.append(f"{' and '.join(law.instead_of)} together cannot be told from {words}")
    return tuple(found)


def _units(context: Context) -> dict[str, str]:
    plant = context.data.plant
    return {name: plant.unit_of(name) for name in (*plant.coordinates, *plant.rates, *plant.commands)} | {"t": "s"}


def proposed(
    context: Context,
    search: Search,
    fit: Fit,
    answer: Diagnosis,
    feedback: tuple[StateFeedback, float] | None,
    rng: np.random.Generator,
    limits: Mapping[str, JointLimits] | None = None,
) -> NextExperiment | None:
    """The experiment that settles what is tied or weak; None where nothing is, or nothing that an experiment tells."""
    forever = context.fitter.alike
    tied = {
        effect.name: tuple(name for name in effect.equivalent if name not in forever.get(effect.name, ()))
        for effect in answer.effects
    }
    rivals = [
        part.store.fitter.seen_by_row(other)[1]
        for part, own in search.split(fit, with_stand_ins=True)
        for effect in own.effects
        for name in tied.get(effect, ())
        for other in part.store.replacements(own, effect)
        if name in other.effects and effect not in other.effects
    ]
    weak = tuple(
        p.name for effect in answer.effects for p in effect.parameters if is_wide(p, context.rules.answer.wide)
    )
    if not rivals and not weak:
        return None
    questions = [f"{effect} or {name}" for effect, names in tied.items() for name in names]
    questions += [f"how large is {name}" for name in weak]
    question = Question(f"Open: {', '.join(questions)}.", tuple(rivals), weak)
    closed, rate = feedback if feedback is not None else (None, context.recordings[0].rate)
    simulator = context.by_row.simulator
    by_row = context.fitter.seen_by_row(fit)[1]
    return next_experiment(
        question, by_row, context.setting, context.data, simulator, closed, rate, rng, context.rules, limits
    )
