"""Every recording is judged by a model that never saw it."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, bench

from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.held_out import FOLDS, transfer
from wipx.diagnosis.rules import USUAL

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


def test_an_effect_of_all_recordings_is_not_blamed_for_what_differs_between_them(fresh_seed: int):
    case = bench("linear_axis", FRICTION, fresh_seed, count=2)
    scales = zip(case.recordings, (1.25, 0.8), strict=True)  # of a command column that its log has too small or large
    runs = tuple(replace(run, columns={**run.columns, "u": scale * run["u"]}) for run, scale in scales)
    case = replace(case, recordings=runs)
    gain = case.fit("actuator/gain")
    both = case.fit("actuator/gain", "translation/coulomb")
    judge = Context.of(case.recordings, case.setting, SIMULATOR, USUAL).held_out
    repeated = transfer(case.fitter, both)
    likewise = 1.0 - judge.error(repeated) / judge.error(transfer(case.fitter, gain))
    assert judge.gain(case.fitter, repeated, gain) == pytest.approx(likewise)
