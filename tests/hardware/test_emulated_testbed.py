"""The emulated testbed: recordings as contract section 1 has them, of a robot that nobody knows entirely."""

import numpy as np
import pytest
from sim.robots import PARAMETERS

from wipx.control.lqr import Lqr
from wipx.core.errors import InputError
from wipx.core.plant import plant_of
from wipx.effects.catalogue import check_together, effect_of
from wipx.hardware import testbed
from wipx.hardware.testbed import EmulatedTestbed
from wipx.sim.simulator import StateFeedback

NAMES = tuple(f"r{i}" for i in range(6))
TESTBED = EmulatedTestbed("wip", {**PARAMETERS["wip"], "body_mass": 5.0, "body_inertia": 0.15}, duration=1.5)
RATE = 650.0


def record(seed: int) -> testbed.TestbedRun:
    nominal = TESTBED.nominal()
    return TESTBED.record(nominal, Lqr().feedback(nominal), RATE, np.random.default_rng(seed), NAMES)


@pytest.fixture(scope="module")
def run() -> testbed.TestbedRun:
    return record(1)


def test_recordings_have_the_columns_of_the_contract(run: testbed.TestbedRun):
    assert [r.name for r in run.recordings] == list(NAMES)
    for recording in run.recordings:
        assert set(recording.columns) == {"t", "x", "theta", "u"}
        assert np.all(np.diff(recording.t) > 0.0)
        assert all(np.isfinite(values).all() for values in recording.columns.values())
        assert recording.rate == pytest.approx(RATE / 2.0)
        assert recording.duration == pytest.approx(1.5, abs=3.5 / RATE)  # the last interval may not be whole


def test_positions_are_steps_of_the_encoder(run: testbed.TestbedRun):
    counts = run.recordings[0]["x"] / TESTBED.position_step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)


def test_excitations_differ(run: testbed.TestbedRun):
    for a, b in zip(run.recordings[:-1], run.recordings[1:], strict=True):
        assert np.max(np.abs(a["u"] - b["u"])) > 0.5


def test_the_robot_has_physics_that_its_owner_does_not_know(run: testbed.TestbedRun):
    nominal = TESTBED.nominal()
    assert not nominal.effects
    assert run.hidden.parameters == nominal.parameters
    names = tuple(run.hidden.effects)
    check_together(names, run.hidden.plant)
    for name, values in run.hidden.effects.items():
        assert set(values) == set(effect_of(name, run.hidden.plant).neutral)
        assert values != effect_of(name, run.hidden.plant).neutral


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_robot(run: testbed.TestbedRun, fresh_seed: int):
    again, other = record(1), record(fresh_seed + 2)
    for a, b, c in zip(run.recordings, again.recordings, other.recordings, strict=True):
        for column in a.columns:
            assert a[column].tobytes() == b[column].tobytes()
        assert a["u"].tobytes() != c["u"].tobytes()
    assert again.hidden == run.hidden
    assert other.hidden != run.hidden


def test_the_logged_command_is_the_mean_over_its_interval():
    # A loop logged at full rate and at half of it, of the same robot and noise.
    nominal = TESTBED.nominal()
    every = EmulatedTestbed("wip", TESTBED.parameters, duration=0.5, log_every=1)
    second = EmulatedTestbed("wip", TESTBED.parameters, duration=0.5, log_every=2)
    fast, slow = (
        bed.record(nominal, Lqr().feedback(nominal), RATE, np.random.default_rng(3), ("r",)).recordings[0]
        for bed in (every, second)
    )
    rows = 2 * len(slow)
    np.testing.assert_allclose(slow["u"], fast["u"][:rows].reshape(-1, 2).mean(axis=1), rtol=1e-12)
    np.testing.assert_array_equal(slow["theta"], fast["theta"][:rows:2])


def test_a_robot_that_falls_is_refused_in_one_line():
    nominal = TESTBED.nominal()
    limp = StateFeedback(np.zeros((1, 4)), rate_filter=0.005)
    with pytest.raises(InputError, match="fell over") as caught:
        TESTBED.record(nominal, limp, RATE, np.random.default_rng(0), NAMES)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["cartpole", "linear_axis"])
def test_other_plants_stand_on_the_testbed_too(kind: str):
    bed = EmulatedTestbed(kind, PARAMETERS[kind], duration=0.5)
    nominal = bed.nominal()
    run = bed.record(nominal, Lqr().feedback(nominal), RATE, np.random.default_rng(2), ("a", "b"))
    assert set(run.recordings[0].columns) == {"t", "u", *plant_of(kind).coordinates}


def test_an_unknown_parameter_is_refused():
    with pytest.raises(InputError, match=r"target\.parameters: unknown parameter"):
        EmulatedTestbed("wip", {**PARAMETERS["wip"], "mass": 1.0}).nominal()
