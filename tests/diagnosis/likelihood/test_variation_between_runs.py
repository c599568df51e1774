"""A number that moves from run to run says so; one that stays does not."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench, forecasts, recorded

from wipx.core.results import NINETY_FIVE
from wipx.diagnosis.decision.estimates import estimates
from wipx.diagnosis.likelihood.hypothesis import Hypothesis


def _level(case: Bench):
    fit = case.fit("translation/coulomb")
    return next(number for number in estimates(case.fitter, fit, case.fit()) if number.name.endswith("F_c"))


def test_friction_that_differs_between_runs_is_told(fresh_seed: int):
    levels = (0.7, 1.0, 1.4)
    runs = [
        recorded("linear_axis", {"translation/coulomb": {"F_c": f}}, fresh_seed + i, count=1)
        for i, f in enumerate(levels)
    ]
    case = Bench(bench("linear_axis", {}, fresh_seed).nominal, tuple(r for run in runs for r in run), {})
    level = _level(case)
    assert level.from_run_to_run is not None
    low, high = level.from_run_to_run
    np.testing.assert_allclose([low, high], [levels[0], levels[-1]], rtol=0.15)
    assert level.low < levels[0]
    assert level.high > levels[-1]


def test_friction_that_is_the_same_in_all_runs_has_one_interval(fresh_seed: int):
    level = _level(bench("linear_axis", {"translation/coulomb": {"F_c": 1.0}}, fresh_seed, count=4))
    assert level.from_run_to_run is None
    assert level.high - level.low < 0.1


@pytest.mark.parametrize("count", [1, 4])
def test_intervals_of_machines_leave_room_for_other_runs_the_less_the_more_runs_agree(count: int, fresh_seed: int):
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 1.0}}, fresh_seed, count=count, duration=4.0)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    fit = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    level = next(number for number in estimates(fitter, fit, nominal) if number.name.endswith("F_c"))
    usual = fitter.own_rules.unsteady * level.value / np.sqrt(count)
    assert 0.5 * (level.high - level.low) == pytest.approx(NINETY_FIVE * usual, rel=0.3)
