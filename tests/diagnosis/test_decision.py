"""What is named at last: no size that is numerics, and no rich law where a simple one has the same physics."""

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.core.plant import plant_of
from wipx.diagnosis import decision
from wipx.diagnosis.fitting import Fit, Fitter
from wipx.diagnosis.inquiry import Inquiry
from wipx.diagnosis.nested import simple_law

WIP = plant_of("wip")


def test_a_size_that_the_step_of_the_simulation_moves_is_not_named(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    robot = bench("linear_axis", {"translation/viscous": {"sigma": 1.0}}, fresh_seed)
    assert [effect.name for effect in robot.diagnosed().effects] == ["translation/viscous"]

    def all_of_it(fitter: Fitter, fit: Fit) -> np.ndarray:
        return np.abs(fit.hypothesis.cube - fit.hypothesis.space.neutral)

    monkeypatch.setattr(decision, "shift_by_step", all_of_it)
    answer = robot.diagnosed()
    assert "translation/viscous" not in {effect.name for effect in answer.effects}
    assert any(c.reason == "is as small as what the step of the simulation changes" for c in answer.candidates)


def test_a_rich_law_has_a_simple_one_where_there_is_room():
    assert simple_law("pitch/presliding", (), WIP) == "pitch/coulomb"
    assert simple_law("pitch/presliding", ("translation/coulomb",), WIP) == "pitch/coulomb"
    assert simple_law("pitch/presliding", ("pitch/coulomb",), WIP) is None
    assert simple_law("pitch/sticky_spot", ("pitch/stribeck",), WIP) is None  # which excludes Coulomb friction
    assert simple_law("pitch/viscous", (), WIP) is None


def test_small_print_is_kept_where_something_is_left_without_it(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    hidden = {"translation/viscous": {"sigma": 3.0}, "environment/spring": {"k": 1.0, "x0": 0.0}}
    robot = bench("linear_axis", hidden, fresh_seed)
    monkeypatch.setattr(Inquiry, "heldout_gain", lambda self, repeated, reduced: 0.0)  # nothing shows
    answer = robot.diagnosed()
    assert {effect.name for effect in answer.effects} == set(hidden)
    assert answer.verdict == "mismatch"
