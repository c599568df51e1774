"""Where and when: sites, a stretch of the rail, the time of an event."""

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.core.model import ModelBatch
from wipx.diagnosis.answer.location import excess_of


def test_shares_of_sites_sum_to_one(fresh_seed: int):
    hidden = {"translation/viscous": {"sigma": 2.0}, "actuator/delay": {"tau": 0.006}}
    sites = bench("wip", hidden, fresh_seed).diagnosed().location.sites
    assert set(sites) == {"translation", "actuator"}
    assert sum(sites.values()) == pytest.approx(1.0)
    assert all(share > 0.0 for share in sites.values())


@pytest.mark.slow
def test_a_sticky_spot_is_put_on_the_rail(fresh_seed: int):
    hidden = {"translation/sticky_spot": {"F_c": 1.0, "lo": 0.0, "hi": 0.05}}
    answer = bench("linear_axis", hidden, fresh_seed, count=3).diagnosed()
    assert [effect.name for effect in answer.effects] == ["translation/sticky_spot"]
    (region,) = answer.location.regions
    assert region.signal == "x"
    assert (region.low, region.high) == pytest.approx((0.0, 0.05), abs=2e-3)
    assert 0.5 < region.share <= 1.0


@pytest.mark.slow
def test_an_event_is_put_in_time(fresh_seed: int):
    hidden = {"geometry/payload_event": {"mass": 0.3, "height": 0.3, "t0": 1.5}}
    answer = bench("wip", hidden, fresh_seed).diagnosed()
    assert [effect.name for effect in answer.effects] == ["geometry/payload_event"]
    assert [period.recording for period in answer.location.times] == ["r1.csv", "r2.csv"]
    for period in answer.location.times:
        assert period.low == pytest.approx(1.5, abs=0.05)
        assert period.high == pytest.approx(2.996)
        assert 0.8 < period.share <= 1.0


def test_a_dead_zone_is_put_where_commands_are_small():
    answer = bench("wip", {"actuator/dead_zone": {"band": 0.5}}, seed=9).diagnosed()
    assert dict(answer.location.sites) == pytest.approx({"actuator": 1.0})
    for region in answer.location.regions:
        assert region.low < region.high
        assert 0.6 <= region.share <= 1.0


def test_the_excess_adds_up_to_the_gain_in_squared_innovations():
    case = bench("wip", {"translation/coulomb": {"F_c": 0.5}}, seed=9)
    nominal, completed = case.fit(), case.fit("translation/coulomb")
    excess = excess_of(case.fitter, nominal, completed)
    white = case.fitter.white_of(nominal, ModelBatch(completed.hypothesis.model))
    assert excess.sum() == pytest.approx(0.5 * (np.sum(nominal.white**2) - np.sum(white**2)))
    assert np.all(excess[~case.data.counted] == 0.0)


@pytest.mark.slow
def test_the_map_covers_every_recording():
    answer = bench("wip", {"translation/coulomb": {"F_c": 0.5}}, seed=9).diagnosed()
    pictured = answer.location.map
    assert pictured is not None
    assert pictured.signals == ("x", "x_dot")
    assert pictured.runs == ("r1.csv", "r2.csv")
    assert pictured.excess.shape == (len(pictured.edges[0]) - 1, len(pictured.edges[1]) - 1)
    assert all(np.all(np.diff(times) > 0.0) for times in pictured.times)
