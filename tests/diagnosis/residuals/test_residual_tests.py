"""Physics without a name is noticed, placed and stood in for; physics with a name leaves nothing over."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, recorded
from identify.emulated_robot import RATE, Robot, nominal_model

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.residuals.discrepancy import process_mean
from wipx.diagnosis.residuals.residual_tests import residual_tests, shapes_of
from wipx.effects.remainder import KNOTS

ANGLES = ("theta1", "theta2")
RATE_OF_CARRIAGE = 2.0  # code of the signal in `remainder`
WAVES = np.array([0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0])  # of no law: it changes sign with speed thrice


def strange_force(size: float) -> dict[str, dict[str, float]]:
    """A force on the carriage over its speed."""
    forces = {f"f{i}": float(size * f) for i, f in enumerate(WAVES)}
    return {"translation/remainder": {"signal": RATE_OF_CARRIAGE, "factor": 0.0, "low": -0.8, "high": 0.8, **forces}}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["wip", "linear_axis"])
def test_a_force_without_a_name_is_flagged_and_stood_in_for(kind: str, fresh_seed: int):
    answer = bench(kind, strange_force(1.0), fresh_seed, count=4).diagnosed()
    left = answer.unexplained
    assert answer.verdict == "unexplained"
    assert left.significant
    assert (left.site, left.shape) == ("translation", "a force over x_dot on translation")
    assert left.p_value < 1e-4
    assert "translation/remainder" in answer.model.effects
    for column, nominal in answer.held_out.nominal.items():
        assert answer.held_out.completed[column] < 0.5 * nominal
    assert left.curve is not None
    inside = np.abs(left.curve.bins) < 0.6  # where the carriage is often
    shift = np.interp(left.curve.bins, np.linspace(-0.8, 0.8, KNOTS), WAVES)[inside] - left.curve.force[inside]
    assert np.sqrt(np.mean(shift**2)) < 0.5  # of a force of size one


@pytest.mark.slow
def test_dry_friction_that_changes_along_the_rail_is_flagged(fresh_seed: int):
    levels = {f"f{i}": 0.5 * (1.0 + wave) for i, wave in enumerate(WAVES)}
    wavy = {"translation/remainder": {"signal": 0.0, "factor": -1.0, "low": -0.3, "high": 0.3, **levels}}
    answer = bench("linear_axis", wavy, fresh_seed, count=4, duration=5.0).diagnosed()
    assert answer.verdict == "unexplained"
    assert answer.unexplained.site == "translation"
    assert answer.unexplained.shape == "dry friction on translation that changes with x"
    for column, nominal in answer.held_out.nominal.items():
        assert answer.held_out.completed[column] < 0.3 * nominal


@pytest.mark.slow
def test_what_swings_along_is_named_beyond_the_vocabulary(fresh_seed: int):
    resonance = {"translation/resonance": {"m": 0.3, "f": 2.0, "zeta": 0.05}}
    answer = bench("linear_axis", resonance, fresh_seed, count=4, duration=5.0).diagnosed()
    assert answer.verdict == "unexplained"
    assert answer.unexplained.site == "translation"
    assert "translation/resonance" in answer.unexplained.resembles
    (found,) = (effect for effect in answer.effects if effect.name == "translation/resonance")
    assert found.outside_vocabulary
    values = {p.name.rpartition(".")[2]: p.value for p in found.parameters}
    assert values["m"] == pytest.approx(0.3, rel=0.02)
    assert values["f"] == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("kind", ["wip", "pendulum"])
def test_nothing_is_left_over_by_the_true_model(kind: str):
    case = bench(kind, {}, seed=8)
    fit = case.fit()
    found = residual_tests(case.fitter, fit, shapes_of(case.fitter, fit))
    assert min(one.p_value for one in found) * len(found) > 1e-2
    assert max(one.gain for one in found) < 20.0  # up to nine forces each


@pytest.mark.statistical(allowed=1.0 / 1000)
def test_what_the_steps_of_the_simulator_err_is_not_left_over(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    exact = Robot(nominal_model("double_pendulum"), 4.0, noisy=False).record(rng, 3)
    precise = tuple(
        replace(one, columns={**one.columns, **{c: one[c] + 3e-5 * rng.normal(size=len(one)) for c in ANGLES}})
        for one in exact
    )
    case = Bench(nominal_model("double_pendulum"), precise, {})
    coarse = replace(SIMULATOR, step=1.0 / RATE)  # recorded with a quarter of it
    fitter = InnovationFitter(InnovationsModel.of(coarse, case.data, case.nominal))
    fit = fitter.converged(fitter.fit(Hypothesis.of(case.setting, (), {}), case.quiet))
    found = residual_tests(fitter, fit, shapes_of(fitter, fit))
    assert min(one.p_value for one in found) * len(found) > 1e-3
    monkeypatch.setattr(InnovationFitter, "error_of_steps", lambda self, fit: np.zeros(fit.white.size))
    found = residual_tests(fitter, fit, shapes_of(fitter, fit))
    assert min(one.p_value for one in found) * len(found) < 1e-6


def test_steps_that_err_less_than_noise_explain_nothing(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    case = Bench(nominal_model("linear_axis"), recorded("linear_axis", {}, fresh_seed, count=1), {})
    fit = case.fit()
    shapes = shapes_of(case.fitter, fit)

    def p_values(change: np.ndarray) -> list[float]:
        monkeypatch.setattr(InnovationFitter, "error_of_steps", lambda self, fit: change)
        return [one.p_value for one in residual_tests(case.fitter, fit, shapes)]

    white = fit.white.ravel()
    drifting = np.cumsum(white) / np.sqrt(len(white))  # goes with the noise and with slow forces
    assert p_values(1e-6 * drifting) == pytest.approx(p_values(np.zeros_like(white)), rel=1e-6)


def test_the_found_effect_leaves_nothing_over():
    truth = {"translation/coulomb": {"F_c": 0.5}}
    answer = bench("wip", truth, seed=8).diagnosed()
    assert answer.verdict == "mismatch"
    assert not answer.unexplained.significant
    assert answer.unexplained.p_value > 1e-4


@pytest.mark.statistical(allowed=1.0 / 800)
def test_p_values_of_a_true_model_are_spread_evenly(fresh_seed: int):
    seeds = np.random.default_rng(fresh_seed).integers(2**31, size=12)
    smallest = []
    for seed in seeds:
        case = Bench(nominal_model("linear_axis"), recorded("linear_axis", {}, int(seed), count=1), {})
        fit = case.fit()
        found = residual_tests(case.fitter, fit, shapes_of(case.fitter, fit))
        smallest.append(min(one.p_value for one in found) * len(found))
    assert min(smallest) > 1e-4  # what counts as significant; by chance once in 800 such tests
    assert np.mean(np.array(smallest) < 0.05) < 0.5


def test_the_curve_of_a_known_force_comes_back(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    knots = np.linspace(-1.0, 1.0, KNOTS)
    truth = np.sin(2.0 * knots)
    slopes = rng.normal(size=(4000, KNOTS))
    white = rng.normal(size=4000) - slopes @ truth  # innovations fall where a force is missing
    mean, spread = process_mean(slopes, white, knots)
    assert np.all(spread < 0.03)  # 1/sqrt(4000) = 0.016 without the prior
    assert np.all(np.abs(mean - truth) < 5.0 * spread + 0.01)


def test_without_a_force_the_curve_is_flat(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    mean, _ = process_mean(rng.normal(size=(4000, KNOTS)), rng.normal(size=4000), np.linspace(-1.0, 1.0, KNOTS))
    assert np.abs(mean).max() < 0.08
