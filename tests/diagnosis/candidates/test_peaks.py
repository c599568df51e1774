"""The best of many guesses, none like a better one."""

import numpy as np

from wipx.diagnosis.candidates.peaks import peaks


def test_neighbours_of_a_peak_are_left_out(fresh_seed: int):
    gains = np.random.default_rng(fresh_seed).uniform(0.1, 1.0, 200)
    gains[[20, 120]] = 3.0, 2.0
    found = peaks(gains, 5, lambda i: np.abs(np.arange(200) - i) < 10)
    assert found[:2] == [20, 120]
    assert np.all(np.diff(gains[found]) <= 0.0)
    assert np.diff(sorted(found)).min() >= 10


def test_what_gains_nothing_is_no_peak():
    assert peaks(np.array([0.0, 2.0, -1.0]), 3, lambda i: np.arange(3) == i) == [1]
