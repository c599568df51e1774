"""Forces that the drive reports: what they settle, and what is not believed of them."""

import numpy as np
import pytest
from diagnosis.recorded import Bench, Recordings, bench, recorded
from identify.emulated_robot import nominal_model

from wipx.core.recording import Recording

DELAY = 0.012  # [s]


def reporting(
    recordings: Recordings, rng: np.random.Generator, *, delay: float = 0.0, scale: float = 1.0
) -> Recordings:
    """With the delayed command as the drive's noisy sensor shows it, read in the middle of each row."""

    def force(recording: Recording) -> np.ndarray:
        middle = recording.t + 0.5 * np.median(np.diff(recording.t)) - delay
        held = recording["u"][np.maximum(np.searchsorted(recording.t, middle, side="right") - 1, 0)]
        return scale * held + 0.3 + 0.03 * np.std(held) * rng.normal(size=len(held))

    return tuple(Recording(r.name, {**r.columns, "u_measured": force(r)}, r.source, r.periods) for r in recordings)


@pytest.mark.slow
def test_a_reported_force_tells_a_late_drive_from_a_late_sensor(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    silent = recorded("linear_axis", {"actuator/delay": {"tau": DELAY}}, fresh_seed)
    nominal = nominal_model("linear_axis")
    (unknown,) = Bench(nominal, silent, {}).diagnosed().effects
    assert {unknown.name, *unknown.equivalent} >= {"actuator/delay", "sensor_x/delay"}
    (known,) = Bench(nominal, reporting(silent, rng, delay=DELAY), {}).diagnosed().effects
    assert known.name == "actuator/delay"
    assert "sensor_x/delay" not in known.equivalent
    assert known.parameters[0].value == pytest.approx(DELAY, rel=0.05)


@pytest.mark.slow
def test_a_drive_that_follows_its_command_leaves_the_delay_to_the_sensor(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    late = recorded("linear_axis", {"sensor_x/delay": {"tau": DELAY}}, fresh_seed)
    (found,) = Bench(nominal_model("linear_axis"), reporting(late, rng), {}).diagnosed().effects
    assert found.name == "sensor_x/delay"
    assert "actuator/delay" not in found.equivalent


@pytest.mark.parametrize("kind", [pytest.param("wip", marks=pytest.mark.slow), "linear_axis"])
def test_scale_and_zero_of_the_drive_are_not_trusted(kind: str, fresh_seed: int):
    plain = bench(kind, {}, fresh_seed)
    told = reporting(plain.recordings, np.random.default_rng(fresh_seed), scale=1.2)
    assert Bench(plain.nominal, told, {}).diagnosed().verdict == "consistent"


def test_a_repeated_command_tells_nothing():
    plain = bench("wip", {}, seed=1)
    echo = tuple(Recording(r.name, {**r.columns, "u_measured": 0.9 * r["u"]}, r.source) for r in plain.recordings)
    assert plain.data.reported.shape[1] == 0
    assert Bench(plain.nominal, echo, {}).data.reported.shape[1] == 0


@pytest.mark.parametrize("kind", [pytest.param("wip", marks=pytest.mark.slow), "linear_axis"])
def test_a_report_that_comes_late_is_no_late_drive(kind: str, fresh_seed: int):
    plain = bench(kind, {}, fresh_seed)
    late = reporting(plain.recordings, np.random.default_rng(fresh_seed), delay=0.005)  # more than a row
    assert Bench(plain.nominal, late, {}).diagnosed().verdict == "consistent"


def test_a_drive_that_only_holds_tells_nothing_of_its_delay():
    """Its forces of neighbouring rows are all alike, so that no equations tell them apart."""
    (plain, *_) = recorded("linear_axis", {}, seed=1)
    rng, still = np.random.default_rng(1), np.ones(len(plain))
    reported = 1.0 + 1e-5 * rng.normal(size=len(plain))
    holding = Recording("r1.csv", {**plain.columns, "u": still, "u_measured": reported}, plain.source, plain.periods)
    held = Bench(nominal_model("linear_axis"), (holding,), {})
    assert held.data.reported.shape[1] == 1
    assert np.isfinite(held.fit().log_likelihood)
