"""The paper's measurement noise, Eq. 6."""

import numpy as np

from wipx.sim.noise import paper_noise


def test_paper_noise_is_white_with_the_deviation_of_its_two_factors(fresh_seed):
    noise = paper_noise(np.arange(5000) / 650.0, (4,), np.random.default_rng(fresh_seed))
    # 20000 samples: the deviation is known to 0.5 %, the correlation to 0.007; five of them are allowed.
    assert abs(noise.std() / 0.005 - 1.0) < 0.025
    assert abs(np.mean(noise[1:] * noise[:-1]) / noise.var()) < 0.035


def test_paper_noise_vanishes_where_its_envelope_does():
    t = np.array([0.0, 0.25, 0.5])
    noise = paper_noise(t, (3, 2), np.random.default_rng(0), frequency=1.0)
    assert noise.shape == (3, 3, 2)
    assert np.abs(noise[1]).max() < 1e-15
    assert np.abs(noise[[0, 2]]).min() > 0.0
