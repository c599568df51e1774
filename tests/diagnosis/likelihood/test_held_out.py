"""Every recording is judged by a model that never saw it."""

import numpy as np
from diagnosis.recorded import bench

from wipx.diagnosis.likelihood.held_out import FOLDS, transfer

FRICTION = {"translation/coulomb": {"F_c": 0.4}}


def levels_of(count: int, seed: int) -> np.ndarray:
    """Coulomb level of the model of each recording's fold, shape (count,) [N]."""
    case = bench("linear_axis", FRICTION, seed, count=count, duration=1.0)
    fit = case.fit("translation/coulomb")
    return np.array([m.effects["translation/coulomb"]["F_c"] for m in transfer(case.fitter, fit).models])


def test_each_of_a_few_recordings_has_a_model_of_its_own(fresh_seed: int):
    levels = levels_of(3, fresh_seed)
    assert len(set(levels)) == 3
    np.testing.assert_allclose(levels, 0.4, rtol=0.1)


def test_many_recordings_are_left_out_in_folds(fresh_seed: int):
    levels = levels_of(FOLDS + 2, fresh_seed)
    assert len(set(levels)) == FOLDS
    np.testing.assert_array_equal(levels[:2], levels[FOLDS:])
