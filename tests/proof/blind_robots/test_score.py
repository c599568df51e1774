"""Scores of hand-made diagnoses."""

from typing import Any

import pytest

from wipx.proof.blind_robots.score import CaseScore, UnseenErrors, failed, overlap_error, score
from wipx.proof.blind_robots.table import Count, by_contrast, by_tier, confusions, is_right, misses

COULOMB = {"name": "translation/coulomb", "parameters": {"F_c": 2.0}}
LEAN = {"name": "geometry/com_offset", "parameters": {"theta_eq": 0.02}}


def truth(*effects: dict[str, Any], tier: str = "single_clear", **more: Any) -> dict[str, Any]:
    contrast = {effect["name"]: {"x": 2.0, "theta": 20.0} for effect in effects}
    plain = {"plant": "wip", "outside": None, "regions": [], "times": [], "contrast": contrast}
    return {**plain, "dirt": None, "known": [], "tier": tier, "effects": list(effects), **more}


def named(name: str, equivalent: tuple[str, ...] = (), **values: tuple[float, float, float]) -> dict[str, Any]:
    parameters = {symbol: {"value": v, "ci95": [low, high], "unit": "N"} for symbol, (v, low, high) in values.items()}
    return {"name": name, "parameters": parameters, "equivalent": list(equivalent)}


def answer(verdict: str, *effects: dict[str, Any], sites: dict[str, float] | None = None, **location: Any):
    place = {"sites": sites or {}, "regions": [], "times": [], **location}
    return {"verdict": verdict, "effects": list(effects), "location": place}


def judged(hidden: dict[str, Any], given: dict[str, Any], errors: UnseenErrors | None = None) -> CaseScore:
    return score("case0001", hidden, given, 1.0, errors)


def test_a_perfect_answer():
    given = answer(
        "mismatch", named("translation/coulomb", F_c=(2.1, 1.9, 2.3)), sites={"translation": 0.9, "pitch": 0.1}
    )
    one = judged(truth(COULOMB), given)
    assert one.exact
    assert one.verdict_right
    assert one.site_right
    assert one.false_alarms == 0
    assert one.parameters[0].error == pytest.approx(0.05)
    assert one.parameters[0].covered


def test_an_alias_is_no_match():
    one = judged(truth(COULOMB), answer("mismatch", named("translation/stribeck"), sites={"translation": 1.0}))
    assert one.exact is False
    assert one.false_alarms == 1
    assert one.site_right
    assert misses([one]) == (one,)


def test_an_equivalent_counts_as_found_at_either_site():
    given = answer("mismatch", named("sensor_theta/bias", ("geometry/com_offset",)), sites={"sensor_theta": 0.8})
    one = judged(truth(LEAN), given)
    assert one.exact
    assert one.site_right
    assert one.parameters == ()


def test_one_named_effect_stands_for_one_hidden_effect():
    given = answer("mismatch", named("sensor_theta/bias", ("geometry/com_offset", "translation/coulomb")))
    one = judged(truth(LEAN, COULOMB, tier="pair"), given)
    assert one.exact is False
    assert one.false_alarms == 0


def test_pairs_are_matched_as_well_as_possible():
    both = (named("a/b", ("geometry/com_offset", "translation/coulomb")), named("c/d", ("geometry/com_offset",)))
    for effects in (both, both[::-1]):
        assert judged(truth(LEAN, COULOMB, tier="pair"), answer("mismatch", *effects)).exact


def test_a_false_alarm_where_nothing_is_missing():
    assert judged(truth(tier="nothing"), answer("consistent")).exact
    one = judged(truth(tier="nothing"), answer("mismatch", named("translation/coulomb")))
    assert one.exact is False
    assert one.false_alarms == 1
    assert not one.verdict_right


def test_outside_physics_is_flagged_or_silently_aliased():
    hidden = truth(tier="outside", outside={"name": "sloshing"})
    flagged, aliased = judged(hidden, answer("unexplained")), judged(hidden, answer("mismatch", named("pitch/viscous")))
    assert (flagged.flagged, flagged.aliased, flagged.verdict_right) == (True, False, True)
    assert (aliased.flagged, aliased.aliased, aliased.verdict_right) == (False, True, False)
    assert flagged.exact is None


def test_all_sites_of_several_effects_need_a_share():
    found = (named("translation/coulomb"), named("geometry/com_offset"))
    hidden = truth(COULOMB, LEAN, tier="pair")
    assert judged(hidden, answer("mismatch", *found, sites={"translation": 0.6, "geometry": 0.4})).site_right
    assert not judged(hidden, answer("mismatch", *found, sites={"translation": 0.97, "geometry": 0.03})).site_right


