"""Suspects: what recordings say of effects that a person asks about, and that asking changes no answer."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.core.results import Estimate
from wipx.core.suspect import Suspect, SuspectedSize
from wipx.diagnosis.answer.suspects import check_suspects
from wipx.effects.remainder import KNOTS
from wipx.report.diagnosis_json import diagnosis_json
from wipx.report.suspect_sentence import suspect_sentence

LEVEL = 0.5  # of the axis's Coulomb friction [N]
SIGMA = 3.0  # of a viscous friction that it does not have [N s/m]


def axis() -> Bench:
    """An axis with Coulomb friction that its owner does not know."""
    return bench("linear_axis", {"translation/coulomb": {"F_c": LEVEL}}, seed=12)


def by_name(answer: Diagnosis) -> dict[str, Suspect]:
    return {suspect.name: suspect for suspect in answer.suspects}


def size_of(suspect: Suspect) -> SuspectedSize:
    assert suspect.size is not None
    return suspect.size


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    """The axis, asked about what it has, what it has not, and a richer law."""
    return axis().diagnosed(
        {
            "translation/coulomb": {"F_c": LEVEL},
            "translation/viscous": {"sigma": SIGMA},
            "translation/presliding": {},
            "actuator/delay": {},
        }
    )


@pytest.mark.slow
def test_suspects_do_not_change_the_answer(answer: Diagnosis):
    silent, asked = (diagnosis_json(diagnosis) for diagnosis in (axis().diagnosed(), answer))
    assert silent["suspects"] == []
    changing = {"suspects", "seconds"}
    assert {k: v for k, v in silent.items() if k not in changing} == {
        k: v for k, v in asked.items() if k not in changing
    }


def test_the_right_size_of_a_named_effect_agrees(answer: Diagnosis):
    suspect = by_name(answer)["translation/coulomb"]
    assert suspect.named
    assert suspect.parameters == answer.effects[0].parameters
    assert suspect.log_evidence_gain == pytest.approx(answer.effects[0].log_evidence_gain)
    assert suspect.heldout_gain == pytest.approx(answer.effects[0].heldout_gain)
    assert not size_of(suspect).excluded
    assert 0.9 < size_of(suspect).error_ratio < 1.1
    assert "the size agrees" in suspect.sentence


def test_another_size_of_a_named_effect_is_excluded():
    (suspect,) = axis().diagnosed({"translation/coulomb": {"F_c": 0.7 * LEVEL}}).suspects
    size = size_of(suspect)
    assert suspect.named
    assert size.excluded
    assert size.loss == size.loss_to_free > size.limit
    assert size.error_ratio > 1.5
    assert "excluded" in suspect.sentence


def test_an_absent_effect_gains_too_little_and_its_size_is_excluded(answer: Diagnosis):
    suspect = by_name(answer)["translation/viscous"]
    assert not suspect.named
    assert suspect.in_place_of == ()
    assert suspect.log_evidence_gain < suspect.required_gain
    assert suspect.parameters[0].low == pytest.approx(0.0, abs=0.05 * SIGMA)
    assert suspect.parameters[0].high < SIGMA
    assert size_of(suspect).excluded
    assert "excluded" in suspect.sentence


def test_a_size_too_small_to_be_seen_is_neither_shown_nor_excluded():
    (suspect,) = axis().diagnosed({"translation/viscous": {"sigma": 1e-3}}).suspects
    assert not suspect.named
    assert not size_of(suspect).excluded
    assert "neither show nor exclude" in suspect.sentence


def test_a_richer_law_takes_the_place_of_the_simple_one(answer: Diagnosis):
    suspect = by_name(answer)["translation/presliding"]
    assert suspect.in_place_of == ("translation/coulomb",)
    assert suspect.size is None
    level = suspect.parameters[0]
    assert level.name == "translation/presliding.F_c"
    assert level.value == pytest.approx(LEVEL, rel=0.05)
    assert suspect.log_evidence_gain > suspect.required_gain


def test_without_a_size_only_the_free_one_is_told(answer: Diagnosis):
    suspect = by_name(answer)["actuator/delay"]
    assert suspect.size is None
    assert suspect.log_evidence_gain < suspect.required_gain
    assert suspect.sentence.endswith("too little to be named.")


@pytest.mark.slow
def test_an_effect_that_cannot_be_told_from_a_found_one_takes_its_place():
    case = bench("wip", {"geometry/com_offset": {"theta_eq": 0.02}}, seed=3)
    (found,) = case.diagnosed().effects
    (other,) = found.equivalent
    (suspect,) = case.diagnosed({other: {}}).suspects
    assert suspect.in_place_of == (found.name,)
    assert abs(suspect.parameters[0].value) == pytest.approx(abs(found.parameters[0].value), rel=0.05)


@pytest.mark.slow
def test_uncertain_numbers_make_up_for_a_suspected_size():
    case = axis()
    suspects = {"actuator/gain": {"k": 1.1}}
    (sure,) = case.diagnosed(suspects).suspects
    (unsure,) = replace(case, uncertainty={"input_gain": 0.2}).diagnosed(suspects).suspects
    assert size_of(sure).excluded
    assert not size_of(unsure).excluded
    assert size_of(unsure).loss < 0.1 * size_of(sure).loss


@pytest.mark.slow
def test_a_suspect_is_asked_about_beside_a_curve_without_a_name():
    levels = {f"f{i}": float(f) for i, f in enumerate(np.where(np.arange(KNOTS) % 2, 0.9, 0.2))}
    wavy = {"translation/remainder": {"signal": 0.0, "factor": -1.0, "low": -0.3, "high": 0.3, **levels}}
    suspects = {"translation/viscous": {"sigma": 1e-3}, "actuator/delay": {"tau": 0.05}}
    answer = bench("linear_axis", wavy, seed=12).diagnosed(suspects)
    assert answer.unexplained.curve is not None
    small, large = answer.suspects
    assert not size_of(small).excluded
    assert size_of(large).excluded
    assert "if nothing else is missing" in large.sentence


BAD = {
    "unknown effect": ({"translation/coulom": {}}, "did you mean translation/coulomb"),
    "unknown parameter": ({"translation/coulomb": {"F_s": 0.1}}, "unknown parameter 'F_s'"),
    "missing parameter": ({"translation/stribeck": {"F_s": 0.1}}, "lacks F_c"),
    "no number": ({"translation/coulomb": {"F_c": "0.1 N"}}, "expected a finite number"),
    "wrong sign": ({"translation/coulomb": {"F_c": -0.1}}, "non-negative"),
    "beyond bounds": ({"translation/coulomb": {"F_c": 1e6}}, "F_c = 1e\\+06, expected 0 to"),
    "of the nominal model": ({"translation/viscous": {}}, "part of the nominal model"),
}


@pytest.mark.parametrize("fault", BAD)
def test_a_suspect_that_cannot_be_is_refused(fault: str):
    suspects, said = BAD[fault]
    case = axis()
    nominal = case.nominal.with_effects({"translation/viscous": {"sigma": 1.0}})
    with pytest.raises(InputError, match=said):
        check_suspects(suspects, nominal, case.setting.scales)


def test_a_suspect_that_excludes_an_effect_of_the_nominal_model_is_refused():
    case = axis()
    nominal = case.nominal.with_effects({"translation/coulomb": {"F_c": 0.1}})
    with pytest.raises(InputError, match="describe the same physics"):
        check_suspects({"translation/stribeck": {}}, nominal, case.setting.scales)


def test_what_gains_enough_is_judged_beside_its_own_size():
    size = SuspectedSize({"F_c": 0.289}, -16.0, 5.7, True, 2.2, True, 0.6)
    suspect = suspect_with(size, required_gain=14.0, transfers=True)
    assert suspect.supported
    assert suspect_sentence(suspect, unexplained=False) == (
        "pitch/coulomb: would be F_c = 0.21 N m [0.15, 0.27] and gain 24.0 nats, enough to be named (14.0 needed); "
        "F_c = 0.289 N m is 5.7 nats worse than that size: excluded, held-out error 0.60 times that of the answer, "
        "which has none of it."
    )


def suspect_with(size: SuspectedSize | None, *, required_gain: float = 43.0, transfers: bool = False) -> Suspect:
    """A suspect whose free size is 0.21 N m, with which it gains 24 nats."""
    number = Estimate("pitch/coulomb.F_c", "N m", 0.0, 0.21, 0.15, 0.27, False, "Coulomb level")
    return Suspect("pitch/coulomb", False, (), (number,), 24.0, required_gain, -0.1, transfers, -24.0, size)


def beside_the_answer(loss: float, loss_to_free: float) -> SuspectedSize:
    """A size that is excluded from 15 nats on."""
    return SuspectedSize({"F_c": 0.289}, loss, loss_to_free, False, 15.0, loss > 15.0, 1.3)


def test_a_sentence_tells_size_evidence_transfer_and_what_of_the_figure():
    assert suspect_sentence(suspect_with(beside_the_answer(12.0, 36.0)), unexplained=False) == (
        "pitch/coulomb: would be F_c = 0.21 N m [0.15, 0.27] and gain 24.0 nats of the 43.0 needed; "
        "does not transfer to held-out recordings; F_c = 0.289 N m is 12.0 nats worse than the answer and 36.0 nats "
        "worse than that size (15.0 would exclude it): these recordings neither show nor exclude it, held-out error "
        "1.3 times that of the answer."
    )
    better = suspect_sentence(suspect_with(beside_the_answer(-20.0, 4.0)), unexplained=False)
    assert "is 20.0 nats better than the answer: it fits better, but gains too little to be named" in better
    excluded = suspect_sentence(suspect_with(beside_the_answer(60.0, 84.0), transfers=True), unexplained=True)
    assert excluded.endswith(
        "F_c = 0.289 N m is 60.0 nats worse than the answer: excluded, if nothing else is missing, held-out error 1.3 "
        "times that of the answer."
    )
    assert "transfer" not in excluded


def test_a_sentence_says_that_an_effect_of_the_model_is_too_small_to_be_named():
    small = replace(suspect_with(None), named=True, unnamed="small")
    assert "in the completed model, but too small to be named, F_c = 0.21" in suspect_sentence(small, unexplained=True)
