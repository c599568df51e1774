"""How much a drive gives at most is found wherever the limit is, also where commands are no forces."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import Bench, bench
from diagnosis.recorded_arm import arm, recorded

from wipx.core.recording import Recording
from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.limit_scan import saturations, speed_limits
from wipx.diagnosis.candidates.screening import candidates_of_effect

GAIN = 12.5  # N per unit of a command without unit


@pytest.mark.parametrize("share", [0.3, 0.6])
@pytest.mark.parametrize("gain", [1.0, GAIN])
def test_a_saturation_is_found_where_it_is(share: float, gain: float, fresh_seed: int):
    truth = share * np.abs(bench("linear_axis", {}, fresh_seed).recordings[0]["u"]).max()
    case = bench("linear_axis", {"actuator/saturation": {"F_max": float(truth)}}, fresh_seed)
    found = guesses(saturations, "actuator/saturation", in_units(case, gain))[:, 0]
    assert np.abs(np.log(found / truth)).min() < 0.15


@pytest.mark.parametrize("answer", [1.0, 0.3])
def test_a_torque_speed_line_is_found_where_it_is(answer: float, fresh_seed: int):
    """Also where the linear response is three times as large as what is left."""
    usual = bench("linear_axis", {}, fresh_seed).recordings[0]
    truth = {
        "F_stall": 0.7 * float(np.abs(usual["u"]).max()),
        "v_free": 1.2 * float(np.abs(np.gradient(usual["x"], usual.t)).max()),
    }
    case = bench("linear_axis", {"actuator/speed_limit": truth}, fresh_seed, count=4, duration=10.0)
    found = guesses(speed_limits, "actuator/speed_limit", case, answer)
    assert np.abs(np.log(found / list(truth.values()))).max(axis=1).min() < 0.35


def test_a_drive_that_gives_all_it_is_asked_for_shows_hardly_a_limit(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    largest = max(np.abs(r["u"]).max() for r in case.recordings)
    assert all(limit > 0.5 * largest for (limit,) in guesses(saturations, "actuator/saturation", case))


def in_units(case: Bench, gain: float) -> Bench:
    """The same recordings with commands in a unit of their own."""
    recordings = tuple(
        Recording(r.name, {**r.columns, "u": r["u"] / gain}, r.source, r.periods) for r in case.recordings
    )
    nominal = replace(case.nominal, parameters={**case.nominal.parameters, "input_gain": gain})
    return Bench(nominal, recordings, {})


def guesses(scan, effect: str, case: Bench, answer: float = 1.0) -> np.ndarray:
    """What a scan makes of what the nominal model leaves, or of a share of it."""
    fit = case.fit()
    return scan(LeftOverByRow(case.fitter, replace(fit, white=answer * fit.white)), effect)


def test_a_limit_of_few_rows_is_found_where_a_joint_is_quiet(tmp_path: Path, fresh_seed: int):
    """The errors of the joint are white, but for the instants in which its drive gives less than it is asked for."""
    model = arm(tmp_path)
    asked = np.abs(recorded(model, fresh_seed)["u_elbow"])
    limit = {"F_max": float(np.quantile(asked, 0.997))}
    rows = recorded(model.with_effects({"actuator_elbow/saturation": limit}), fresh_seed)
    case = Bench(model, (rows,), {})
    found = candidates_of_effect(case.fitter, case.setting, case.fit(), "actuator_elbow/saturation")
    best = max(found, key=lambda candidate: candidate.gain)
    assert best.gain > 10.0
    assert best.values["actuator_elbow/saturation.F_max"] == pytest.approx(limit["F_max"], rel=0.15)
