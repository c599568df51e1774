"""A spring between drive and link is named, with its numbers, where an arm swings on it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import Bench
from diagnosis.recorded_arm import arm, recorded

from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.loose_drive_scan import springs
from wipx.diagnosis.likelihood.hypothesis import ByForces, Hypothesis
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.nested_laws import reduced_effects
from wipx.diagnosis.selection.robot_search import RobotSearch, search_of

SPRING = "actuator_elbow/elasticity"
TRUE = {"drive_inertia": 0.004, "stiffness": 9.0, "damping": 0.015}
ALONE = np.sqrt(TRUE["stiffness"] / TRUE["drive_inertia"])  # [rad/s] of the drive while the link is held


def test_the_first_guess_swings_about_as_the_true_drive_does(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects({SPRING: TRUE}), fresh_seed),), {})
    inertia, stiffness, _ = springs(LeftOverByRow(case.fitter, case.fit()), SPRING)[0]
    assert np.sqrt(stiffness / inertia) == pytest.approx(ALONE, rel=0.3)


@pytest.mark.slow
def test_the_spring_is_named_with_its_numbers(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects({SPRING: TRUE}), fresh_seed),), {})
    nominal = case.fit()
    found = search_of(FitStore.of(case.fitter, case.setting, nominal), nominal).run().fit
    assert found.effects == (SPRING,)
    assert reduced_effects(found, case.fitter.data) is None
    for symbol, value in TRUE.items():
        assert found.hypothesis.values[f"{SPRING}.{symbol}"] == pytest.approx(value, rel=0.1)


def test_the_search_begins_at_the_spring_where_forces_ask_for_what_imitates_it(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects({SPRING: TRUE}), fresh_seed),), {})
    nominal = case.fit()
    asked = {"elbow/rotor_inertia.J": TRUE["drive_inertia"], "actuator_elbow/lag.tau": 0.02}
    setting = replace(
        case.setting, by_forces={name: ByForces(value, 0.1 * value, True) for name, value in asked.items()}
    )
    store = FitStore.of(case.fitter, setting, nominal)
    assert RobotSearch.of(store, nominal).begun().effects == (SPRING,)


@pytest.mark.slow
def test_a_drive_that_swings_unseen_is_an_inertia_at_the_joint(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    inertia = {"elbow/rotor_inertia": {"J": TRUE["drive_inertia"]}}
    case = Bench(model, (recorded(model.with_effects(inertia), fresh_seed),), {})
    nominal = case.fit()
    begin = {f"{SPRING}.{symbol}": value for symbol, value in {**TRUE, "stiffness": 1000.0}.items()}
    stiff = case.fitter.converged(case.fitter.fit(Hypothesis.of(case.setting, (SPRING,), begin), nominal.levels))
    assert reduced_effects(stiff, case.fitter.data) == ("elbow/rotor_inertia",)
    found = search_of(FitStore.of(case.fitter, case.setting, nominal), nominal).run().fit
    assert found.effects == ("elbow/rotor_inertia",)
