"""The window that an estimator sees is that of linear interpolation between the readings."""

import numpy as np
import pytest

from wipx.control.release_window import ReleaseWindow


@pytest.mark.parametrize("released", [0.0, 3.7])
def test_it_interpolates_between_late_uneven_and_missing_readings(released: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    window = ReleaseWindow(30, 0.015)
    window.reset(released)
    t = released + np.cumsum(rng.uniform(5e-4, 4e-3, 250)) - 4e-4
    readings = rng.normal(size=(250, 2))
    readings[rng.random((250, 2)) < 0.3] = np.nan
    for time, measured in zip(t, readings, strict=True):
        window.see(time, np.concatenate([measured, np.zeros(2)]))
    times = released + np.arange(30) * 0.015
    known = np.isfinite(readings)
    expected = [np.interp(times, t[known[:, i]], readings[known[:, i], i]) for i in range(2)]
    samples = window.samples()
    assert samples is not None
    np.testing.assert_allclose(samples, np.transpose(expected), atol=1e-12)


def test_the_last_reading_is_held_and_a_silent_sensor_gives_none():
    window = ReleaseWindow(4, 0.1)
    window.reset(0.0)
    assert window.samples() is None
    window.see(0.0, np.array([1.0, np.nan]))
    assert window.samples() is None
    window.see(0.1, np.array([2.0, 5.0]))
    np.testing.assert_array_equal(np.array(window.samples()), [[1.0, 5.0], [2.0, 5.0], [2.0, 5.0], [2.0, 5.0]])
    window.reset(9.0)
    assert window.samples() is None
