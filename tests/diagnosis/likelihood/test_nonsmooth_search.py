"""Likelihoods that are rough, of a drive that crosses a gap or is late: the search sees beyond the kinks."""

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench
from identify.emulated_robot import nominal_model

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.loose_drive_scan import plays
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.nonsmooth_search import alike, delays, searched_by_trial
from wipx.sim.inputs import Inputs

PLAY = "actuator/backlash"
TRUE = {"gap": 6e-3, "drive_inertia": 0.2, "drive_damping": 0.0, "returned": 1.0, "contact_time": 0.0}


def test_trials_lose_nothing_and_intervals_hold_drives_that_cross_alike(fresh_seed: int):
    case = bench("linear_axis", {PLAY: TRUE}, fresh_seed)
    nominal = case.fit()
    near = {f"{PLAY}.{symbol}": value for symbol, value in {**TRUE, "gap": 1.3 * TRUE["gap"]}.items()}
    slopes = case.fitter.fit(Hypothesis.of(case.setting, (PLAY,), near), nominal.levels)
    found = searched_by_trial(case.fitter, slopes)
    assert found.log_likelihood >= slopes.log_likelihood
    # A wide gap before a light drive is crossed as a narrow one before a heavy one.
    places = alike(case.fitter, found, found.log_likelihood - nominal.log_likelihood)
    gaps = found.hypothesis.space.to_values(places)[:, found.hypothesis.space.names.index(f"{PLAY}.gap")]
    assert gaps.max() > 2.0 * gaps.min()
    assert 0.7 * gaps.min() < TRUE["gap"] < 1.3 * gaps.max()


def test_the_first_guess_crosses_about_as_the_true_drive_does(fresh_seed: int):
    case = bench("linear_axis", {PLAY: TRUE}, fresh_seed)
    gap, inertia, _, returned, _ = plays(LeftOverByRow(case.fitter, case.fit()), "actuator/backlash")[0]
    assert returned == TRUE["returned"]
    assert 0.5 < gap * inertia / (TRUE["gap"] * TRUE["drive_inertia"]) < 2.0


def test_play_is_named(fresh_seed: int):
    answer = bench("linear_axis", {PLAY: TRUE}, fresh_seed).diagnosed()
    assert answer.verdict == "mismatch"
    assert [effect.name for effect in answer.effects] == [PLAY]
    gap = answer.effects[0].parameters[0]
    assert 0.7 * gap.low <= TRUE["gap"] <= 1.3 * gap.high


@pytest.mark.slow
def test_a_delay_beside_play_is_no_soft_flank(fresh_seed: int):
    answer = bench("linear_axis", {PLAY: TRUE, "actuator/delay": {"tau": 4e-3}}, fresh_seed, count=3).diagnosed()
    assert answer.verdict == "mismatch"
    play, late = sorted(answer.effects, key=lambda effect: effect.name != PLAY)
    assert play.name == PLAY
    # Where nothing is fed back, a late sensor is a late drive.
    assert {late.name, *late.equivalent} & {"actuator/delay", "sensor_x/delay"}


def test_a_fit_without_a_gap_is_left_as_it_is():
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, seed=3)
    fit = case.fit("translation/coulomb")
    assert searched_by_trial(case.fitter, fit) is fit
    np.testing.assert_array_equal(alike(case.fitter, fit, 100.0), fit.hypothesis.cube[None])


@pytest.mark.slow
def test_a_delay_is_found_under_commands_that_change_with_every_row(fresh_seed: int):
    """White commands tell a delay sharply: a millisecond beside it, the likelihood has other peaks."""
    rng = np.random.default_rng(fresh_seed)
    nominal = nominal_model("pendulum")
    tau = float(rng.uniform(0.008, 0.03))
    inputs = Inputs.regular(4.0, 490.0, 1, 3)
    commands = 0.5 * rng.standard_normal((len(inputs.t) - 1, 1, 3))
    driven = Inputs(inputs.t, commands, inputs.first, inputs.last)
    late = ModelBatch(nominal.with_effects({"actuator/delay": {"tau": tau}}))
    rest = np.stack([np.full((1, 3), np.pi), np.zeros((1, 3))])
    theta = SIMULATOR.replay(late, driven, rest).coordinates[:-1, 0, 0]
    theta += 3e-4 * rng.standard_normal(theta.shape)
    recordings = tuple(
        Recording(f"r{r}.csv", {"t": inputs.t[:-1, r], "theta": theta[:, r], "u": commands[:, 0, r]}) for r in range(3)
    )
    (found,) = Bench(nominal, recordings, {}).diagnosed().effects
    assert "actuator/delay" in (found.name, *found.equivalent)  # without a controller a late sensor looks alike
    assert found.parameters[0].value == pytest.approx(tau, rel=0.02)


def test_a_slow_log_has_guesses_of_the_delay_too():
    nominal = nominal_model("pendulum")
    t = np.arange(20) * 0.5
    slow = Recording("r1.csv", {"t": t, "theta": np.pi + 0.1 * np.sin(t), "u": 0.1 * np.cos(t)})
    case = Bench(nominal, (slow, slow), {})
    begin = Hypothesis.of(case.setting, ("actuator/delay",), {})
    assert delays(case.fitter, begin, "actuator/delay", case.quiet)
