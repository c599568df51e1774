"""The level of the sensors' noise, read off recordings."""

import numpy as np
import pytest

from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.identify.noise import low_passed, quantisation, sensor_noise

T = np.arange(1000) / 250.0


def noise_of(theta: np.ndarray) -> float:
    recording = Recording("r.csv", {"t": T[: len(theta)], "theta": theta, "u": np.zeros(len(theta))})
    return float(sensor_noise((recording,), plant_of("pendulum"))[0])


@pytest.mark.parametrize("level", [1e-5, 1e-3, 0.1])
def test_white_noise_comes_back(level: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    # The quietest fifth of the blocks lies 19 % below the mean, with a spread of 4 %.
    assert noise_of(level * rng.normal(size=1000)) == pytest.approx(level, rel=0.4)


def test_a_smooth_motion_is_no_noise():
    motion = 0.3 * np.sin(2.0 * np.pi * 1.5 * T)
    noise = 1e-4 * np.random.default_rng(4).normal(size=1000)
    assert noise_of(motion + noise) == pytest.approx(1e-4, rel=0.4)
    assert noise_of(motion) < 1e-5


def test_fast_motion_in_a_part_of_the_recording_does_not_count():
    burst = np.where(T < 2.0, 0.1 * np.sin(2.0 * np.pi * 30.0 * T), 0.0)
    noise = 1e-4 * np.random.default_rng(5).normal(size=1000)
    assert noise_of(burst + noise) == pytest.approx(1e-4, rel=0.4)


@pytest.mark.parametrize("step", [1e-3, 0.02])
def test_a_coarse_sensor_has_at_least_the_deviation_of_its_step(step: float):
    shown = np.round(0.3 * np.sin(2.0 * np.pi * 0.5 * T) / step) * step
    assert noise_of(shown) == pytest.approx(step / np.sqrt(12.0), rel=0.5)
    assert noise_of(shown) >= step / np.sqrt(12.0) - 1e-12
    assert quantisation([shown]) == pytest.approx(step)


def test_a_sensor_that_never_moves_has_a_noise_above_zero():
    assert 0.0 < noise_of(np.zeros(1000)) < 1e-6


def test_signals_that_a_filter_smoothed_are_told_from_noisy_ones(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    waves = [np.sin(2.0 * np.pi * f * T + rng.uniform(0.0, 6.3)) / f for f in (0.5, 1.1, 2.0)]
    smooth, plant = np.sum(waves, axis=0), plant_of("pendulum")
    noisy = smooth + 1e-3 * rng.normal(size=len(T))
    filtered = Recording("r.csv", {"t": T, "theta": smooth, "u": 2.0 * smooth})
    logged = Recording("r.csv", {"t": T, "theta": noisy, "u": 2.0 * smooth})
    assert low_passed((filtered,), plant, 1e-3) == pytest.approx(2.0, abs=0.7)
    assert low_passed((logged,), plant, 1e-3) is None
    assert low_passed((filtered, logged), plant, 1e-3) is None
