"""What the recordings say of effects that a person suspects: asked once the answer is complete, which they leave alone.

A suspect is fitted beside the effects of the answer. Those that cannot stand beside it make room: laws that exclude
it, richer or simpler laws of the same physics, and effects from which the recordings cannot tell it. A suspected
size is held while everything else is fitted anew, and judged by the ratio of likelihoods (Wilks 1938).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from wipx.core.diagnosis import Diagnosis
from wipx.core.effect import Effect
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.parameters import Scales
from wipx.core.results import NINETY_FIVE, Estimate
from wipx.core.suspect import Suspect, SuspectedSize
from wipx.diagnosis.candidates.screening import candidates_beside
from wipx.diagnosis.decision.confirmation import Rest
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.decision.estimates import estimates
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.held_out import transfer
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.residuals.discrepancy import with_curve
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.fit_store import STARTS
from wipx.diagnosis.selection.nested_laws import reduced_values, simple_law
from wipx.diagnosis.selection.search import Search
from wipx.effects.catalogue import check_together, effect_of, vocabulary
from wipx.recordings.model_file import model_of
from wipx.report.suspect_sentence import suspect_sentence

Suspected = Mapping[str, Mapping[str, float]]


def check_suspects(
    suspects: Suspected, nominal: Model, scales: Mapping[str, Scales], where: str = "suspects"
) -> dict[str, dict[str, float]]:
    """The suspects with all their values, or with none.

    Args:
        suspects: Values by symbol [SI], by "site/kind".
        nominal: What the robot's owner believes.
        scales: Characteristic sizes by site, of which search intervals are multiples.
        where: Key, for messages.

    Raises:
        InputError: there is no such effect or parameter, the nominal model has the effect or one that excludes it,
            or a value is missing or beyond the search interval.
    """
    complete: dict[str, dict[str, float]] = {}
    plant = nominal.plant
    for name, values in suspects.items():
        effect = effect_of(name, plant, where)
        if name in nominal.effects:
            raise InputError(
                f"{where}: {name} is part of the nominal model; list its numbers under uncertainty instead"
            )
        check_together((*nominal.effects, name), plant, f"{where} and nominal model")
        complete[name] = {}
        if values:
            complete[name] = dict(model_of(plant, nominal.parameters, {name: values}, where).effects[name])
            _check_bounds(name, effect, complete[name], scales[name.partition("/")[0]], where)
    return complete


def _check_bounds(name: str, effect: Effect, values: Mapping[str, float], scales: Scales, where: str) -> None:
    for p in effect.parameters:
        size = scales.of(p.dimension)
        low, high = p.low * size, p.high * size
        if not low <= values[p.name] <= high:
            raise InputError(
                f"{where}: {name}.{p.name} = {values[p.name]:g}, expected {low:.3g} to {high:.3g} (in SI units, for "
                "these recordings); correct it, or leave out the values to ask how large it would be"
            )


def asked(context: Context, search: Search, rest: Rest, answer: Diagnosis, suspects: Suspected) -> tuple[Suspect, ...]:
    """What the recordings say of each suspect.

    Args:
        context: The means.
        search: The search that led to the answer.
        rest: The answer's fit.
        answer: The answer, complete.
        suspects: As `check_suspects` returns them.
    """
    return tuple(_Asked(context, search, rest, answer, name).about(values) for name, values in suspects.items())


@dataclass(frozen=True)
class _Asked:
    """One suspect and what it is compared with."""

    context: Context
    search: Search
    rest: Rest
    answer: Diagnosis
    name: str

    def about(self, values: Mapping[str, float]) -> Suspect:
        """What the recordings say, also of these values by symbol where there are any."""
        context, search = self.context, self.search
        named = self.name in self.rest.fit.effects
        replaced = () if named else self.making_room()
        gone = (self.name,) if named else replaced
        base = search.store.reduced(self.rest.fit, *gone) if gone else self.rest.fit
        free = self.rest.fit if named else self.free_size(base, values)
        base = self.refitted_from(base, free)
        best = self.refitted_from(self.rest.fit, free)
        repeated = transfer(context.fitter, free)
        known = context.fitter.by_recording(base, base.white)
        numbers = estimates(context.fitter, free, search.nominal)
        suspect = Suspect(
            name=self.name,
            named=named,
            in_place_of=replaced,
            parameters=tuple(e for e in numbers if e.name.startswith(f"{self.name}.")),
            log_evidence_gain=evidence(base, free),
            required_gain=search.criteria.required_gain(base, free),
            heldout_gain=context.held_out.gain(context.fitter, repeated, base),
            transfers=bool(repeated.likelihoods.sum() > known.sum()),
            loss=0.0 if named else -evidence(best, free),
            size=None,
            unnamed=self.rest.unnamed(self.name),
        )
        if values:
            limit = (
                0.5 * chdtri(len(values), 1.0 - context.rules.answer.confidence) * _overstated(free, numbers, self.name)
            )
            suspect = replace(suspect, size=self.of_size(suspect, values, free, best, float(limit)))
        unexplained = self.answer.unexplained.significant
        return replace(suspect, sentence=suspect_sentence(suspect, unexplained=unexplained))

    def making_room(self) -> tuple[str, ...]:
        """Effects of the answer that cannot stand beside the suspect."""
        known = vocabulary(self.context.data.plant)
        site, _, kind = self.name.partition("/")
        found = []
        for effect in (*self.answer.effects, *self.answer.minor):
            other_site, _, other = effect.name.partition("/")
            excludes = other in known[self.name].excludes or kind in known[effect.name].excludes
            nested = self.name == simple_law(effect.name) or effect.name == simple_law(self.name)
            if (site == other_site and excludes) or nested or self.name in effect.equivalent:
                found.append(effect.name)
        return tuple(found)

    def free_size(self, base: Fit, values: Mapping[str, float]) -> Fit:
        """The fit of a base with the suspect, its size free."""
        known = base.hypothesis.values
        if not self.context.fitter.looks_for(self.name, effect_of(self.name, self.context.data.plant)):
            looked_at = candidates_beside(self.context.fitter, self.context.setting, base, outside_vocabulary=True)
        else:
            looked_at = self.search.store.candidates_for(base)
        promising = [candidate.values for candidate in looked_at if candidate.effect == self.name][:STARTS]
        suspected = {f"{self.name}.{symbol}": value for symbol, value in values.items()}
        simple = {k: v for k, v in reduced_values(self.rest.fit).items() if k.startswith(f"{self.name}.")}
        starts = [{**known, **start} for start in (*promising, suspected, simple) if start] or [known]
        return self.likeliest(self.context.setting, (*base.effects, self.name), starts, base.levels)

    def of_size(
        self, suspect: Suspect, values: Mapping[str, float], free: Fit, best: Fit, limit: float
    ) -> SuspectedSize:
        """What comes of a suspected size, by symbol."""
        context = self.context
        setting = context.setting
        nominal = setting.nominal.with_effects({self.name: values})
        others = tuple(effect for effect in free.effects if effect != self.name)
        starts = [free.hypothesis.values, best.hypothesis.values]
        held = self.likeliest(replace(setting, nominal=nominal), others, starts, free.levels)
        loss, loss_to_free = -evidence(best, held), -evidence(free, held)
        against_free = suspect.supported or bool(suspect.in_place_of)
        inside = all(_covers(number, values) for number in suspect.parameters)
        ours, theirs = (context.held_out.error(transfer(context.fitter, fit)) for fit in (held, self.rest.fit))
        return SuspectedSize(
            dict(values),
            loss,
            loss_to_free,
            against_free,
            limit,
            bool((loss_to_free if against_free else loss) > limit and not inside),
            float(np.sqrt(ours / theirs)) if theirs > 0.0 else 1.0,
        )

    def likeliest(
        self, setting: Setting, effects: tuple[str, ...], starts: list[dict[str, float]], levels: NoiseLevels
    ) -> Fit:
        """The likeliest fit of some effects; a curve that stands in is taken as it is, or drawn anew beside them."""
        fitter, rest = self.context.fitter, self.rest
        curves = self.context.setting.with_curve_of(rest.fit.hypothesis).nominal.effects
        kept = replace(setting, nominal=setting.nominal.with_effects({**curves, **setting.nominal.effects}))
        fits = [fitter.fit(Hypothesis.of(kept, effects, start), levels, steps=5) for start in starts]
        best = fitter.converged(max(fits, key=lambda fit: fit.log_likelihood))
        if rest.strongest is None or not len(rest.spread):
            return best
        without = fitter.fit(Hypothesis.of(setting, effects, best.hypothesis.values), best.levels)
        anew, _ = with_curve(self.context.by_row, setting, without, rest.strongest)
        return max(best, anew, key=lambda fit: fit.log_likelihood)

    def refitted_from(self, fit: Fit, other: Fit) -> Fit:
        """A fit, or a better one of the same effects that starts from the noise of another."""
        if fit is other:
            return fit
        again = self.context.fitter.converged(self.context.fitter.fit(fit.hypothesis, other.levels), rounds=2)
        return max(fit, again, key=lambda one: one.log_likelihood)


def _overstated(fit: Fit, numbers: tuple[Estimate, ...], name: str) -> float:
    """By how much a fit overstates evidence on the size of an effect: variance behind the intervals over the plain one.

    Intervals know what the likelihood does not: innovations that are not quite white, the misfit of a law, the step.
    """
    space, cube = fit.hypothesis.space, fit.hypothesis.cube
    values = space.to_values(cube)
    below = cube - space.to_cube(values + np.array([number.low - number.value for number in numbers]))
    above = space.to_cube(values + np.array([number.high - number.value for number in numbers])) - cube
    variance = (np.maximum(below, above) / NINETY_FIVE) ** 2  # the wider side: the other may end at a bound
    plain = np.maximum(np.diag(np.linalg.pinv(fit.information)), 1e-300)
    return float(max(1.0, np.median((variance / plain)[fit.hypothesis.parameters_of(name)])))


def _covers(number: Estimate, values: Mapping[str, float]) -> bool:
    """Whether the interval of a number holds the value of its symbol."""
    return number.low <= values[number.name.rpartition(".")[2]] <= number.high
