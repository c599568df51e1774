"""Friction that differs by direction is one law in the vocabulary of robots from model files."""

from pathlib import Path

import pytest
from diagnosis.recorded import Bench
from diagnosis.recorded_arm import arm, recorded

from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import search_of


@pytest.mark.slow
def test_coulomb_friction_and_a_constant_force_of_the_drive_are_one_law(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    hidden = {"elbow/asymmetric_coulomb": {"F_plus": 0.05, "F_minus": 0.02}}
    case = Bench(model, (recorded(model.with_effects(hidden), fresh_seed),), {})
    nominal = case.fit()
    search = search_of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    pair = case.fit("elbow/coulomb", "actuator_elbow/offset")
    found = search.exchanged(pair).fit
    assert found.effects == ("elbow/asymmetric_coulomb",)
    assert found.log_likelihood == pytest.approx(pair.log_likelihood, abs=1.0)
    assert found.hypothesis.values["elbow/asymmetric_coulomb.F_plus"] == pytest.approx(0.05, rel=0.05)
    assert found.hypothesis.values["elbow/asymmetric_coulomb.F_minus"] == pytest.approx(0.02, rel=0.1)


@pytest.mark.slow
def test_friction_that_is_alike_both_ways_is_the_plain_law(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects({"elbow/coulomb": {"F_c": 0.04}}), fresh_seed),), {})
    nominal = case.fit()
    search = search_of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    assert search.run().fit.effects == ("elbow/coulomb",)
