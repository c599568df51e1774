"""Ways by recorded rates: they tell the scale of a coordinate's sensor, whatever moves the joint."""

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, forecasts
from identify.emulated_robot import nominal_model

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.predictions import Predictions
from wipx.identify.noise import sensor_noise

DOUBT, SCALE, LATE = 0.015, 0.05, 0.02
TRUTH = "sensor_x/scale"


def with_rates(case: Bench, *, of_the_coordinate: bool, rng: np.random.Generator) -> Bench:
    """With a late, noisy rate with an offset: of a sensor of its own, or read off the recorded coordinate."""
    changed = []
    for r in case.recordings:
        true = r["x"] if of_the_coordinate else r["x"] / (1.0 + SCALE)
        rate = np.gradient(np.convolve(true, np.ones(9) / 9.0, mode="same"), r.t)
        late = np.interp(r.t - LATE, r.t, rate) + 0.01 + 0.005 * rng.normal(size=len(r))
        columns = {name: values[10:-10] for name, values in {**r.columns, "x_dot": late}.items()}
        changed.append(Recording(r.name, columns, r.source, r.periods))
    return Bench(case.nominal, tuple(changed), {})


def predictions(case: Bench) -> Predictions:
    return Predictions(SIMULATOR, case.data, sensor_noise(case.recordings, case.nominal.plant), DOUBT)


@pytest.mark.parametrize("of_the_coordinate", [False, True])
def test_only_a_rate_that_contradicts_the_coordinate_counts(of_the_coordinate: bool, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    case = bench("linear_axis", {TRUTH: {"e": SCALE}}, fresh_seed, count=4, duration=6.0)
    ways = predictions(with_rates(case, of_the_coordinate=of_the_coordinate, rng=rng)).ways
    assert ways.joints.tolist() == ([] if of_the_coordinate else [0])


def test_ways_tell_the_scale_of_a_sensor_beside_a_late_rate_with_an_offset(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    case = bench("linear_axis", {TRUTH: {"e": SCALE}}, fresh_seed, count=4, duration=6.0)
    seen = predictions(with_rates(case, of_the_coordinate=False, rng=rng))
    right = nominal_model("linear_axis").with_effects({TRUTH: {"e": SCALE}})
    without, left = (
        seen.ways.errors(ModelBatch(model), seen.recorded[:, [0, -1]])[0, :, 0] for model in (case.nominal, right)
    )
    way = seen.ways.way[:, 0] - seen.ways.way[:, 0].mean()
    for errors, slope in ((without, SCALE), (left, 0.0)):
        assert errors @ way / (way @ way) == pytest.approx(slope, abs=DOUBT)


@pytest.mark.slow
def test_forecasts_tell_a_wrong_scale_from_a_wrong_gain(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    case = bench("linear_axis", {TRUTH: {"e": SCALE}}, fresh_seed, count=4, duration=6.0)
    fitter = forecasts(with_rates(case, of_the_coordinate=False, rng=rng))
    setting = fitter.doubted
    fits = {
        name: fitter.first_fit(Hypothesis.of(setting, (name,), {})).log_likelihood for name in (TRUTH, "actuator/gain")
    }
    assert fits[TRUTH] > fits["actuator/gain"] + 20.0
