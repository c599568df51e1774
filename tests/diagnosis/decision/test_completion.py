"""What is named of the effects that forecasts find, and what the completed model has beside them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, forecasts, shaken

import wipx
from wipx.diagnosis.decision.completion import completed, dominant, likely, transferring
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.tolerances import tolerances
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.rules import USUAL
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search, named_effects
from wipx.proof.blind_robots.dirty import draw_dirty
from wipx.proof.blind_robots.write import case_files

FRICTION = {"translation/coulomb": {"F_c": 1.0}}
SAG = {"actuator/sag": {"d": 0.01, "l": 0.15, "t_0": 2.0, "u_0": 4.0, "u_1": 10.0}}
DIRT_ONLY = 159204493570571078722387199942759287503  # a pendulum with an eccentric encoder, and forces from outside


def search_of(case: Bench) -> Search:
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    return Search.of(FitStore.of(fitter, case.setting, nominal), nominal)


def _with(case: Bench, fit: Fit, effect: str) -> Hypothesis:
    return Hypothesis.of(case.setting, (*fit.effects, effect), fit.hypothesis.values)


def test_what_is_smaller_than_the_rest_is_not_named(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    search, fitter = search_of(case), forecasts(case)
    friction = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    more = fitter.converged(fitter.fit(_with(case, friction, "environment/spring"), friction.levels))
    kept = dominant(search, search.store.keep(more))
    assert kept.fit.effects == friction.effects
    assert [each.name for each in kept.considered] == ["environment/spring"]
    without, stays = (fitter.squared_scales(fit) for fit in (search.nominal, kept.fit))
    assert without[0] / stays[0] > 1.0 + fitter.rules.forecasts.least_removed
    monkeypatch.setattr(Setting, "expects", lambda self, effect: effect == "environment/spring")
    assert dominant(search, more).fit is more  # recorded forces show it as well


@pytest.mark.slow
def test_what_one_recording_has_of_its_own_is_no_law_of_the_machine(fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    first, *others = case.recordings
    pulled = replace(first, columns={**first.columns, "u": first["u"] + 1.0})  # that its log does not know of
    case = replace(case, recordings=(pulled, *others))
    search, fitter = search_of(case), forecasts(case)
    context = Context.of(case.recordings, case.setting, SIMULATOR, USUAL)
    start = Hypothesis.of(case.setting, ("translation/coulomb", "actuator/offset"), {})
    both = search.store.keep(fitter.first_fit(start))
    kept = transferring(context.held_out, search, both)
    assert kept.fit.effects == ("translation/coulomb",)
    assert [each.reason for each in kept.considered] == ["predicts held-out recordings worse"]


def test_what_is_likely_joins_the_model_though_no_name_holds(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    monkeypatch.setattr(ForecastFitter, "holds", lambda self, smaller, larger: False)
    search = search_of(case)
    more = likely(search, search.nominal, None)
    assert any(effect.startswith("translation/") for effect in more.fit.effects)  # one of the laws of friction
    assert {each.name for each in more.considered} == set(more.fit.effects)
    fitter = forecasts(case)
    assert fitter.squared_scales(more.fit)[0] < fitter.squared_scales(search.nominal)[0]
    monkeypatch.setattr(ForecastFitter, "is_likely", lambda self, smaller, larger: False)
    assert likely(search, search.nominal, None).fit is search.nominal


def test_a_drive_that_sags_sags_in_the_completed_model_and_makes_it_predict_better(fresh_seed: int):
    case = shaken(
        bench("linear_axis", {**FRICTION, **SAG}, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed)
    )
    search, fitter = search_of(case), forecasts(case)
    friction = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    knowing = search.knowing(tolerances(case.setting, fitter, fitter.predictions, friction))
    more = completed(knowing, friction)
    assert "actuator/sag" in more.effects
    assert more.hypothesis.values["actuator/sag.l"] == pytest.approx(0.15, abs=0.08)
    assert fitter.squared_scales(more)[0] < fitter.squared_scales(friction)[0]


def test_a_drive_that_does_not_sag_does_not_in_the_completed_model(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0)
    search, fitter = search_of(case), forecasts(case)
    friction = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    knowing = search.knowing(tolerances(case.setting, fitter, fitter.predictions, friction))
    assert completed(knowing, friction) is friction


@pytest.mark.slow
def test_a_search_goes_on_beside_a_sag_and_leaves_it_in_place(fresh_seed: int):
    hidden = {**FRICTION, **SAG, "translation/viscous": {"sigma": 2.0}}
    case = shaken(bench("linear_axis", hidden, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    search, fitter = search_of(case), forecasts(case)
    friction = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    knowing = search.knowing(tolerances(case.setting, fitter, fitter.predictions, friction))
    sagging = fitter.converged(fitter.fit(_with_sag(knowing, friction), friction.levels))
    more = knowing.grown(knowing.store.keep(sagging)).fit
    assert len(named_effects(more)) > len(friction.effects)
    assert "actuator/sag" in more.effects


def _with_sag(search: Search, fit: Fit) -> Hypothesis:
    return Hypothesis.of(search.store.setting, (*fit.effects, "actuator/sag"), fit.hypothesis.values)


@pytest.mark.slow
def test_what_every_machine_has_is_in_the_model_but_not_named(fresh_seed: int):
    case = shaken(
        bench("linear_axis", {**FRICTION, **SAG}, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed)
    )
    answer = diagnose(case.recordings, KnownRobot(case.nominal, {}), SIMULATOR)
    assert "actuator/sag" not in {effect.name for effect in answer.effects}
    minor = {effect.name for effect in answer.minor}
    assert minor <= set(answer.model.effects)
    assert "sag" not in answer.unexplained.shape  # what the model has is not what it leaves over
    assert all(answer.held_out.completed[name] < answer.held_out.nominal[name] for name in ("x",))


@pytest.mark.slow
def test_a_simple_law_that_is_left_of_a_rich_one_is_named_only_if_it_removes_enough(tmp_path: Path):
    drawn = draw_dirty(np.random.default_rng(DIRT_ONLY), "dirt_only", (4.0, 6.0))
    for name, text in case_files(drawn).visible.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    answer = wipx.diagnose(tmp_path)
    assert not answer.effects  # beside the eccentricity, a peak of friction is no better than a little of it, or none
