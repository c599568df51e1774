"""A force without a name, as a Gaussian process over a signal."""

import numpy as np
import pytest

from wipx.diagnosis.residuals.discrepancy import process_mean

KNOTS = np.linspace(-1.0, 1.0, 12)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e12])
def test_a_smooth_force_comes_back_whatever_its_unit(scale: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    slopes, force = 5.0 * rng.normal(size=(400, 12)), np.sin(3.0 * KNOTS)
    white = -slopes @ force + rng.normal(size=400)
    mean, spread = process_mean(slopes * scale, white, KNOTS)
    assert np.all(np.abs(mean * scale - force) < 6.0 * spread * scale)
    assert np.all(spread * scale < 0.1)


def test_knots_that_were_never_visited_follow_their_neighbours(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    slopes = 5.0 * rng.normal(size=(400, 12))
    slopes[:, 6] = 0.0
    mean, spread = process_mean(slopes, -slopes @ KNOTS + rng.normal(size=400), KNOTS)
    assert mean[6] == pytest.approx(KNOTS[6], abs=0.1)
    assert spread[6] > spread[5]
