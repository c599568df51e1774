"""Friction that differs by direction is told beside the two effects of the vocabulary that it amounts to."""

import pytest
from diagnosis.recorded import bench

from wipx.report.diagnosis_summary import summary


@pytest.mark.slow
def test_friction_that_differs_by_direction_is_told(fresh_seed: int):
    hidden = {"translation/asymmetric_coulomb": {"F_plus": 0.3, "F_minus": 0.8}}
    answer = bench("wip", hidden, fresh_seed, count=4).diagnosed()
    names = {effect.name for effect in answer.effects}
    assert {"translation/coulomb", "environment/rail_tilt"} <= names
    (law,) = answer.combined
    assert law.name == "translation/asymmetric_coulomb"
    assert law.instead_of == ("translation/coulomb", "environment/rail_tilt")
    assert law.parameters["F_plus"] == pytest.approx(0.3, rel=0.05)
    assert law.parameters["F_minus"] == pytest.approx(0.8, rel=0.05)
    assert any("differs by direction" in sentence for sentence in answer.weak)
    assert "may be one: Coulomb friction that differs by direction on the rail joint" in summary(answer)


@pytest.mark.slow
def test_friction_beside_a_spring_is_not(fresh_seed: int):
    hidden = {"translation/coulomb": {"F_c": 0.5}, "environment/spring": {"k": 5.0, "x0": 0.1}}
    answer = bench("wip", hidden, fresh_seed).diagnosed()
    assert {effect.name for effect in answer.effects} == set(hidden)
    assert answer.combined == ()
