"""What a search by forecasts ends with: which effects are named, what the completed model has, what it leaves over.

A name must hold among all effects that were looked at, and remove much beside what no law describes. The completed
model has to predict: what makes it predict better stays in it without a name.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from wipx.diagnosis.decision.completion import completed, dominant, likely, transferring
from wipx.diagnosis.decision.confirmation import Rest, significant_residuals
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.tolerances import tolerances
from wipx.diagnosis.residuals.residual_tests import Residual, Shape, shapes_of
from wipx.diagnosis.selection.search import Chosen, Search, is_everywhere

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


def with_minor_effects(end: Found) -> Found:
    """What forecasts found, with what every machine has a little of, and with small effects told.

    Rich laws give way to simple ones first, which may be small. Small are those that remove little beside what no law
    describes. They stay in the completed model.
    """
    search, further = _completed_and_grown(end.search, end.rest.fit)
    further = _without_harm(end.context, search, further)
    simple = _by_part(search, further.fit, lambda part, own: part.simplified(own))
    whole = _joined(search, further.fit, [chosen.fit for chosen in simple])
    kept = _by_part(search, whole, dominant)
    looked_at = (chosen.considered for chosen in (further, *simple, *kept))
    considered = end.rest.considered + tuple(each for history in looked_at for each in history)
    named = {effect for chosen in kept for effect in chosen.fit.effects if not is_everywhere(effect)}
    minor = tuple(effect for effect in whole.effects if effect not in named)
    context = replace(end.context, setting=search.store.setting)
    if whole is end.rest.fit:
        return Found(context, search, replace(end.rest, minor=minor, considered=considered), end.shapes)
    context = context.trusting(whole)
    left, shapes = left_over(context, search.nominal, Chosen(whole, considered))
    left = replace(left, significant=left.significant or end.rest.significant, minor=minor)
    return Found(context, search, left, shapes)


def with_likely_effects(end: Found) -> Found:
    """The same names, in a model that predicts better with further effects, where forecasts decide."""
    search, fit = end.search, end.rest.fit
    if not isinstance(search.store.fitter, ForecastFitter):
        return end
    held_out = end.context.held_out if end.context.several else None
    more = _by_part(search, fit, lambda part, own: likely(part, own, held_out))
    whole = _joined(search, fit, [chosen.fit for chosen in more])
    if whole is fit:
        return end
    considered = end.rest.considered + tuple(each for chosen in more for each in chosen.considered)
    context = end.context.trusting(whole)
    left, shapes = left_over(context, search.nominal, Chosen(whole, considered))
    unproven = tuple(effect for effect in whole.effects if effect not in fit.effects)
    left = replace(left, significant=left.significant or end.rest.significant, minor=end.rest.minor, unproven=unproven)
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


def left_over(context: Context, nominal: Fit, chosen: Chosen) -> tuple[Rest, list[Shape]]:
    """What forecasts leave over, as innovations show it."""
    by_row, seen = context.fitter.seen_by_row(chosen.fit)
    shapes = shapes_of(by_row, seen)
    left, p_value = _left_by_row(context, seen, context.fitter.seen_by_row(nominal)[1], shapes)
    strongest = max(left, key=lambda residual: residual.gain) if left else None
    return Rest(chosen.fit, strongest, p_value, bool(left), (), np.zeros(0), chosen.considered), shapes
