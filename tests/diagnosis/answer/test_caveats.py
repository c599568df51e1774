"""What recordings lack is said before a reader relies on them."""

import numpy as np
import pytest

from wipx.core.diagnosis import FoundEffect
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.core.results import Estimate
from wipx.diagnosis.answer.caveats import caveats, implausible


def recording(name: str, t: np.ndarray) -> Recording:
    return Recording(name, {"t": t, "u": np.zeros(len(t))})


def even(name: str) -> Recording:
    return recording(name, np.arange(400) / 200.0)


def test_nothing_is_said_of_several_even_logs():
    assert caveats((even("r1.csv"), even("r2.csv"))) == ()


def test_missing_rows_are_counted(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    kept = np.ones(400, dtype=bool)
    lost = rng.choice(np.arange(1, 399), size=30, replace=False)
    kept[lost] = False
    (said,) = caveats((even("r1.csv"), recording("r2.csv", even("r2.csv").t[kept])))
    assert "in 1 of 2 recordings" in said
    assert "r2.csv (30 of 400)" in said


def test_uneven_steps_are_told(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    steps = (1.0 + np.clip(0.1 * rng.standard_normal(2000), -0.3, 0.3)) / 200.0
    (said,) = caveats((recording("r1.csv", np.cumsum(steps)), even("r2.csv")))
    assert "most in r1.csv (by 10 %)" in said


def test_a_single_recording_is_no_second_opinion():
    (said,) = caveats((even("swing.csv"),))
    assert "one recording only, swing.csv" in said


def test_low_passed_signals_are_told_with_what_they_hide():
    (said,) = caveats((even("r1.csv"), even("r2.csv")), cut_off=3.04)
    assert "above 3 Hz" in said
    assert "backlash" in said


def test_a_log_that_turned_out_slow_is_told():
    (said,) = caveats((even("r1.csv"), even("r2.csv")), guessed_means=True)
    assert "slower than the controller" in said


@pytest.mark.parametrize(("value", "warned"), [(5.06, True), (1.4, False), (0.2, True)])
def test_an_inertia_that_is_far_from_the_owners_is_told(value: float, warned: bool):
    size = Estimate("geometry/inertia.scale", "", 1.0, value, 0.9 * value, 1.1 * value, False, "")
    found = FoundEffect("geometry/inertia", "", "", False, (size,), (), (), 50.0, 0.5, 1.0, 1.0, None)
    said = implausible([found], plant_of("wip"), 2.0)
    assert bool(said) == warned
    assert not warned or f"Wrong moment of inertia of the body: {value:.3g} times" in said[0]
