"""A hysteresis that the vocabulary lacks does not pass for the bristles of dry friction, which are its nearest law."""

import pytest
from diagnosis.recorded import bench

BRISTLES = {"F_c": 0.8, "stiffness": 20.0}


@pytest.mark.slow
def test_hysteresis_is_not_taken_for_bristles(fresh_seed: int):
    hidden = {"translation/hysteresis": {**BRISTLES, "n": 2.0, "gamma": 0.2}}
    answer = bench("linear_axis", hidden, fresh_seed).diagnosed()
    (effect,) = answer.effects
    assert answer.verdict == "unexplained"
    assert (effect.name, effect.outside_vocabulary) == ("translation/hysteresis", True)
    assert answer.unexplained.resembles == ("translation/hysteresis",)
    assert answer.unexplained.p_value < 1e-4
    assert answer.model.value("translation/hysteresis.F_c") == pytest.approx(0.8, rel=0.05)
    for column, nominal in answer.held_out.nominal.items():  # its memory at the start of a prediction is not known
        assert answer.held_out.completed[column] < 0.9 * nominal


@pytest.mark.parametrize("damping", [0.0, pytest.param(1.0, marks=pytest.mark.slow)])
def test_bristles_are_not_taken_for_hysteresis(damping: float, fresh_seed: int):
    hidden = {"translation/presliding": {**BRISTLES, "damping": damping}}
    answer = bench("linear_axis", hidden, fresh_seed).diagnosed()
    assert answer.verdict == "mismatch"
    assert [effect.name for effect in answer.effects] == ["translation/presliding"]
