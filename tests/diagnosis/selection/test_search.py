"""A search returns what it chose and what it considered."""

import pytest
from diagnosis.recorded import Bench, bench

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search
from wipx.sim.analytic import AnalyticSimulator

FRICTION = {"translation/coulomb": {"F_c": 1.0}}


def search_of(case: Bench) -> Search:
    nominal = case.fit()
    return Search.of(FitStore.of(case.fitter, case.setting, nominal), nominal)


def test_a_search_finds_friction_and_tells_what_it_considered(fresh_seed: int):
    search = search_of(bench("linear_axis", FRICTION, fresh_seed))
    chosen = search.run()
    assert chosen.fit.effects == ("translation/coulomb",)
    taken = [each.name for each in chosen.considered if each.chosen]
    assert taken == ["translation/coulomb"]
    assert len(chosen.considered) > len(taken)


def test_a_search_finds_nothing_where_nothing_is_missing(fresh_seed: int):
    search = search_of(bench("linear_axis", {}, fresh_seed))
    chosen = search.run()
    assert chosen.fit is search.nominal
    assert not any(each.chosen for each in chosen.considered)


def test_a_second_run_of_a_search_says_the_same(fresh_seed: int):
    search = search_of(bench("linear_axis", FRICTION, fresh_seed))
    nominal, first = search.nominal, search.run()
    second = search.run()
    assert second.fit is first.fit
    assert second.considered == first.considered
    assert search.nominal is nominal


@pytest.mark.slow
def test_threads_change_nothing(fresh_seed: int):
    case = bench("linear_axis", {**FRICTION, "actuator/dead_zone": {"band": 0.5}}, fresh_seed)
    robot = KnownRobot(case.nominal, {})
    one, three = (diagnose(case.recordings, robot, AnalyticSimulator(threads=threads)) for threads in (1, 3))
    assert [(each.name, each.parameters) for each in one.effects] == [
        (each.name, each.parameters) for each in three.effects
    ]


def test_a_superfluous_effect_is_pruned_and_told(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed)
    search = search_of(case)
    both = case.fit("translation/coulomb", "environment/spring")
    pruned = search.pruned(both)
    assert pruned.fit.effects == ("translation/coulomb",)
    assert [(each.name, each.reason) for each in pruned.considered] == [
        ("environment/spring", "superfluous beside the others")
    ]


def test_one_effect_takes_the_place_of_two_that_imitate_it(fresh_seed: int):
    case = bench("wip", {"sensor_theta/scale": {"e": 0.06}}, fresh_seed)
    search = search_of(case)
    rescaled = {"sensor_x/scale.e": -0.06, "actuator/gain.k": 1.06}  # a linear robot looks the same at another scale
    hypothesis = Hypothesis.of(case.setting, ("sensor_x/scale", "actuator/gain"), rescaled)
    two = case.fitter.converged(case.fitter.fit(hypothesis, search.nominal.levels))
    assert evidence(search.nominal, two) > 100.0
    assert search.exchanged(two).fit.effects == ("sensor_theta/scale",)


def test_a_store_fits_a_set_of_effects_once(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed, count=1, duration=1.0)
    nominal = case.fit()
    store = FitStore.of(case.fitter, case.setting, nominal)
    fit = store.fitted(("translation/coulomb", "environment/spring"), nominal)
    assert store.fitted(("environment/spring", "translation/coulomb"), nominal) is fit
    assert store.without(store.without(fit, "environment/spring"), "translation/coulomb") is nominal
