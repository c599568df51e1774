"""What becomes of the effects that the selection chose: which are kept, and what stands in for what they leave over."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from wipx.core.diagnosis import ConsideredEffect
from wipx.core.suspect import Unnamed
from wipx.diagnosis.candidates.screening import candidates_beside
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.decision.estimates import deviations
from wipx.diagnosis.likelihood import nonsmooth_search
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.held_out import transfer
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.residuals.discrepancy import with_curve
from wipx.diagnosis.residuals.residual_tests import Residual, Shape, residual_tests, shapes_of
from wipx.diagnosis.selection.criteria import evidence, score
from wipx.diagnosis.selection.nested_laws import extended_effects
from wipx.diagnosis.selection.search import Chosen, History, Search, is_everywhere
from wipx.effects.catalogue import effect_of

BEYOND = 3  # laws from beyond the vocabulary that are fitted


@dataclass(frozen=True)
class Rest:
    """The final fit and what it leaves over.

    Attributes:
        fit: Of the effects that are kept, and of a curve that stands in for the rest where there is one.
        strongest: What is left over; None where no test of a force finds anything significant.
        p_value: That it is nothing, corrected for the number of places looked at.
        significant: Whether it is something.
        resembles: Effects beyond the vocabulary that would explain it.
        spread: Standard deviation of the stand-in at its knots [force or share]; empty where there is none.
        considered: What was looked at on the way, in order.
        minor: Effects of the fit that are too small beside what no law describes to be named.
        unproven: Effects of the fit that make it predict better, but may have been picked by chance.
    """

    fit: Fit
    strongest: Residual | None
    p_value: float
    significant: bool
    resembles: tuple[str, ...]
    spread: np.ndarray
    considered: History = ()
    minor: tuple[str, ...] = ()
    unproven: tuple[str, ...] = ()

    def unnamed(self, effect: str) -> Unnamed | None:
        """Why an effect of the fit is not named; None where it is."""
        if effect in self.unproven:
            return "unproven"
        if effect in self.minor:
            return "everywhere" if is_everywhere(effect) else "small"
        return None

    def after(self, history: History) -> "Rest":
        """The same, with what was considered before."""
        return replace(self, considered=history + self.considered)


def decided(context: Context, search: Search, chosen: Chosen) -> tuple[Rest, list[Shape]]:
    """What is kept of the chosen effects, what they leave over, and the shapes that it was looked for in."""
    kept = confirmed_by_part(context, search, chosen.fit)
    shapes = shapes_of(context.by_row, kept.fit)
    return remaining(context, search, kept.fit, shapes).after(chosen.considered + kept.considered), shapes


def confirmed_by_part(context: Context, search: Search, fit: Fit) -> Chosen:
    """Each part of a robot without its effects that are not confirmed (`confirmed`)."""
    parts = search.split(fit)
    found = context.fitter.simulator.side_by_side(lambda piece: confirmed(context.beside(piece[0]), *piece), parts)
    considered = tuple(each for chosen in found for each in chosen.considered)
    if all(chosen.fit is own for chosen, (_, own) in zip(found, parts, strict=True)):
        return Chosen(fit, considered)
    return Chosen(search.joined(fit, tuple(chosen.fit for chosen in found)), considered)


def confirmed(context: Context, search: Search, fit: Fit) -> Chosen:
    """Without effects that change no prediction to speak of, may be nothing, or do not transfer to other recordings.

    Args:
        context: The means.
        search: The search that chose the effects.
        fit: Of the effects.
    """
    if not fit.effects:
        return Chosen(fit)
    repeated = transfer(context.fitter, fit)
    predicted = np.concatenate(context.judge.predict(fit.hypothesis.model, context.recordings))
    uncertain = _uncertain(context, search, fit)
    rules = context.rules.confirmation
    for effect in reversed(fit.effects):
        reduced = search.store.without(fit, effect)
        gain = evidence(reduced, fit)
        change = predicted - np.concatenate(context.judge.predict(reduced.hypothesis.model, context.recordings))
        known = context.fitter.by_recording(reduced, reduced.white)
        if np.all(np.sqrt(np.nanmean(change**2, axis=0)) < rules.irrelevant * context.judge.noise):
            reason = "changes no prediction to speak of"
        elif effect in uncertain and (gain < rules.certain_beside_backlash or not nonsmooth_search.is_non_smooth(fit)):
            reason = "has a size that cannot be told from zero"
        elif gain < rules.doubtful and float(np.sum(repeated.likelihoods - known)) <= 0.0:
            reason = "does not transfer to held-out recordings"
        else:
            continue
        considered = (ConsideredEffect(effect, gain, False, reason),)
        plain = search.store.with_reduced_law(fit, effect)
        worth = plain is not None and search.criteria.gains_enough(reduced, plain)
        kept = plain if plain is not None and worth else reduced
        return confirmed(context, search, kept).after(considered)
    return Chosen(fit)


def _uncertain(context: Context, search: Search, fit: Fit) -> list[str]:
    """Effects none of whose sizes is known to differ from nothing.

    Beside chance, halving the simulator's step may move a size by as much as it is, and innovations that stay coloured
    add up to more than their likelihood tells.
    """
    space, cube = fit.hypothesis.space, fit.hypothesis.cube
    size = np.abs(cube - space.neutral)
    known = size > context.rules.confirmation.certain * deviations(context.fitter, fit, search.nominal)
    found = []
    for effect in fit.effects:
        law = effect_of(effect, fit.hypothesis.model.plant)
        grows = [space.names.index(f"{effect}.{symbol}") for symbol in law.linear_in]
        if grows and not known[grows].any():
            found.append(effect)
    return found


def remaining(context: Context, search: Search, fit: Fit, shapes: list[Shape]) -> Rest:
    """What the named effects leave over, and a stand-in for it."""
    explained = fit.motion_likelihood - search.nominal.motion_likelihood
    least = _least_gains(context, fit, explained)
    other, considered = _other_law(context, search, fit, least["force"])
    if other is None:
        other = _left_over(context, search, fit, shapes, least)
    return other.after(considered)


def _left_over(context: Context, search: Search, fit: Fit, shapes: list[Shape], least: Mapping[str, float]) -> Rest:
    """What the named effects leave over, where no law from beyond the vocabulary takes the place of one."""
    explained = fit.motion_likelihood - search.nominal.motion_likelihood
    left, p_value = significant_residuals(context, fit, explained, shapes)
    if not left and not _is_far_off(context, fit):
        return Rest(fit, None, p_value, False, (), np.zeros(0))
    strongest = max(left, key=lambda residual: residual.gain) if left else None
    worth = least["force"] if strongest is None else least[strongest.shape.kind]
    resembles, named = _beyond(context, fit, worth)
    if strongest is None:
        return Rest(named or fit, None, p_value, named is not None, resembles, np.zeros(0))
    forces = [residual for residual in left if residual.shape.kind != "resonance"]
    if not forces:
        if named is None:  # noise that lasts and mean commands feign what swings; its law does not confirm it
            return Rest(fit, None, p_value, False, (), np.zeros(0))
        named = _without_superfluous(search, named)
        return Rest(named, strongest, p_value, True, resembles, np.zeros(0))
    widest = max(forces, key=lambda residual: residual.gain)
    stood_in, spread = with_curve(context.by_row, context.setting, fit, widest)
    if named is not None and named.log_likelihood > stood_in.log_likelihood:
        named = _without_superfluous(search, named)
        return Rest(named, strongest, p_value, True, resembles, np.zeros(0))
    for effect in fit.effects:
        if evidence(search.store.reduced(stood_in, effect), stood_in) < context.rules.selection.least_gain:
            return remaining(context, search, search.store.without(fit, effect), shapes)
    return Rest(stood_in, widest, p_value, True, resembles, spread)


def significant_residuals(
    context: Context, fit: Fit, explained: float, shapes: list[Shape]
) -> tuple[list[Residual], float]:
    """Leftovers of a fit by innovations that are no chance, and large enough; and the p value that there is none.

    Args:
        context: The means.
        fit: By innovations.
        explained: What it explains [nats].
        shapes: In which they are looked for.
    """
    found = residual_tests(context.by_row, fit, shapes)
    p_value = min(1.0, min(residual.p_value for residual in found) * len(shapes))
    least = _least_gains(context, fit, explained)
    return _significant(found, p_value, least, context.rules.residuals.level), p_value


def _least_gains(context: Context, fit: Fit, explained: float) -> dict[str, float]:
    """What a residual of each kind must gain beside a fit that explains so much [nats]."""
    rules = context.rules.residuals
    least_share = context.rules.selection.nonsmooth_share if nonsmooth_search.is_non_smooth(fit) else rules.least_share
    share = least_share * explained
    factor = rules.beside_means if context.data.has_means else 1.0
    curve, swing = factor * max(rules.least_gain, share), factor * max(rules.least_swing, share)
    return {"force": curve, "friction": curve, "gain": curve, "resonance": swing}


def _significant(found: list[Residual], p_value: float, least: Mapping[str, float], level: float) -> list[Residual]:
    """Leftovers that are no chance, and large enough; none where the most significant one may be chance."""
    if p_value >= level:
        return []
    return [left for left in found if left.p_value < level and left.gain >= least[left.shape.kind]]


def _beyond(context: Context, fit: Fit, worth: float) -> tuple[tuple[str, ...], Fit | None]:
    """Effects beyond the vocabulary that explain what is left, and the fit with the best of them."""
    ranked = candidates_beside(context.fitter, context.setting, fit, outside_vocabulary=True)
    best: dict[str, Fit] = {}
    promising = context.rules.residuals.promising
    for candidate in ranked:
        if candidate.gain < promising * ranked[0].gain or candidate.gain < promising * worth or len(best) == BEYOND:
            break
        if candidate.effect not in best:
            values = {**fit.hypothesis.values, **candidate.values}
            hypothesis = Hypothesis.of(context.setting, (*fit.effects, candidate.effect), values)
            best[candidate.effect] = context.fitter.converged(context.fitter.fit(hypothesis, fit.levels), rounds=2)
    good = {name: found for name, found in best.items() if found.log_likelihood - fit.log_likelihood > worth}
    ordered = sorted(good, key=lambda name: -score(good[name], fit))
    return tuple(ordered), good[ordered[0]] if ordered else None


def _other_law(context: Context, search: Search, fit: Fit, worth: float) -> tuple[Rest | None, History]:
    """What remains with a law from beyond the vocabulary in the place of a named one; None if that gains little.

    And the laws that were considered.
    """
    best, most = None, worth
    considered: History = ()
    for effect in fit.effects:
        law = extended_effects(fit, effect)
        if law is not None:
            effects, starts = law
            begins = [Hypothesis.of(context.setting, effects, start) for start in starts]
            start = context.fitter.ranked(begins, fit.levels)[0]
            found = context.fitter.converged(context.fitter.fit(start, fit.levels), rounds=2)
            gain = evidence(fit, found)
            taken = gain > most
            reason = f"explains {'more' if taken else 'hardly more'} in the place of {effect}"
            considered += (ConsideredEffect(effects[-1], gain, taken, reason),)
            if taken:
                best, most = found, gain
    if best is None:
        return None, considered
    p_value = float(chdtrc(len(best.hypothesis.cube) - len(fit.hypothesis.cube), 2.0 * most))
    best = _without_superfluous(search, best)
    return Rest(best, None, p_value, True, (best.effects[-1],), np.zeros(0)), considered


def _is_far_off(context: Context, fit: Fit) -> bool:
    """Whether predictions are much worse than sensor noise makes them."""
    return context.errors(fit).times_the_floor > context.rules.trust.far_off


def _without_superfluous(search: Search, fit: Fit) -> Fit:
    """Without effects that one from beyond the vocabulary has made superfluous."""
    for effect in fit.effects[:-1]:
        smaller = search.store.without(fit, effect)
        if not search.criteria.gains_enough(smaller, fit):
            return _without_superfluous(search, smaller)
    return fit
