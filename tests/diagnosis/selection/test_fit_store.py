"""Fits are looked for again from near, until nothing better is there."""

from diagnosis.recorded import bench

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
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
