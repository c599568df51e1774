"""The terminal shows the answer in a few lines."""

from dataclasses import replace

from report import synthetic_diagnosis

from wipx.report.diagnosis_sentence import sentence
from wipx.report.diagnosis_summary import summary
from wipx.report.diagnosis_words import nats, percent, probability


def test_summary_of_a_mismatch_holds_effects_ties_errors_and_the_next_experiment():
    text = summary(synthetic_diagnosis.mismatch())
    assert len(text.splitlines()) <= 15
    for part in (
        "Mismatch: physics is missing",
        "Coulomb friction on the rail joint: F_c = 3.10 N [2.93, 3.29]; evidence 412 nats, held-out gain 81 %",
        "cannot tell delay of the actuator from first-order lag of the actuator",
        "corrected: body_inertia = 0.1180 kg m^2 [0.1140, 0.1220]",
        "x 21.0 -> 2.10 mm",
        "sensor-noise floor 0.800 mm",
        "Nothing significant is left over (p = 0.31)",
        "next: Is it a delay or a lag of the actuator?",
        "note: Time steps of r2.csv",
    ):
        assert part in text


def test_effects_of_one_kind_stand_together_in_the_answer():
    whole = synthetic_diagnosis.mismatch()
    first = next(effect for effect in whole.effects if effect.name == "translation/coulomb")
    second = replace(first, name="pitch/coulomb")
    others = tuple(effect for effect in whole.effects if effect is not first)
    told = sentence(replace(whole, effects=(first, *others, second)))
    assert told.startswith("Coulomb friction on the rail joint and the pitch joint (F_c = 3.1 and 3.1 N)")
    assert told.count("Coulomb") == 1


def test_summary_answers_what_was_asked():
    lines = summary(synthetic_diagnosis.asked()).splitlines()
    assert [line for line in lines if line.startswith("asked: ")] == ["asked: It agrees.", "asked: It is excluded."]


def test_summary_of_a_consistent_robot_is_short():
    text = summary(synthetic_diagnosis.consistent())
    assert "Consistent: nothing is missing" in text
    assert "next:" not in text
    assert len(text.splitlines()) <= 6


def test_summary_of_the_unexplained_says_what_is_left():
    text = summary(synthetic_diagnosis.unexplained())
    assert "left over at the rail joint (p < 0.0001)" in text
    assert "It resembles load-dependent gear friction" in text


def test_probabilities_never_claim_certainty():
    assert [probability(p) for p in (1.0, 0.62, 0.0, float("nan"))] == ["> 99.9 %", "62.0 %", "< 0.1 %", "-"]


def test_shares_and_nats_keep_the_digits_that_matter():
    assert [percent(share) for share in (0.0, 0.061, 0.812, -0.03)] == ["0 %", "6.1 %", "81 %", "-3.0 %"]
    assert [nats(gain) for gain in (412.3, 38.0, 0.2, -0.04, float("nan"))] == ["412", "38.0", "0.2", "0.0", "-"]
