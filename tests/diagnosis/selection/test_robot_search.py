"""A robot is searched part by part: what its parts are, and what an effect is worth beside those of other parts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench, forecasts
from diagnosis.recorded_arm import arm, recorded
from sim.random_trees import mjcf

from wipx.core.plant import robot_plant
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.rules import USUAL
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import PartSearch, RobotSearch, expected_loss, parts_of
from wipx.recordings.robot_model import read_tree


def test_every_site_belongs_to_one_part_and_links_stand_together(fresh_seed: int, tmp_path: Path):
    file = tmp_path / "robot.xml"
    file.write_text(mjcf(4, np.random.default_rng(fresh_seed)), encoding="utf-8")
    plant = robot_plant(read_tree(file, {}), {})
    parts = parts_of(plant)
    assert sorted(site for part in parts for site in part) == sorted(plant.sites)
    assert len(parts) == 1 + len(plant.joints)
    links = {site for site in plant.sites if site.startswith("link_")}
    assert links < parts[0]
    for joint, part in zip(plant.joints, parts[1:], strict=True):
        assert {plant.joint_at(site) for site in part} == {joint}


def test_noise_that_is_fitted_anew_takes_over_part_of_the_expected_loss(fresh_seed: int):
    case = bench("linear_axis", {"translation/viscous": {"sigma": 0.02}}, fresh_seed)
    with_it, without = case.fit("translation/viscous"), case.fit()
    loss = evidence(without, with_it)
    assert loss > 5.0
    assert loss < 1.1 * expected_loss(with_it, "translation/viscous")


def test_an_effect_that_does_nothing_is_no_loss_whatever_its_other_numbers(fresh_seed: int):
    """Recordings tell nothing of a place where no mass is, or of a speed without a peak."""
    fit = bench("linear_axis", {}, fresh_seed).fit("translation/viscous", "translation/stribeck")
    speed = fit.hypothesis.space.names.index("translation/stribeck.v_s")
    cube, jacobian = fit.hypothesis.space.neutral.copy(), fit.jacobian.copy()
    cube[speed], jacobian[:, speed] = 0.7, 0.0
    nothing = replace(fit, hypothesis=fit.hypothesis.at(cube), jacobian=jacobian)
    assert abs(expected_loss(nothing, "translation/stribeck")) < 1e-6


ROTOR = {"elbow/rotor_inertia": {"J": 0.01}}
LOAD = {"link_lower/payload": {"mass": 0.1, "x": 0.01, "y": 0.02, "z": -0.25}}
FRICTION = {"shoulder/coulomb": {"F_c": 0.08}, "elbow/coulomb": {"F_c": 0.04}}


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [ROTOR | FRICTION, LOAD | FRICTION], ids=["rotor", "load"])
def test_a_load_and_a_rotor_are_told_apart_beside_friction(
    hidden: dict[str, dict[str, float]], tmp_path: Path, fresh_seed: int
):
    """Without what recorded forces say beforehand."""
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects(hidden), fresh_seed),), {})
    nominal = case.fit()
    search = RobotSearch.of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    assert set(search.run(nominal).fit.effects) == hidden.keys()


SHIFT = {"link_lower/com_offset": {"x": 0.02, "y": 0.01, "z": 0.03}}


@pytest.mark.slow
def test_a_link_gets_the_law_of_its_mass_that_suits_it_while_friction_is_still_missing(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects(SHIFT | FRICTION), fresh_seed),), {})
    nominal = case.fit()
    search = PartSearch.of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    loaded = search.store.keep(case.fit("link_lower/payload"))
    assert search.with_better_links(loaded).effects == tuple(SHIFT)


def test_what_one_joint_explains_does_not_raise_what_another_must_gain(tmp_path: Path, fresh_seed: int):
    hidden = {"shoulder/coulomb": {"F_c": 0.3}, "elbow/coulomb": {"F_c": 2e-5}}
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects(hidden), fresh_seed),), {})
    rules = replace(USUAL, selection=replace(USUAL.selection, least_share=0.5, most_asked=1e9))
    fitter, nominal = replace(case.fitter, rules=rules), case.fit()
    search = RobotSearch.of(FitStore.of(fitter, case.setting, nominal), nominal)
    both = search.store.keep(case.fit(*hidden))
    smaller = search.store.without(both, "elbow/coulomb")
    assert evidence(smaller, both) < search.criteria.required_gain(smaller, both)
    assert search.pruned(both).fit is both


LOOSE = {"actuator_elbow/elasticity": {"drive_inertia": 0.01, "stiffness": 4.0, "damping": 0.01}}
IMITATION = ("elbow/spring", "sensor_elbow/delay", "link_lower/com_offset")


@pytest.mark.parametrize("hidden", [LOOSE, FRICTION], ids=["a loose drive", "friction"])
def test_what_was_there_before_a_drive_proved_loose_goes_if_it_explains_less(
    hidden: dict[str, dict[str, float]], tmp_path: Path, fresh_seed: int
):
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects(hidden), fresh_seed, (0.2, 0.05)),), {})
    nominal = case.fit()
    search = RobotSearch.of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    before, larger = (_fitted(case, nominal, effects, hidden) for effects in (IMITATION, (*IMITATION, *hidden)))
    kept = tuple(hidden) if hidden is LOOSE else larger.effects
    assert search.freed(before, larger).effects == kept


PENDULUM = """<mujoco><worldbody><body name="rod"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="pivot" axis="0 1 0" damping="0.02"/></body></worldbody></mujoco>"""
ABOVE = {"link_rod/payload": {"mass": 0.3, "z": 0.2}, "pivot/spring": {"k": 0.6}}


def test_an_effect_takes_the_place_of_that_of_another_part_while_what_is_beside_it_gives_way(
    tmp_path: Path, fresh_seed: int
):
    """A load above a pivot and a spring that holds it up move like a rotor, which needs no spring."""
    model = arm(tmp_path, PENDULUM)
    case = Bench(model, (recorded(model.with_effects({"pivot/rotor_inertia": {"J": 0.02}}), fresh_seed, (0.3,)),), {})
    nominal = case.fit()
    search = RobotSearch.of(FitStore.of(case.fitter, case.setting, nominal), nominal)
    whole = search.store.keep(_fitted(case, nominal, tuple(ABOVE), ABOVE))
    lead, held = search.replaced_across(whole, "link_rod/payload", "pivot/rotor_inertia")
    assert set(held.effects) == {"pivot/spring", "pivot/rotor_inertia"}
    assert lead > 100.0


def _fitted(case: Bench, nominal: Fit, effects: tuple[str, ...], values: dict[str, dict[str, float]]) -> Fit:
    """The fit of some effects from some values of them on, with the noise of the nominal model at first."""
    start = {f"{name}.{symbol}": value for name, own in values.items() for symbol, value in own.items()}
    return case.fitter.first_fit(Hypothesis.of(case.setting, effects, start), nominal.levels)


def test_forecasts_go_on_from_all_that_innovations_found(fresh_seed: int, tmp_path: Path):
    """Also from one law in the place of two, of which forecasts would name the two."""
    model, law = arm(tmp_path), "elbow/asymmetric_coulomb"
    levels = {"F_plus": 0.05, "F_minus": 0.02}
    case = Bench(model, (recorded(model.with_effects({law: levels}), fresh_seed),), {})
    begin = {f"{law}.{symbol}": value for symbol, value in levels.items()}
    by_row = case.fitter.fit(Hypothesis.of(case.setting, (law,), begin), case.quiet)
    ahead = forecasts(case)
    nominal = ahead.first_fit(Hypothesis.of(case.setting, (), {}))
    search = RobotSearch.of(FitStore.of(ahead, case.setting, nominal), nominal)
    assert search.fit_from(by_row).effects == (law,)
