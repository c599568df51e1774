"""What is named at last: no size that may be nothing, no swing that means feign, no rich law without need."""

import itertools

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, slow

from wipx.diagnosis.decision import confirmation, estimates
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.held_out import HeldOut
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.residuals.residual_tests import Residual, Shape
from wipx.diagnosis.rules import USUAL
from wipx.diagnosis.selection.criteria import Criteria
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search


@pytest.mark.slow
def test_a_size_that_the_step_of_the_simulation_moves_is_not_named(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    robot = bench("linear_axis", {"translation/viscous": {"sigma": 1.0}}, fresh_seed)
    assert [effect.name for effect in robot.diagnosed().effects] == ["translation/viscous"]

    def all_of_it(fitter: Fitter, fit: Fit) -> np.ndarray:
        return np.abs(fit.hypothesis.cube - fit.hypothesis.space.neutral)

    monkeypatch.setattr(estimates, "shift_by_step", all_of_it)
    monkeypatch.setattr(ForecastFitter, "is_possible", False)  # innovations alone decide
    answer = robot.diagnosed()
    assert "translation/viscous" not in {effect.name for effect in answer.effects}
    assert any(c.reason == "has a size that cannot be told from zero" for c in answer.candidates)


@pytest.mark.parametrize(("averaged", "verdict"), [(False, "unexplained"), (True, "consistent")])
def test_means_of_commands_may_feign_what_swings(
    averaged: bool, verdict: str, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    def seeming(fitter: Fitter, fit: Fit, shapes: list[Shape]) -> list[Residual]:
        shape = next(shape for shape in shapes if shape.kind == "resonance")
        return [Residual(shape, 100.0, 1e-12, np.zeros((fit.white.size, 2)))]

    monkeypatch.setattr(confirmation, "residual_tests", seeming)
    robot = bench("linear_axis", {}, fresh_seed)
    means = slow(robot.recordings, np.random.default_rng(fresh_seed))
    answer = Bench(robot.nominal, means if averaged else robot.recordings, {}).diagnosed()
    assert answer.verdict == verdict  # the law of a resonance, fitted, gains nothing in either log


@pytest.mark.slow
def test_small_print_is_kept_where_something_is_left_without_it(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    hidden = {"translation/viscous": {"sigma": 3.0}, "environment/spring": {"k": 1.0, "x0": 0.0}}
    robot = bench("linear_axis", hidden, fresh_seed)
    monkeypatch.setattr(HeldOut, "gain", lambda self, fitter, repeated, reduced: 0.0)  # nothing shows
    answer = robot.diagnosed()
    assert {effect.name for effect in answer.effects} == set(hidden)
    assert answer.verdict == "mismatch"


def test_exchanges_do_not_go_round_in_circles(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    robot = bench("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, fresh_seed)
    context = Context.of(robot.recordings, robot.setting, SIMULATOR, USUAL)
    nominal = context.by_row.first_fit(Hypothesis.of(robot.setting, (), {}), context.first_levels)
    search = Search(FitStore.of(context.by_row, robot.setting, nominal), Criteria(context.by_row, nominal), None)
    rich = search.store.fitted(("translation/stribeck",), nominal)

    def rich_laws(context: Context, search: Search, fit: Fit) -> list[str]:
        return [effect for effect in fit.effects if effect == "translation/stribeck"]

    exchanges = itertools.count()
    monkeypatch.setattr(confirmation, "_uncertain", rich_laws)  # so its simple law has its place
    monkeypatch.setattr(
        HeldOut, "gain", lambda self, fitter, repeated, reduced: -1.0
    )  # which held-out recordings contradict
    monkeypatch.setattr(HeldOut, "error", lambda self, repeated: 0.5 ** next(exchanges))  # any exchange is better
    kept = confirmation.confirmed(context, search, rich)
    assert len(kept.fit.effects) == 1
    left = [each.name for each in kept.considered]
    assert left.count("translation/stribeck") == 1
