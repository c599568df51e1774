"""Scores of made-up diagnoses of dirty robots."""

from typing import Any

import pytest

from wipx.proof.blind.diagnosing import OURS
from wipx.proof.blind.dirty_page import dirty_sentence, dirty_tables
from wipx.proof.blind.judging import Opened
from wipx.proof.blind_robots.dirty_score import alike
from wipx.proof.blind_robots.dirty_table import dirty_groups
from wipx.proof.blind_robots.score import CaseScore, UnseenErrors, failed, score
from wipx.proof.blind_robots.table import Count, misses

ERRORS = UnseenErrors({"x": 4.0}, {"x": 1.2}, {"x": 0.5}, reference={"x": 1.0})


def truth(*names: str, known: tuple[str, ...] = (), wrong: dict[str, float] | None = None) -> dict[str, Any]:
    return {
        "tier": "dirty" if names else "dirt_only",
        "plant": "wip",
        "effects": [{"name": name, "parameters": {}} for name in names],
        "known": list(known),
        "outside": None,
        "regions": [],
        "times": [],
        "contrast": {name: {"x": 5.0} for name in names},
        "dirt": {"names": ["forces from outside"], "wrong_parameters": wrong or {}},
    }


def judged(hidden: dict[str, Any], *names: str, verdict: str = "unexplained", equivalent: str = "") -> CaseScore:
    effects = [{"name": name, "parameters": {}, "equivalent": [equivalent] if equivalent else []} for name in names]
    location = {"sites": {}, "regions": [], "times": []}
    given = {"verdict": verdict, "effects": effects, "location": location}
    return score("case0001", hidden, given, 10.0, ERRORS)


def test_dominant_effects_are_named_with_something_left_over():
    one = judged(truth("translation/coulomb", "actuator/delay"), "translation/coulomb", "actuator/delay")
    assert one.dirty is not None
    assert (one.dirty.dominant, one.dirty.named, one.dirty.false_laws) == (2, 2, 0)
    assert one.dirty.over_reference == pytest.approx(1.2)
    assert one.exact
    assert one.verdict_right


def test_an_equivalent_is_named():
    one = judged(truth("geometry/com_offset"), "sensor_theta/bias", equivalent="geometry/com_offset")
    assert one.dirty is not None
    assert one.dirty.named == 1


def test_a_richer_law_of_the_same_physics_has_a_column_of_its_own():
    one = judged(truth("translation/coulomb"), "translation/stribeck", "pitch/stribeck")
    assert one.dirty is not None
    assert (one.dirty.named, one.dirty.kin, one.dirty.false_laws) == (0, 1, 1)
    assert alike("actuator/delay", "actuator/lag")
    assert not alike("actuator/delay", "sensor_x/delay")


def test_a_law_that_corrects_a_nominal_error_is_not_false():
    wrong = truth("actuator/delay", wrong={"body_mass": 1.01})
    for name in ("geometry/inertia", "geometry/payload"):
        one = judged(wrong, "actuator/delay", name)
        assert one.dirty is not None
        assert (one.dirty.corrected, one.dirty.false_laws) == (1, 0)
        assert one.exact
    other = judged(truth("actuator/delay"), "actuator/delay", "geometry/inertia")
    assert other.dirty is not None
    assert other.dirty.false_laws == 1


def test_a_known_friction_may_be_corrected():
    one = judged(truth(known=("pitch/viscous",)), "pitch/viscous")
    assert one.dirty is not None
    assert one.dirty.false_laws == 0


def test_with_dirt_only_a_law_is_a_false_alarm_and_something_left_over_is_not():
    quiet, loud = judged(truth()), judged(truth(), "translation/coulomb")
    assert quiet.accused is False
    assert quiet.verdict_right
    assert loud.accused is True
    assert loud.exact is False
    assert misses([quiet, loud]) == (loud,)


def test_no_answer_names_nothing():
    one = failed("case0001", truth("actuator/delay"), 3.0, "no answer within 3 s")
    assert one.dirty is not None
    assert (one.dirty.dominant, one.dirty.named, one.dirty.over_reference) == (1, 0, None)


def test_groups_and_page_count_what_was_named():
    scores = [
        judged(truth("actuator/delay"), "actuator/delay"),
        judged(truth("actuator/delay", "pitch/viscous"), "actuator/delay", "pitch/coulomb"),
        judged(truth(), "pitch/coulomb"),
    ]
    groups = {group.name: group for group in dirty_groups(scores)}
    assert list(groups) == ["one effect", "two effects", "all with effects", "dirt only"]
    assert groups["all with effects"].named == Count(2, 3)
    assert groups["all with effects"].false_laws == 1
    assert groups["dirt only"].accused == Count(1, 1)
    cases = [Opened(f"case{i}", "key", {OURS: one, "regression": one}, {}) for i, one in enumerate(scores)]
    tables = dirty_tables(cases)
    assert [len(table.rows) for table in tables] == [4, 4]
    assert all(len(row) == len(table.head) for table in tables for row in table.rows)
    assert "2 of 3 dominant effects were named, and 1 laws that are not there in 2 robots" in dirty_sentence(scores)
    assert dirty_tables([]) == ()
