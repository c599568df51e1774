"""Forces that depend on the place are found wherever they are."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench

from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.position_scan import ripples, sticky_spots


@pytest.mark.slow
@pytest.mark.parametrize("periods", [1.3, 5.0, 12.0])
def test_ripple_is_found_at_any_number_of_periods(periods: float, fresh_seed: int):
    way = np.ptp(np.concatenate([r["theta"] for r in bench("pendulum", {}, fresh_seed).recordings]))
    truth = {"A": 0.02, "n": 2.0 * np.pi * periods / way, "phase": 1.0}
    case = bench("pendulum", {"actuator/ripple": truth}, fresh_seed)
    amplitude, number, _ = guesses(ripples, "actuator/ripple", case)[0]
    assert number * way == pytest.approx(truth["n"] * way, abs=1.5)  # [rad] over the whole way
    assert amplitude == pytest.approx(truth["A"], rel=0.5)


@pytest.mark.parametrize("width", [0.15, 0.4])
def test_a_sticky_spot_is_found_where_it_is(width: float, fresh_seed: int):
    x = bench("linear_axis", {}, fresh_seed).recordings[0]["x"]
    low = float(np.random.default_rng(fresh_seed).uniform(0.2, 0.5))
    place = np.quantile(x, [low, low]) + np.array([0.0, width * np.ptp(x)])
    truth = {"F_c": 0.5, "lo": float(place[0]), "hi": float(place[1])}
    case = bench("linear_axis", {"translation/sticky_spot": truth}, fresh_seed)
    level, lo, hi = guesses(sticky_spots, "translation/sticky_spot", case)[0]
    passed = np.concatenate([r["x"] for r in case.recordings])
    seen = np.clip(place, passed.min(), passed.max())  # friction may keep the axis from going all the way
    assert [lo, hi] == pytest.approx(seen.tolist(), abs=0.05 * np.ptp(passed))
    assert level == pytest.approx(truth["F_c"], rel=0.5)


def guesses(scan, effect: str, case: Bench) -> np.ndarray:
    """What a scan makes of what the nominal model leaves."""
    return scan(LeftOverByRow(case.fitter, case.fit()), effect)
