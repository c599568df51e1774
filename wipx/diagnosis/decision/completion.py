"""Which of the effects that forecasts find are named, and what else the completed model has to predict well."""

import numpy as np

from wipx.core.diagnosis import ConsideredEffect
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.held_out import HeldOut, transfer
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.search import Chosen, Search, is_everywhere, named_effects


def dominant(search: Search, fit: Fit) -> Chosen:
    """Without the least effects, which together remove little beside what stays.

    They may be a part of what no law describes; not so those that recorded forces show as well. What every machine has
    a little of stays.
    """
    fitter, setting = search.store.fitter, search.store.setting
    assert isinstance(fitter, ForecastFitter)
    stays = fitter.squared_scales(fit)
    kept, considered = fit, ()
    while doubtful := [each for each in kept.effects if not (setting.expects(each) or is_everywhere(each))]:
        without = {effect: search.store.without(kept, effect) for effect in doubtful}
        grown = {effect: np.max(fitter.squared_scales(smaller) / stays) for effect, smaller in without.items()}
        least = min(grown, key=lambda effect: grown[effect])
        if grown[least] >= 1.0 + fitter.rules.forecasts.least_removed:
            break
        gain = evidence(without[least], kept)
        considered += (ConsideredEffect(least, gain, False, "removes little of the error beside what stays"),)
        kept = search.store.restarted(without[least])
    return Chosen(kept, considered)


def transferring(held_out: HeldOut, search: Search, fit: Fit) -> Chosen:
    """Without effects that make predictions worse of recordings which they were not fitted to, the worst one first.

    Stretches of time do not tell that: what one recording has of its own is in all of its stretches.
    """
    fitter = search.store.fitter
    kept, considered = fit, ()
    while named := named_effects(kept):
        repeated = transfer(fitter, kept)
        without = {effect: search.store.without(kept, effect) for effect in named}
        gains = {effect: held_out.gain(fitter, repeated, smaller) for effect, smaller in without.items()}
        worst = min(gains, key=lambda effect: gains[effect])
        if gains[worst] >= -fitter.rules.confirmation.tolerated:
            break
        gain = evidence(without[worst], kept)
        considered += (ConsideredEffect(worst, gain, False, "predicts held-out recordings worse"),)
        kept = search.store.restarted(without[worst])
    return Chosen(kept, considered)


def likely(search: Search, fit: Fit, held_out: HeldOut | None) -> Chosen:
    """With further effects that make predictions better, one after the other, none of which is proven.

    A name must hold among all effects that were looked at. The model has to predict: there it is enough that an effect
    would hold if it were the only one.

    Args:
        search: Of the robot or of a part of it.
        fit: Of what is named.
        held_out: Judges whether they transfer to held-out recordings; None if there is only one.
    """
    fitter, considered = search.store.fitter, ()
    assert isinstance(fitter, ForecastFitter)

    def is_likely(larger: Fit) -> bool:
        if evidence(fit, larger) < search.criteria.required_gain(fit, larger) or not fitter.is_likely(fit, larger):
            return False
        return held_out is None or held_out.transfers(fitter, fit, larger)

    while len(fit.effects) < search.rules.most_effects:
        larger = next(filter(is_likely, search.store.extensions(fit)), None)
        if larger is None:
            break
        reason = "makes predictions better, but may have been picked by chance"
        considered += (ConsideredEffect(larger.effects[-1], evidence(fit, larger), False, reason),)
        fit = search.store.keep(fitter.converged(larger))
    return Chosen(fit, considered)


def completed(search: Search, fit: Fit) -> Fit:
    """With those laws that every machine follows a little and that make predictions better."""
    fitter, setting = search.store.fitter, search.store.setting
    assert isinstance(fitter, ForecastFitter)
    small = [name for name in setting.tolerances if setting.looks_at(name) and name not in fit.effects]
    while small:
        values = fit.hypothesis.values
        begun = [Hypothesis.of(setting, (*fit.effects, name), values) for name in small]
        larger = [fitter.converged(fitter.fit(each, fit.levels)) for each in begun]
        best = max(range(len(small)), key=lambda i: larger[i].log_likelihood)
        if not fitter.completes(fit, larger[best]):
            break
        fit = search.store.keep(larger[best])
        del small[best]
    return fit
