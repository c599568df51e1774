"""Intervals hold what they promise where errors go together within few stretches of time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wipx.core.results import NINETY_FIVE
from wipx.diagnosis.likelihood.sandwich import covariance, robust_deviations

DRAWS, ROWS, NUMBERS = 300, 8, 4  # rows of each stretch


def _straight_fit(stretches: int, common: float, rng: np.random.Generator) -> tuple[Any, np.ndarray]:
    """Least squares of errors of which a share is common to a stretch, and by how much it misses the truth, zero."""
    labels = np.repeat(np.arange(stretches), ROWS)
    slopes = rng.normal(size=(len(labels), NUMBERS)) + rng.normal(size=(stretches, NUMBERS))[labels]
    own, shared = rng.normal(size=len(labels)), rng.normal(size=stretches)[labels]
    errors = np.sqrt(1.0 - common) * own + np.sqrt(common) * shared
    information = slopes.T @ slopes
    found = np.linalg.solve(information, slopes.T @ errors)
    fit = SimpleNamespace(information=information, jacobian=-slopes, white=errors - slopes @ found, blocks=labels)
    return fit, found


@pytest.mark.parametrize("stretches", [6, 12, 40])
def test_intervals_cover_with_few_stretches(stretches: int, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    covered = 0
    for _ in range(DRAWS):
        fit, found = _straight_fit(stretches, 0.5, rng)
        covered += np.sum(np.abs(found) < NINETY_FIVE * robust_deviations(fit))
    assert 0.91 < covered / (DRAWS * NUMBERS) < 0.985


def test_independent_errors_of_many_stretches_widen_little(fresh_seed: int):
    fit, _ = _straight_fit(60, 0.0, np.random.default_rng(fresh_seed))
    plain = np.sqrt(np.diag(np.linalg.inv(fit.information)))
    wider = robust_deviations(fit) / plain
    assert np.all(wider >= 1.0)
    assert np.median(wider) < 1.3


def test_few_stretches_widen_more_than_the_plain_sandwich(fresh_seed: int):
    fit, _ = _straight_fit(6, 0.5, np.random.default_rng(fresh_seed))
    assert np.median(robust_deviations(fit) / np.sqrt(np.diag(covariance(fit)))) > 1.0
