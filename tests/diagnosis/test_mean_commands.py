"""Laws of the actuator beside a log that has means of noisy commands only."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, Recordings, slow
from identify.emulated_robot import nominal_model

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.diagnosis.candidates.screening import candidates_of_effect
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.identify.evaluation import Judge
from wipx.sim.inputs import Inputs

NOISE = 1.5  # [N] of the single commands, as a controller makes of noisy rates
LIMITS = {
    "actuator/dead_zone": {"band": 0.8},
    "actuator/saturation": {"F_max": 5.0},
    "actuator/speed_limit": {"F_stall": 6.0, "v_free": 1.2},
}
LAWS = {**LIMITS, "actuator/sag": {"d": 0.0, "l": 0.15, "t_0": 4.0, "u_0": 2.0, "u_1": 10.0}}


def noisily_driven(effect: str, seed: int) -> Recordings:
    """An axis on a spring that noisy commands swing, logged at every third row."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 8.0, 0.002)
    robot = nominal_model("linear_axis").with_effects({effect: LAWS[effect], "environment/spring": SPRING})
    found = []
    for number in range(3):
        swing = 5.0 * np.sin(2.0 * np.pi * rng.uniform(0.5, 0.8) * t + rng.uniform(0.0, 6.0))
        u = swing * np.sin(2.0 * np.pi * 0.1 * t) + rng.normal(0.0, NOISE, len(t))
        run = SIMULATOR.replay(ModelBatch(robot), Inputs.of([t], [u[:, None]], [0]), np.zeros((2, 1, 1)))
        x = run.coordinates[:, 0, 0, 0] + rng.normal(0.0, 1e-5, len(t))
        found.append(Recording(f"r{number}.csv", {"t": t, "x": x, "u": u}, "emulated"))
    return slow(tuple(found), rng)


def taken_for_single(recordings: Recordings) -> Recordings:
    """The same as if means were the commands."""
    return tuple(replace(recording, periods=1) for recording in recordings)


SPRING = {"k": 40.0, "x0": 0.0}


@pytest.mark.parametrize("effect", LIMITS)
def test_thresholds_beside_means_of_noisy_commands_are_not_biased(effect: str, fresh_seed: int):
    nominal = nominal_model("linear_axis").with_effects({"environment/spring": SPRING})
    recordings = noisily_driven(effect, fresh_seed)
    case = Bench(nominal, recordings, {})
    truth = {f"{effect}.{symbol}": value for symbol, value in LIMITS[effect].items()}
    fit = case.fitter.converged(case.fitter.fit(Hypothesis.of(case.setting, (effect,), truth), case.quiet))
    for name, value in truth.items():
        assert fit.hypothesis.values[name] == pytest.approx(value, rel=0.08)
    # Three commands a row: their spread about the mean is known from how the means scatter.
    assert case.data.inputs.spread[0] == pytest.approx(np.sqrt(6.0 * 2.0 / 3.0) * NOISE, rel=0.15)
    single = Bench(nominal, taken_for_single(recordings), {}).fitter
    assert fit.log_likelihood > single.converged(single.fit(fit.hypothesis, fit.levels)).log_likelihood + 50.0


def test_a_dead_zone_is_looked_for_with_commands_that_scatter(fresh_seed: int):
    nominal = nominal_model("linear_axis").with_effects({"environment/spring": SPRING})
    case = Bench(nominal, noisily_driven("actuator/dead_zone", fresh_seed), {})
    fit = case.fitter.converged(case.fitter.fit(Hypothesis.of(case.setting, (), {}), case.quiet))
    starts = candidates_of_effect(case.fitter, case.setting, fit, "actuator/dead_zone")
    best = max(starts, key=lambda start: start.gain)
    # Taken for the commands themselves, their means would give little more than half of it.
    assert best.values["actuator/dead_zone.band"] == pytest.approx(0.8, rel=0.25)


@pytest.mark.parametrize("effect", LAWS)
def test_predictions_know_that_single_commands_scatter(effect: str, fresh_seed: int):
    recordings = noisily_driven(effect, fresh_seed)
    robot = nominal_model("linear_axis").with_effects({effect: LAWS[effect], "environment/spring": SPRING})
    noise = np.full(1, 1e-5)
    knowing = Judge(SIMULATOR, noise, HORIZON).compare(robot, robot, recordings, held_out=True)[0].completed["x"]
    held = taken_for_single(recordings)
    mistaken = Judge(SIMULATOR, noise, HORIZON).compare(robot, robot, held, held_out=True)[0].completed["x"]
    assert knowing < 0.6 * mistaken
