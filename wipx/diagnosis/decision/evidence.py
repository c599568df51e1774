"""Which evidence decides: innovations where the laws hold row by row, forecasts where none holds exactly.

Under laws that hold, the likelihood of innovations is the most efficient evidence there is. Under laws that nearly
hold, its noise model takes what is slow for noise, and with it the physics that decides a prediction of half a second.
So innovations come first, but for arms on which no law holds from the beginning. The search is repeated by forecasts
where the laws of the first one, with what stands in for what they leave over, hold only nearly (`Context.is_trusted`).
If recordings are far likelier with that stand-in, half a second ahead, than with all that forecasts find, the first
answer counts.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wipx.diagnosis.decision.confirmation import Rest, decided
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.decision.names_and_model import Found, left_over, with_likely_effects, with_minor_effects
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import RobotSearch, search_of
from wipx.diagnosis.selection.search import Chosen, Search

Watcher = Callable[[str, float], None]


def found(context: Context, search: Search, watcher: Watcher) -> Found:
    """What is missing, by the evidence that suits the recordings.

    Args:
        context: The means, with innovations as evidence.
        search: The search by innovations.
        watcher: Told the stage and the share that is done.
    """
    if isinstance(search, RobotSearch):
        return with_likely_effects(_found_on_tree(context, search, watcher))
    return with_likely_effects(_by_innovations(context, search, search.run(), watcher))


def _found_on_tree(context: Context, search: RobotSearch, watcher: Watcher) -> Found:
    """What is missing of a robot of many joints.

    Its joints do not all lack the same: exact laws hold on some joint beside the first effects. If they hold on none,
    forecasts come first, and innovations are searched only if laws hold on some joint beside what forecasts find, from
    there on.
    """
    if context.by_forecasts_alone:
        chosen = Chosen(search.nominal)
        ahead = _by_forecasts_and_forces(context, chosen.fit, watcher, afresh=True)
        return ahead or _by_innovations(context, search, chosen, watcher)
    begun = search.grown(steps=1)
    means = _means_read(context, begun.fit)
    if means is not None:
        context, search = means, _search_by(means, search.nominal)
        begun = search.grown(steps=1).after(begun.considered)
    if not context.holds_somewhere(begun.fit):
        ahead = _by_forecasts_and_forces(context, begun.fit, watcher, afresh=True)
        if ahead is not None:
            begun = Chosen(search.fit_from(ahead.rest.fit), begun.considered)
            if not context.holds_somewhere(begun.fit):
                return ahead
    chosen = search.run(begun.fit).after(begun.considered)
    context, search, chosen = _reread(context, search, chosen)
    holds = context.is_quiet(chosen.fit) and context.holds_somewhere(chosen.fit)
    ahead = None if holds else _by_forecasts_and_forces(context, chosen.fit, watcher)
    return ahead or _by_innovations(context, search, chosen, watcher)


def _means_read(context: Context, fit: Fit) -> Context | None:
    """The means with rows that have means of commands, if nobody knows and every recording is likelier so."""
    if context.rate_is_known or context.data.has_means:
        return None
    means = context.read_otherwise()
    again = means.by_row.first_fit(fit.hypothesis, fit.levels)
    return means if means.is_likelier(again, context, fit) else None


def _reread(context: Context, search: RobotSearch, chosen: Chosen) -> tuple[Context, RobotSearch, Chosen]:
    """What a search has come to, read the likelier way.

    What a model lacks may look like a slow log. So rows that were taken for means are read as held again, and the
    search may find one effect more of every part.
    """
    if not context.rate_is_known and context.data.has_means:
        held = context.read_otherwise()
        again = _search_by(held, search.nominal)
        grown = again.grown(again.fit_from(chosen.fit), steps=1)
        if held.is_likelier(grown.fit, context, chosen.fit):
            return held, again, again.run(grown.fit).after(chosen.considered + grown.considered)
        return context, search, chosen
    means = _means_read(context, chosen.fit)
    if means is None:
        return context, search, chosen
    again = _search_by(means, search.nominal)
    return means, again, again.run(again.fit_from(chosen.fit)).after(chosen.considered)


def _search_by(context: Context, nominal: Fit) -> RobotSearch:
    """A search by the innovations of rows as they are read, from the nominal model as another reading has it on."""
    first = context.by_row.first_fit(nominal.hypothesis, nominal.levels)
    return RobotSearch.of(FitStore.of(context.by_row, context.setting, first), first, context.held_out)


def _by_innovations(context: Context, search: Search, chosen: Chosen, watcher: Watcher) -> Found:
    """What innovations chose, if its laws hold, foreign ones too; else the better of that and what forecasts find."""
    watcher("what is left over", 0.5)
    context = context.trusting(chosen.fit)
    by_row = Found(context, search, *decided(context, search, chosen))
    fitter = _forecasting(context, chosen.fit)
    if not fitter.is_possible or (by_row.rest.strongest is None and context.is_trusted(by_row.rest.fit)):
        return by_row
    watcher("predictions of half a second", 0.6)
    return _better(by_row, fitter, *_by_forecasts(context, fitter, chosen.fit))


def _by_forecasts_and_forces(context: Context, chosen: Fit, watcher: Watcher, *, afresh: bool = False) -> Found | None:
    """What forecasts find on an arm; None where recordings are too short for them.

    Laws of an arm hold nearly at best. Where forces and motion do not quite agree, forecasts prefer joints that are too
    heavy for the forces to matter. So what the forces themselves say counts too.
    """
    context = replace(context, setting=replace(context.setting, forces_count=True))
    fitter = _forecasting(context, chosen)
    if not fitter.is_possible:
        return None
    watcher("predictions of half a second", 0.5)
    return _by_forecasts(context, fitter, chosen, afresh=afresh)[0]


def _better(by_row: Found, fitter: ForecastFitter, ahead: Found, agrees: bool) -> Found:
    """The answer of innovations or that of forecasts; always that of forecasts if the other does harm."""
    rest = by_row.rest
    if by_row.context.is_worse(rest.fit):
        return ahead
    if rest.significant:
        if _is_far_likelier(fitter, rest, ahead.rest.fit):
            return by_row
        if ahead.rest.significant or ahead.context.is_quiet(ahead.rest.fit):
            return ahead
        return replace(ahead, rest=replace(ahead.rest, significant=True, p_value=rest.p_value))
    exact = bool(rest.fit.effects) and by_row.context.is_quiet(rest.fit) and _predicts_better(by_row, ahead)
    return by_row if agrees or exact else ahead


def _forecasting(context: Context, chosen: Fit) -> ForecastFitter:
    """Forecasts as evidence, with doubt in the robot's numbers."""
    doubted = context.setting.doubted(context.rules.forecasts.undeclared)
    return ForecastFitter(context.by_row, context.first_levels, chosen.levels, doubted)


