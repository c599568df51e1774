"""Noise that lasts: of a sensor, or of a force on a joint."""

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, coloured
from identify.emulated_robot import nominal_model
from sim.robots import unit_axis

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.diagnosis.likelihood.lasting_noise import NoiseSources, noise_sources
from wipx.diagnosis.rules import USUAL
from wipx.identify.evaluation import Judge
from wipx.identify.noise import LastingNoise, sensor_noise
from wipx.sim.inputs import Inputs


def sources_of(case: Bench) -> NoiseSources:
    """What noise is found beside the right model."""
    fit = case.fitter.converged(case.fit())
    return noise_sources(case.fitter.innovations_model, fit, USUAL.trust.noise_lasts)


@pytest.mark.parametrize("kind", ["wip", "pendulum", "linear_axis"])
def test_noise_of_sensors_that_lasts_comes_back(kind: str, fresh_seed: int):
    case = bench(kind, {}, fresh_seed, duration=6.0)
    rng = np.random.default_rng(fresh_seed)
    case = Bench(case.nominal, coloured(case.recordings, rng), {})
    found = sources_of(case)
    assert found.lasting is not None
    time = float(np.median(np.diff(case.recordings[0].t))) / -np.log(0.9)
    for name, deviation, lasted in zip(
        case.nominal.plant.coordinates, found.lasting.deviations, found.lasting.times, strict=True
    ):
        assert deviation == pytest.approx(1e-4 if name == "x" else 4e-4, rel=0.25)
        assert lasted == pytest.approx(time, rel=0.4)
    usual = np.array([case.setting.scales[site].force for site in case.nominal.plant.joints])
    assert np.all(found.force < USUAL.trust.quiet * usual)


@pytest.mark.parametrize("lasts", [0.0, 0.2])
def test_a_random_force_is_no_noise_of_a_sensor(lasts: float, fresh_seed: int):
    """Whether white or lasting: what a force does to a carriage of 1 kg, a sensor does not."""
    rng, dt, size = np.random.default_rng(fresh_seed), 0.004, 0.05
    t = dt * np.arange(4000)
    force = rng.normal(size=len(t)) / np.sqrt(dt)
    kept = np.exp(-dt / lasts) if lasts else 0.0
    for k in range(1, len(t)):
        force[k] = kept * force[k - 1] + (1.0 - kept) * force[k]
    command = 0.3 * np.sin(3.0 * t)
    inputs = Inputs.of([t], [(command + size * force)[:, None]], [0])
    run = SIMULATOR.replay(ModelBatch(unit_axis({})), inputs, np.zeros((2, 1, 1)))
    x = run.coordinates[:, 0, 0, 0] + 1e-4 * rng.normal(size=len(t))
    case = Bench(unit_axis({}), (Recording("r1.csv", {"t": t, "x": x, "u": command}),), {})
    found = sources_of(case)
    assert found.force[0] > (
        0.5 * size if not lasts else 2.0 * USUAL.trust.quiet * case.setting.scales["translation"].force
    )


@pytest.mark.parametrize("kind", ["wip", "linear_axis"])
def test_the_floor_is_what_a_right_model_errs(kind: str, fresh_seed: int):
    model, rng = nominal_model(kind), np.random.default_rng(fresh_seed)
    case = bench(kind, {}, fresh_seed, count=4, duration=6.0)
    recordings = coloured(case.recordings, rng)
    time = float(np.median(np.diff(recordings[0].t))) / -np.log(0.9)
    names = model.plant.coordinates
    deviations = tuple(1e-4 if name == "x" else 4e-4 for name in names)
    white = sensor_noise(case.recordings, model.plant)
    bandwidths = dict.fromkeys(names, 3.0)
    knowing = Judge(SIMULATOR, white, HORIZON, bandwidths, LastingNoise(deviations, (time,) * len(names)))
    errors = knowing.compare(model, model, recordings, held_out=True)[0]
    assert time < USUAL.trust.noise_lasts
    for name in names:
        assert errors.completed[name] == pytest.approx(errors.noise_floor[name], rel=0.4)
    unknowing = Judge(SIMULATOR, white, HORIZON, bandwidths).compare(model, model, recordings, held_out=True)[0]
    assert unknowing.times_the_floor > 2.0 * errors.times_the_floor
