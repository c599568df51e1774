"""What is named at last: no size that may be nothing, no swing that noise feigns, no rich law without need."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench, slow

from wipx.diagnosis.decision import confirmation, estimates
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.residuals.residual_tests import Residual, Shape


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


@pytest.mark.parametrize("averaged", [False, True])
def test_what_swings_is_left_only_if_its_law_confirms_it(
    averaged: bool, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    def seeming(fitter: Fitter, fit: Fit, shapes: list[Shape]) -> list[Residual]:
        shape = next(shape for shape in shapes if shape.kind == "resonance")
        return [Residual(shape, 100.0, 1e-12, np.zeros((fit.white.size, 2)))]

    monkeypatch.setattr(confirmation, "residual_tests", seeming)
    robot = bench("linear_axis", {}, fresh_seed)
    means = slow(robot.recordings, np.random.default_rng(fresh_seed))
    answer = Bench(robot.nominal, means if averaged else robot.recordings, {}).diagnosed()
    assert answer.verdict == "consistent"  # the law of a resonance, fitted, gains nothing in either log
