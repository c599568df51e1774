"""Evidence of several horizons: its likelihood, and what it finds where forces wander."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, forecasts, shaken

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.forecasts import ForecastFitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import Search

FRICTION = {"translation/coulomb": {"F_c": 1.0}}


def test_friction_is_found_although_the_forces_wander(fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    found = Search.of(FitStore.of(fitter, case.setting, nominal), nominal).run().fit
    assert found.effects[0].startswith("translation/")
    level = next(v for name, v in found.hypothesis.values.items() if name.endswith((".F_c", ".F_s")))
    assert level == pytest.approx(1.0, rel=0.3)


def test_nothing_is_asked_for_where_the_nominal_model_is_right(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed, count=3)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    assert Search.of(FitStore.of(fitter, case.setting, nominal), nominal).run().fit.effects == ()


def test_a_mass_that_is_slightly_wrong_is_no_missing_law(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed, count=4, duration=4.0)
    believed = case.nominal.with_values({"body_mass": 1.02 * case.nominal.value("body_mass")})
    case = replace(shaken(case, np.random.default_rng(fresh_seed)), nominal=believed)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    heavier = fitter.first_fit(Hypothesis.of(case.setting, ("geometry/payload",), {}))
    assert not fitter.holds(nominal, heavier)


def test_friction_holds_beside_numbers_in_doubt_and_what_is_not_there_does_not(fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    friction = fitter.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    spring = fitter.converged(fitter.fit(_with(case, friction, "environment/spring"), friction.levels))
    assert fitter.holds(nominal, friction)
    assert not fitter.holds(friction, nominal)
    assert not fitter.holds(friction, spring)


def test_a_law_of_nearly_every_machine_is_preferred_and_needs_less_evidence(fresh_seed: int):
    fitter = forecasts(bench("linear_axis", FRICTION, fresh_seed, count=2))
    usual, rare = fitter.odds_of(("translation/coulomb",)), fitter.odds_of(("actuator/dead_zone",))
    assert usual == fitter.odds_of(())
    assert usual - rare == pytest.approx(np.log(fitter.looked_at))
    assert fitter.odds_of(("translation/viscous", "actuator/dead_zone", "actuator/ripple")) == pytest.approx(2.0 * rare)
    forms = ("translation/stribeck", "translation/presliding")  # of dry friction
    assert [fitter.odds_of((form,)) for form in forms] == pytest.approx([-np.log(2.0)] * 2)
    assert fitter.odds_of(("translation/sticky_spot",)) == rare


def test_a_late_sensor_is_timed_though_every_start_is_estimated_through_it(fresh_seed: int):
    hidden = {"sensor_theta/delay": {"tau": 0.015}}
    case = bench("pendulum", hidden, fresh_seed, count=3)
    late = forecasts(case).first_fit(Hypothesis.of(case.setting, ("sensor_theta/delay",), {}))
    assert late.hypothesis.values["sensor_theta/delay.tau"] == pytest.approx(0.015, rel=0.05)


def test_two_laws_of_one_equation_are_not_told_apart_and_friction_is_from_a_spring(fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=4, duration=4.0), np.random.default_rng(fresh_seed))
    fitter = forecasts(case)
    friction, rich, spring = (
        fitter.first_fit(Hypothesis.of(case.setting, (effect,), {}))
        for effect in ("translation/coulomb", "translation/presliding", "environment/spring")
    )
    assert _separation(fitter, friction, rich) < fitter.rules.answer.told_apart
    assert _separation(fitter, friction, spring) > fitter.rules.answer.told_apart


def _separation(fitter: ForecastFitter, fit: Fit, rival: Fit) -> float:
    return fitter.separation(fit, rival, fit.log_likelihood - rival.log_likelihood, 1.0)


def _with(case: Bench, fit: Fit, effect: str) -> Hypothesis:
    return Hypothesis.of(case.setting, (*fit.effects, effect), fit.hypothesis.values)


def test_half_the_squares_of_white_errors_are_the_loss_of_likelihood(fresh_seed: int):
    case = bench("pendulum", {"pitch/coulomb": {"F_c": 0.1}}, fresh_seed)
    fitter = forecasts(case)
    fit = fitter.first_fit(Hypothesis.of(case.setting, ("pitch/viscous",), {}))
    apart = fitter.by_recording(fit, fit.white)
    assert apart.sum() == pytest.approx(fit.log_likelihood, abs=0.5)
    np.testing.assert_allclose(fitter.white_of(fit, ModelBatch(fit.hypothesis.model))[0], fit.white.ravel(), atol=1e-9)


def test_a_recording_that_is_left_out_does_not_count(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed)
    fitter = forecasts(case)
    others = fitter.without(0)
    assert others.rows < fitter.rows
    fit = others.first_fit(Hypothesis.of(case.setting, ("translation/coulomb",), {}))
    assert others.by_recording(fit, fit.white)[0] == 0.0


@pytest.mark.slow
def test_what_stays_is_told(fresh_seed: int):
    case = shaken(bench("linear_axis", FRICTION, fresh_seed, count=3), np.random.default_rng(fresh_seed))
    answer = diagnose(case.recordings, KnownRobot(case.nominal, {}), SIMULATOR)
    left = answer.remainder
    assert left is not None
    assert 0.0 < left.share_gone <= 1.0
    assert left.forces[0].site == "translation"
    assert left.forces[0].size > 0.0
    assert any(effect.name.startswith("translation/") for effect in answer.effects)


def test_whole_predictions_of_a_fast_log_count(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed, count=2, duration=3.0)
    recordings = tuple(_faster(r, 4) for r in case.recordings)
    fitter = forecasts(replace(case, recordings=recordings))
    assert fitter.is_possible
    assert fitter.rows >= 6


def _faster(recording: Recording, factor: int) -> Recording:
    """The same motion logged more often."""
    t = np.linspace(recording.t[0], recording.t[-1], factor * (len(recording) - 1) + 1)
    return Recording(
        recording.name, {name: np.interp(t, recording.t, values) for name, values in recording.columns.items()}
    )


@pytest.mark.parametrize("hidden", ["actuator/delay", "sensor_theta/delay"])
def test_a_late_drive_and_a_late_sensor_of_one_joint_are_one(hidden: str, fresh_seed: int):
    case = shaken(
        bench("pendulum", {hidden: {"tau": 0.015}}, fresh_seed, count=4, duration=4.0),
        np.random.default_rng(fresh_seed),
    )
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    store = FitStore.of(fitter, case.setting, nominal)
    drive, sensor = (store.fitted((name,), nominal) for name in ("actuator/delay", "sensor_theta/delay"))
    for fit in (drive, sensor):
        assert fit.hypothesis.cube == pytest.approx(drive.hypothesis.cube, abs=0.02)
    assert _separation(fitter, drive, sensor) == _separation(fitter, sensor, drive) == 0.0
    assert any(other.effects == sensor.effects for other in store.replacements(drive, "actuator/delay"))
    assert _separation(fitter, drive, store.fitted(("pitch/viscous",), nominal)) > 0.0
