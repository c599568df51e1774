"""Which evidence decides: innovations where the laws hold row by row, forecasts where none holds exactly.

Under laws that hold, the likelihood of innovations is the most efficient evidence there is. Under laws that nearly
hold, its noise model takes what is slow for noise, and with it the physics that decides a prediction of half a second.
So innovations come first, but for arms on which no law holds from the beginning. The search is repeated by forecasts
where the laws of the first one, with what stands in for what they leave over, hold only nearly (`Context.is_trusted`).
If recordings are far likelier with that stand-in, half a second ahead, than with all that forecasts find, the first
answer counts.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from wipx.diagnosis.decision.completion import completed, dominant, transferring
from wipx.diagnosis.decision.confirmation import Rest, decided, significant_residuals
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.tolerances import tolerances
from wipx.diagnosis.residuals.residual_tests import Residual, Shape, shapes_of
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import RobotSearch, search_of
from wipx.diagnosis.selection.search import Chosen, Search, is_everywhere

Watcher = Callable[[str, float], None]
Done = TypeVar("Done")


@dataclass(frozen=True)
class Found:
    """What a search ends with.

    Attributes:
        context: The means, with the evidence that decided.
        search: The search.
        rest: The final fit, and what it leaves over.
        shapes: In which that was looked for.
    """

    context: Context
    search: Search
    rest: Rest
    shapes: list[Shape]


def found(context: Context, search: Search, watcher: Watcher) -> Found:
    """What is missing, by the evidence that suits the recordings.

    Args:
        context: The means, with innovations as evidence.
        search: The search by innovations.
        watcher: Told the stage and the share that is done.
    """
    if isinstance(search, RobotSearch):
        return _found_on_tree(context, search, watcher)
    return _by_innovations(context, search, search.run(), watcher)


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
        return _with_minor_effects(Found(ahead, search, *_left_over(ahead, search.nominal, best))), same_names
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
    return _with_minor_effects(Found(ahead, search, *_left_over(ahead, search.nominal, best))), agrees


def _with_minor_effects(end: Found) -> Found:
    """What forecasts found, with what every machine has a little of, and with small effects told.

    Rich laws give way to simple ones first, which may be small. Small are those that remove little beside what no law
    describes. They stay in the completed model, unless no other is there.
    """
    search, further = _completed_and_grown(end.search, end.rest.fit)
    further = _without_harm(end.context, search, further)
    simple = _by_part(search, further.fit, lambda part, own: part.simplified(own))
    whole = _joined(search, further.fit, [chosen.fit for chosen in simple])
    kept = _by_part(search, whole, dominant)
    looked_at = (chosen.considered for chosen in (further, *simple, *kept))
    considered = end.rest.considered + tuple(each for history in looked_at for each in history)
    named = {effect for chosen in kept for effect in chosen.fit.effects if not is_everywhere(effect)}
    if not named and end.rest.fit.effects:
        search, whole = _completed(end.search, end.search.nominal)
    small = {effect for effect in whole.effects if effect not in named}
    minor = tuple(effect for effect in whole.effects if effect in small)
    context = replace(end.context, setting=search.store.setting)
    if whole is end.rest.fit:
        return Found(context, search, replace(end.rest, minor=minor, considered=considered), end.shapes)
    context = context.trusting(whole)
    left, shapes = _left_over(context, search.nominal, Chosen(whole, considered))
    left = replace(left, significant=left.significant or end.rest.significant, minor=minor)
    return Found(context, search, left, shapes)


def _completed_and_grown(search: Search, fit: Fit) -> tuple[Search, Chosen]:
    """A fit with the laws that every machine follows a little, and with further effects that show beside them only."""
    search, whole = _completed(search, fit)
    if whole is fit:
        return search, Chosen(fit)
    further = search.grown(whole)
    if set(further.fit.effects) == set(whole.effects):
        return search, Chosen(whole, further.considered)
    search, whole = _completed(search, further.fit)
    return search, Chosen(whole, further.considered)


def _without_harm(context: Context, search: Search, chosen: Chosen) -> Chosen:
    """Without effects that make predictions of held-out recordings worse; halves of one run may differ too much."""
    fit = chosen.fit
    if not context.several:
        return chosen
    kept = _by_part(search, fit, lambda part, own: transferring(context.held_out, part, own))
    considered = chosen.considered + tuple(each for one in kept for each in one.considered)
    return Chosen(_joined(search, fit, [one.fit for one in kept]), considered)


def _completed(search: Search, fit: Fit) -> tuple[Search, Fit]:
    """A search that knows the laws which every machine follows a little, and a fit with those that it needs."""
    fitter = search.store.fitter
    assert isinstance(fitter, ForecastFitter)
    search = search.knowing(tolerances(search.store.setting, fitter, fitter.predictions, fit))
    return search, _joined(search, fit, _by_part(search, fit, completed))


def _by_part(search: Search, fit: Fit, do: Callable[[Search, Fit], Done]) -> list[Done]:
    """What is done with each part of a robot that has effects, side by side."""
    return search.store.fitter.simulator.side_by_side(lambda piece: do(*piece), search.split(fit))


def _joined(search: Search, fit: Fit, parts: list[Fit]) -> Fit:
    """The fit of a robot with what its parts have become; the same fit where none has changed."""
    changed = any(new is not old for new, (_, old) in zip(parts, search.split(fit), strict=True))
    return search.joined(fit, tuple(parts)) if changed else fit


def _left_by_row(context: Context, fit: Fit, nominal: Fit, shapes: list[Shape]) -> tuple[list[Residual], float]:
    """What is left over by innovations; mean commands feign what swings, which does not count there."""
    left, p_value = significant_residuals(context, fit, fit.motion_likelihood - nominal.motion_likelihood, shapes)
    return [one for one in left if one.shape.kind != "resonance" or not context.data.has_means], p_value


def _left_over(context: Context, nominal: Fit, chosen: Chosen) -> tuple[Rest, list[Shape]]:
    """What forecasts leave over, as innovations show it."""
    by_row, seen = context.fitter.seen_by_row(chosen.fit)
    shapes = shapes_of(by_row, seen)
    left, p_value = _left_by_row(context, seen, context.fitter.seen_by_row(nominal)[1], shapes)
    strongest = max(left, key=lambda residual: residual.gain) if left else None
    return Rest(chosen.fit, strongest, p_value, bool(left), (), np.zeros(0), chosen.considered), shapes