def _predicts_better(one: Found, other: Found) -> bool:
    """Whether an answer predicts the recordings better than another one."""
    errors, others = (each.context.errors(each.rest.fit).completed for each in (one, other))
    return float(np.mean([(errors[name] / max(others[name], 1e-300)) ** 2 for name in errors])) < 1.0


def _is_far_likelier(fitter: ForecastFitter, rest: Rest, other: Fit) -> bool:
    """Whether what has no name in the vocabulary predicts half a second far better than what has, in most stretches."""
    seen = fitter.seen_ahead(rest.fit)
    lead = seen.log_likelihood - other.log_likelihood - 0.5 * len(rest.spread) * float(np.log(fitter.rows))
    return fitter.separation(seen, other, lead, 1.0) > fitter.rules.answer.told_apart


def _by_forecasts(context: Context, fitter: ForecastFitter, chosen: Fit, *, afresh: bool = False) -> tuple[Found, bool]:
    """What forecasts find to be missing, and whether that is hardly better than all of what innovations chose.

    A robot of many joints is searched once, from what innovations chose on; afresh where they were not searched to the
    end. On another robot a second search starts there; the better end counts.
    """
    setting, least_gain = context.setting, context.rules.selection.least_gain
    ahead = replace(context, fitter=fitter)
    nominal = fitter.first_fit(Hypothesis.of(setting, (), {}))
    search = search_of(FitStore.of(fitter, setting, nominal), nominal)
    criteria = search.criteria
    if isinstance(search, RobotSearch):
        best = search.run(search.fit_from(chosen) if chosen.effects and not afresh else None)
        ahead = ahead.trusting(best.fit)
        same_names = set(best.fit.effects) == set(chosen.effects)
        return with_minor_effects(Found(ahead, search, *left_over(ahead, search.nominal, best))), same_names
    best = search.run()
    start = Hypothesis.of(setting, chosen.effects, chosen.hypothesis.values)
    same = nominal
    if chosen.effects:
        pruned = search.pruned(fitter.converged(fitter.fit(start, best.fit.levels)))
        best = Chosen(best.fit, best.considered + pruned.considered)
        same = pruned.fit if criteria.gains_enough(nominal, pruned.fit) else nominal
    if set(same.effects) != set(best.fit.effects) and criteria.lead(same, best.fit) > 0.0:
        best = search.exchanged(same).after(best.considered)
    hardly = set(same.effects) == set(best.fit.effects) or criteria.lead(best.fit, same) < least_gain
    agrees = bool(chosen.effects) and set(same.effects) == set(chosen.effects) and hardly
    ahead = ahead.trusting(best.fit)
    return with_minor_effects(Found(ahead, search, *left_over(ahead, search.nominal, best))), agrees
