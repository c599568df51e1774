"""The distribution of errors some of which are far too large."""

import numpy as np

from wipx.diagnosis.likelihood.heavy_tails import TAILS, fitted_whitening, shrunk


def test_errors_that_are_far_too_large_hardly_move_the_scale(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    mixed = np.array([[1.0, 0.0], [0.8, 0.6]])
    errors = rng.normal(size=(1, 4000, 2)) @ mixed.T
    spoilt = errors.copy()
    spoilt[:, ::50] *= 1000.0
    for each in (errors, spoilt):
        scale = np.linalg.inv(fitted_whitening(each)[0][0])
        covariance = scale @ scale.T
        np.testing.assert_allclose(covariance / covariance[0, 0], mixed @ mixed.T, atol=0.1)


def test_half_the_squares_of_shrunk_errors_are_the_loss_of_likelihood(fresh_seed: int):
    white = np.random.default_rng(fresh_seed).normal(size=(50, 3)) * 4.0
    loss = 0.5 * (TAILS + 3.0) * np.log1p(np.sum(white**2, axis=1) / TAILS)
    np.testing.assert_allclose(0.5 * np.sum(shrunk(white) ** 2, axis=1), loss)
