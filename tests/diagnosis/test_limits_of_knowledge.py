"""Bounds on what was not found, and numbers that the owner is not sure of."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, Recordings, bench, recorded
from identify.emulated_robot import nominal_model

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.effects.catalogue import effect_of


def widths(answer: Diagnosis) -> dict[str, float]:
    return {bound.name: bound.high - bound.low for bound in answer.bounds}


def wrong_mass(factor: float) -> Model:
    model = nominal_model("wip")
    return Model(model.plant, {**model.parameters, "body_mass": factor * model.parameters["body_mass"]}, {})


@pytest.fixture(scope="module")
def well_known() -> Recordings:
    return recorded("wip", {}, seed=10)


def test_bounds_hold_what_is_absent(fresh_seed: int):
    case = bench("wip", {}, fresh_seed)
    answer = case.diagnosed()
    assert len(answer.bounds) > 10
    held = []
    for bound in answer.bounds:
        effect, _, symbol = bound.name.rpartition(".")
        neutral = effect_of(effect, case.nominal.plant).neutral[symbol]
        held.append(bound.low <= neutral <= bound.high)
        middle, half = 0.5 * (bound.low + bound.high), 0.5 * (bound.high - bound.low)
        assert abs(middle - neutral) <= 3.0 * half  # six standard deviations; the largest of many
    assert np.mean(held) > 0.6  # 0.95 of each, but many answer to the same chance


@pytest.mark.slow
def test_more_recordings_bound_more_tightly():
    few, many = (widths(bench("wip", {}, seed=10, count=count).diagnosed()) for count in (2, 8))
    ratios = [many[name] / few[name] for name in few.keys() & many.keys()]
    assert len(ratios) > 10
    assert np.median(ratios) < 0.75  # half, with the same excitation


def test_what_was_found_has_no_bound():
    answer = bench("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, seed=10).diagnosed()
    assert not any(bound.name.startswith("translation/coulomb.") for bound in answer.bounds)


def test_an_uncertain_mass_is_corrected_and_no_effect(well_known: Recordings):
    answer = Bench(wrong_mass(1.08), well_known, {"body_mass": 0.1}).diagnosed()
    assert (answer.verdict, answer.effects) == ("consistent", ())
    (mass,) = answer.corrected
    assert mass.name == "body_mass"
    assert mass.nominal == pytest.approx(5.4)
    assert abs(mass.value - 5.0) <= mass.high - mass.low  # four standard deviations
    assert mass.high - mass.low < 0.1
    assert answer.model.parameters["body_mass"] == mass.value


@pytest.mark.slow
def test_an_uncertain_mass_is_corrected_beside_an_effect():
    hidden = {"translation/coulomb": {"F_c": 0.5}}
    answer = Bench(wrong_mass(1.08), recorded("wip", hidden, seed=10), {"body_mass": 0.1}).diagnosed()
    assert [effect.name for effect in answer.effects] == ["translation/coulomb"]
    assert answer.corrected[0].value == pytest.approx(5.0, rel=0.01)


@pytest.mark.slow
def test_a_wrong_mass_that_is_said_to_be_exact_is_a_mismatch(well_known: Recordings):
    answer = Bench(wrong_mass(1.08), well_known, {}).diagnosed()
    assert answer.verdict != "consistent"
    assert answer.corrected == ()


def test_recordings_that_are_too_short_are_refused():
    short = tuple(r.between(0.0, 0.4) for r in recorded("linear_axis", {}, seed=10, duration=1.0))
    with pytest.raises(InputError, match="expected more than"):
        Bench(nominal_model("linear_axis"), short, {}).diagnosed()
