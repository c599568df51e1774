"""Fits are looked for again from near, until nothing better is there."""

from dataclasses import replace

import pytest
from diagnosis.recorded import bench, forecasts

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection import fit_store
from wipx.diagnosis.selection.fit_store import FitStore

PLAY = "actuator/backlash"
TRUE = {"gap": 6e-3, "drive_inertia": 0.2, "drive_damping": 0.0, "returned": 1.0, "contact_time": 0.0}


def test_a_fit_beside_its_peak_is_left_and_one_on_it_is_kept(fresh_seed: int):
    case = bench("linear_axis", {PLAY: TRUE}, fresh_seed)
    nominal = case.fit()
    store = FitStore.of(case.fitter, case.setting, nominal)
    wide = {f"{PLAY}.{symbol}": value for symbol, value in {**TRUE, "gap": 1.5 * TRUE["gap"]}.items()}
    beside = case.fitter.fit(Hypothesis.of(case.setting, (PLAY,), wide), nominal.levels, steps=0)
    found = store.escaped(beside)
    assert found.log_likelihood > beside.log_likelihood + 1.0
    assert store.escaped(found) is found
    assert store.escaped(nominal).log_likelihood >= nominal.log_likelihood


def test_an_effect_of_which_screening_expects_little_is_fitted_if_its_start_explains_most(
    monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    case = bench("wip", {"sensor_theta/delay": {"tau": 0.02}}, fresh_seed)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    screened = fit_store.candidates_beside(fitter, case.setting, nominal)
    late = [replace(each, gain=1e-3) for each in screened if each.effect == "sensor_theta/delay"]
    others = [each for each in screened if each.effect != "sensor_theta/delay"]
    monkeypatch.setattr(fit_store, "candidates_beside", lambda *given: [*others, *late])
    fits = FitStore.of(fitter, case.setting, nominal).extensions(nominal)
    assert len(fits) < len({each.effect for each in screened})
    assert fits[0].effects == ("sensor_theta/delay",)


def test_a_branch_keeps_its_fits_to_itself_until_they_are_adopted(fresh_seed: int):
    """Where a fit starts depends on what is known; work side by side must not depend on what is done first."""
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 1.0}}, fresh_seed)
    store = FitStore.of(case.fitter, case.setting, case.fit())
    branch = store.branch()
    found = branch.fitted(("translation/coulomb",), branch.nominal)
    assert branch.fitted(("translation/coulomb",), branch.nominal) is found
    assert store.branch().fitted(("translation/coulomb",), store.nominal) is not found
    store.adopt(branch)
    assert store.fitted(("translation/coulomb",), store.nominal) is found
    worse = store.branch()
    worse.keep(replace(found, log_likelihood=found.log_likelihood - 1.0))
    store.adopt(worse)
    assert store.fitted(("translation/coulomb",), store.nominal) is found
