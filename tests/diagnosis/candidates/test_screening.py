"""Screening foretells what a fit would gain."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench

from wipx.diagnosis.candidates.screening import Candidate, candidates_beside
from wipx.diagnosis.likelihood.hypothesis import Hypothesis

SMALL = {  # each worth some tens of nats in these recordings
    "translation/coulomb": ("wip", {"F_c": 8e-3}),
    "pitch/viscous": ("pendulum", {"sigma": 1e-3}),
    "environment/rail_tilt": ("wip", {"angle": 1e-4}),
    "actuator/gain": ("wip", {"k": 1.0012}),
}


def best_prospects(case: Bench) -> dict[str, Candidate]:
    """The best start of each effect beside the nominal model, at the noise that the sensors have."""
    fit = case.fitter.fit(Hypothesis.of(case.setting, (), {}), case.quiet)
    found: dict[str, Candidate] = {}
    for candidate in candidates_beside(case.fitter, case.setting, fit):
        found.setdefault(candidate.effect, candidate)
    return found


@pytest.mark.parametrize("effect", SMALL)
def test_a_small_dose_gains_what_fitting_it_gains(effect: str):
    kind, values = SMALL[effect]
    case = bench(kind, {effect: values}, seed=4)
    nominal = case.fitter.fit(Hypothesis.of(case.setting, (), {}), case.quiet)
    candidate = best_prospects(case)[effect]
    fitted = case.fitter.fit(Hypothesis.of(case.setting, (effect,), candidate.values), case.quiet)
    gained = fitted.log_likelihood - nominal.log_likelihood
    assert gained > 5.0
    assert candidate.gain == pytest.approx(gained, rel=0.2)
    (symbol,) = values
    assert candidate.values[f"{effect}.{symbol}"] == pytest.approx(values[symbol], abs=4.0 * candidate.deviation)


@pytest.mark.parametrize("kind", ["wip", "pendulum", "linear_axis", "double_pendulum"])
def test_absent_effects_gain_next_to_nothing(kind: str):
    found = best_prospects(bench(kind, {}, seed=4))
    assert found
    assert max(candidate.gain for candidate in found.values()) < 6.0  # chi-squared, one degree of freedom: 12


def test_an_effect_at_hand_is_not_looked_for_again():
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 0.3}}, seed=4)
    names = {
        candidate.effect for candidate in candidates_beside(case.fitter, case.setting, case.fit("translation/coulomb"))
    }
    assert "translation/coulomb" not in names
    assert "translation/stribeck" not in names  # the same friction with more to it
    assert "environment/rail_tilt" in names


def test_the_vocabulary_comes_before_what_is_beyond_it():
    case = bench("linear_axis", {}, seed=4)
    nominal = case.fit()
    within = {candidate.effect for candidate in candidates_beside(case.fitter, case.setting, nominal)}
    outside_vocabulary = {
        candidate.effect for candidate in candidates_beside(case.fitter, case.setting, nominal, outside_vocabulary=True)
    }
    assert within.isdisjoint(outside_vocabulary)
    assert "translation/lugre" in outside_vocabulary


def test_a_deviation_shrinks_with_the_root_of_the_recordings():
    few, many = (best_prospects(bench("linear_axis", {}, seed=4, count=n))["translation/viscous"] for n in (2, 8))
    assert many.deviation == pytest.approx(0.5 * few.deviation, rel=0.35)  # excitations are drawn afresh
    assert np.isfinite(few.deviation)


def test_a_start_makes_room_for_an_effect_that_another_one_stood_in_for():
    case = bench("linear_axis", {"actuator/gain": {"k": 1.1}, "translation/viscous": {"sigma": 2.0}}, seed=4)
    base = case.fitter.fit(Hypothesis.of(case.setting, ("translation/viscous",), {}), case.quiet)
    gain = next(c for c in candidates_beside(case.fitter, case.setting, base) if c.effect == "actuator/gain")
    values = [{**base.hypothesis.values, **gain.values}, *gain.moved]
    starts = [Hypothesis.of(case.setting, (*base.effects, "actuator/gain"), each) for each in values]
    alone, moved, partway = case.fitter.likelihoods_of(starts, base.levels)
    assert moved > alone
    assert partway > base.log_likelihood
    assert gain.moved[0]["translation/viscous.sigma"] == pytest.approx(2.0, rel=0.2)
