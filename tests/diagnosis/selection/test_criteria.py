"""Criteria decide by numbers of fits alone."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench

from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.criteria import Criteria, evidence, score


@dataclass(frozen=True)
class Counted:
    """A noise model, as far as criteria look at it."""

    reported: float
    log_likelihood: float = 0.0


@pytest.fixture
def case(fresh_seed: int) -> Bench:
    return bench("linear_axis", {}, fresh_seed, count=1, duration=1.0)


def fit_of(case: Bench, *effects: str, moved: float = 0.0, reported: float = 0.0) -> Fit:
    """A fit with likelihoods [nats] of the motion and of the reported forces as given."""
    return replace(case.fit(*effects), log_likelihood=moved + reported, noise=Counted(reported))


@pytest.mark.parametrize(
    ("moved", "reported", "counted"), [(10.0, 4.0, 14.0), (10.0, 40.0, 20.0), (-3.0, 40.0, -3.0), (10.0, -4.0, 6.0)]
)
def test_reported_forces_count_at_most_as_much_as_the_motion(
    case: Bench, moved: float, reported: float, counted: float
):
    assert evidence(fit_of(case), fit_of(case, moved=moved, reported=reported)) == pytest.approx(counted)


def test_a_score_pays_half_the_logarithm_of_the_rows_for_every_number(case: Bench):
    base, friction = fit_of(case), fit_of(case, "translation/stribeck", moved=50.0)
    numbers = len(friction.hypothesis.cube)
    assert numbers > 1
    assert score(friction, base) == pytest.approx(50.0 - 0.5 * numbers * np.log(friction.rows))


def test_an_effect_must_gain_more_where_much_is_explained(case: Bench):
    nominal = fit_of(case)
    criteria = Criteria(case.fitter, nominal)

    def required(explained: float) -> float:
        smaller = fit_of(case, "translation/viscous", moved=explained)
        larger = fit_of(case, "translation/viscous", "translation/coulomb", moved=explained)
        return criteria.required_gain(smaller, larger)

    assert required(0.0) == required(-100.0) < required(3e3) < required(7e3)
    assert required(1e6) == required(1e7)  # but not without end


def test_what_gains_less_than_required_does_not_gain_enough(case: Bench):
    nominal = fit_of(case)
    criteria = Criteria(case.fitter, nominal)
    least = criteria.required_gain(nominal, fit_of(case, "translation/viscous"))
    assert least > 0.0
    assert not criteria.gains_enough(nominal, fit_of(case, "translation/viscous", moved=least - 0.1))
    assert criteria.gains_enough(nominal, fit_of(case, "translation/viscous", moved=least + 0.1))


def test_a_lead_is_that_of_penalised_evidence_and_changes_sign(case: Bench):
    nominal, simple = fit_of(case), fit_of(case, "translation/viscous", moved=40.0)
    rich = fit_of(case, "translation/stribeck", moved=40.0)
    criteria = Criteria(case.fitter, nominal)
    assert criteria.lead(simple, rich) > 0.0  # as likely with fewer numbers
    assert criteria.lead(rich, simple) == pytest.approx(-criteria.lead(simple, rich))


def test_bristles_must_gain_more_beside_the_law_that_they_contain(case: Bench):
    criteria = Criteria(case.fitter, fit_of(case))
    bristles = fit_of(case, "translation/presliding", moved=1e3)
    stribeck = fit_of(case, "translation/stribeck", moved=1e3)
    assert criteria.tolerance(bristles, ("translation/coulomb",)) > criteria.tolerance(
        stribeck, ("translation/coulomb",)
    )


@pytest.mark.parametrize("peak", [0.0, 0.3])
def test_a_rich_law_is_told_from_the_simple_one_where_it_acts(peak: float, fresh_seed: int):
    numbers = {"F_c": 0.3, "F_s": 0.3 + peak, "v_s": 0.05}
    case = bench("linear_axis", {"translation/stribeck": numbers}, fresh_seed)
    true = {f"translation/stribeck.{symbol}": value for symbol, value in numbers.items()}
    hypothesis = Hypothesis.of(case.setting, ("translation/stribeck",), true)
    rich = case.fitter.converged(case.fitter.fit(hypothesis, case.quiet))
    assert Criteria(case.fitter, case.fit()).tells_apart(rich, case.fit("translation/coulomb")) == (peak > 0.0)