def test_overlap_of_intervals():
    assert overlap_error(0.0, 1.0, [(0.0, 1.0)]) == 0.0
    assert overlap_error(0.0, 1.0, [(0.5, 1.5)]) == pytest.approx(1.0 - 0.5 / 1.5)
    assert overlap_error(0.0, 1.0, [(0.0, 0.25), (0.75, 1.0)]) == pytest.approx(0.5)
    assert overlap_error(0.0, 1.0, []) == 1.0


def test_regions_and_times_are_compared_with_what_was_hidden():
    hidden = truth(
        COULOMB,
        regions=[{"signal": "x", "low": 0.1, "high": 0.2}],
        times=[{"low": 4.0, "high": 8.0, "recording": "r1.csv"}, {"low": 4.0, "high": 9.0, "recording": "r2.csv"}],
    )
    given = answer(
        "mismatch",
        regions=[{"signal": "x", "low": 0.1, "high": 0.15}, {"signal": "theta", "low": 0.0, "high": 1.0}],
        times=[{"low": 4.0, "high": 8.0, "recording": "r1.csv"}],
    )
    one = judged(hidden, given)
    assert one.region_error == pytest.approx(0.5)
    assert one.time_error == pytest.approx(0.5)


def test_the_share_of_explainable_error():
    floor = {"x": 1.0, "theta": 2.0}
    nominal = {"x": 3.0, "theta": 4.0}
    assert UnseenErrors(nominal, floor, floor).removed() == pytest.approx(1.0)
    assert UnseenErrors(nominal, nominal, floor).removed() == pytest.approx(0.0)
    assert UnseenErrors(nominal, {"x": 2.0, "theta": 2.0}, floor).removed() == pytest.approx(1.0 - 3.0 / 11.0)
    assert UnseenErrors(floor, floor, floor).removed() is None


def test_counts_have_exact_intervals():
    assert Count(0, 10).interval == (0.0, pytest.approx(1.0 - 0.025**0.1))  # closed form without successes
    assert Count(10, 10).interval == (pytest.approx(0.025**0.1), 1.0)
    assert str(Count(0, 0)) == "-"


def test_physics_left_over_where_nothing_is_hidden_is_a_false_alarm():
    assert judged(truth(tier="nothing"), answer("unexplained")).accused
    assert judged(truth(tier="nothing"), answer("consistent")).accused is False
    assert failed("case0001", truth(tier="nothing"), 1.0, "no answer").accused is None


def test_error_is_removed_only_where_physics_is_hidden():
    errors = UnseenErrors({"x": 3.0}, {"x": 1.0}, {"x": 1.0})
    assert judged(truth(tier="nothing"), answer("consistent"), errors).removed is None
    found = judged(truth(COULOMB), answer("mismatch", named("translation/coulomb")), errors)
    assert found.removed == pytest.approx(1.0)
    assert found.over_floor == pytest.approx(1.0)


def test_the_faintest_of_several_effects_counts():
    contrast = {"translation/coulomb": {"x": 50.0, "u": 4.0}, "geometry/com_offset": {"x": 2.0, "theta": 8.0}}
    one = judged(truth(COULOMB, LEAN, tier="pair", contrast=contrast), answer("consistent"))
    assert one.contrast == 8.0
    assert [group.name for group in by_contrast([one])] == ["3 to 10"]
    assert by_contrast([judged(truth(tier="nothing"), answer("consistent"))]) == ()


def test_groups_count_the_tiers():
    hits = judged(truth(COULOMB), answer("mismatch", named("translation/coulomb", F_c=(2.1, 1.9, 2.3))))
    lost = failed("case0002", truth(LEAN, tier="single_weak"), 3.0, "no answer within 3 s")
    tiers = by_tier([hits, lost])
    assert [tier.name for tier in tiers] == ["single_clear", "single_weak", "all"]
    assert tiers[-1].exact == Count(1, 2)
    assert tiers[-1].failures == 1
    assert misses([hits, lost]) == (lost,)
    assert confusions([hits, lost]) == {
        ("translation/coulomb", "translation/coulomb"): 1,
        ("geometry/com_offset", "no answer"): 1,
    }


def test_false_alarms_are_worse_than_what_was_missed():
    alarm = judged(truth(tier="nothing"), answer("mismatch", named("translation/coulomb")))
    missed = judged(truth(COULOMB), answer("consistent"))
    lost = failed("case0002", truth(LEAN, tier="single_weak"), 3.0, "no answer within 3 s")
    assert misses([missed, alarm, lost]) == (lost, alarm, missed)


def test_outside_physics_is_right_when_it_is_called_unexplained():
    assert is_right("outside: sloshing", "unexplained")
    assert not is_right("outside: sloshing", "pitch/viscous")
    assert not is_right("nothing", "unexplained")
