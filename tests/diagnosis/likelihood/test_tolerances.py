"""What every machine has a little of is not taken for an effect of the vocabulary."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench, forecasts

from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.tolerances import tolerances

ENCODER, DRIVE = "sensor_theta/eccentricity", "actuator/sag"


def beside_doubts(case: Bench, effect: str) -> tuple[bool, bool]:
    """Whether an effect gains on held-out stretches, and whether it holds beside what every machine has a little of."""
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    found = fitter.first_fit(Hypothesis.of(case.setting, (effect,), {}))
    return fitter.completes(nominal, found), fitter.holds(nominal, found)


@pytest.mark.parametrize(("number", "sine"), [(6.0, 0.02), (14.0, -0.03), (30.0, 0.03)])
def test_the_periods_of_an_eccentric_encoder_are_read(number: float, sine: float, fresh_seed: int):
    case = bench("pendulum", {ENCODER: {"s": sine, "c": 0.01, "n": number}}, fresh_seed, count=3)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    laws = tolerances(case.setting, fitter, fitter.predictions, nominal)
    assert set(laws) == {ENCODER, DRIVE}
    assert laws[ENCODER]["n"] == pytest.approx(number, rel=0.35)
    moved = fitter.in_doubt(nominal).hypothesis.values
    assert moved[f"{ENCODER}.s"] == pytest.approx(sine, rel=0.5)


def test_a_bias_is_not_named_where_an_encoder_is_eccentric_and_is_where_there_is_one(fresh_seed: int):
    eccentric = bench("wip", {ENCODER: {"s": 0.005, "c": 0.015, "n": 6.0}}, fresh_seed, count=3)
    assert beside_doubts(eccentric, "sensor_theta/bias") == (True, False)
    biased = bench("wip", {"sensor_theta/bias": {"b": 0.02}}, fresh_seed, count=3)
    assert beside_doubts(biased, "sensor_theta/bias") == (True, True)


def test_a_gain_is_named_although_drives_sag(fresh_seed: int):
    weak = bench("linear_axis", {"actuator/gain": {"k": 0.85}}, fresh_seed, count=3)
    assert beside_doubts(weak, "actuator/gain") == (True, True)


def test_a_drive_that_sags_about_its_usual_force_has_no_other_gain(fresh_seed: int):
    moved = bench("wip", {}, fresh_seed, count=3)
    u = np.concatenate([recording["u"] for recording in moved.recordings])
    sag = {"d": 0.0, "l": 0.1, "t_0": 1.5, "u_0": float(np.sqrt(np.mean(u**2))), "u_1": float(np.abs(u).max())}
    assert not beside_doubts(bench("wip", {DRIVE: sag}, fresh_seed, count=3), "actuator/gain")[1]


def test_numbers_within_tolerance_have_priors_and_others_are_given(fresh_seed: int):
    case = bench("pendulum", {}, fresh_seed)
    fitter = forecasts(case)
    nominal = fitter.first_fit(Hypothesis.of(case.setting, (), {}))
    moved = fitter.in_doubt(nominal).hypothesis
    free = {number.name: number for number in moved.space.free}
    assert free[f"{ENCODER}.s"].prior_std == pytest.approx(0.01)
    assert free[f"{DRIVE}.l"].prior_std == pytest.approx(0.07)
    assert not {f"{ENCODER}.n", f"{DRIVE}.t_0", f"{DRIVE}.u_0", f"{DRIVE}.u_1"} & set(free)
    assert np.all(np.abs(moved.space.prior_residuals(moved.cube)) < 4.0)
