"""The paper's controller: its reference goes to where the robot balances, and the robot comes back to its place."""

import numpy as np
import pytest
from balancing import KnownPitch, heavy_robot, loaded, release
from sim.robots import robot

from wipx.control.balance_watch import BalanceWatch
from wipx.control.equilibrium import EquilibriumLqr
from wipx.control.lqr import Lqr
from wipx.control.soft_update import SoftUpdate
from wipx.core.errors import InputError


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_robot_comes_back_to_its_place_on_either_side(sign: float, fresh_seed: int):
    pitch = sign * np.random.default_rng(fresh_seed).uniform(0.03, 0.07)
    model = heavy_robot()
    knowing = release(EquilibriumLqr().loop(model, KnownPitch(pitch)), loaded(model, pitch), 8.0)
    baseline = release(Lqr().loop(model), loaded(model, pitch), 4.0)
    assert abs(knowing.states[-1, 0]) < 0.02
    assert abs(baseline.states[-1, 0]) > 0.3  # -K_x x = K_theta theta_eq holds it there
    # Where it balances the wheels carry no force.
    assert knowing.commands[-1] == pytest.approx(0.0, abs=0.1)
    assert knowing.states[-1, 1] == pytest.approx(pitch, abs=2e-3)


@pytest.mark.parametrize("target", [-0.07, 0.07])
@pytest.mark.parametrize("rate", [200.0, 650.0])
def test_the_reference_neither_overshoots_nor_hurries(target: float, rate: float):
    soft = SoftUpdate(0.05, 0.1)
    course = []
    for _ in range(round(3.0 * rate)):
        soft.advance(target, 1.0 / rate)
        course.append(soft.smooth * np.sign(target))
    course = np.array(course)
    assert np.all(np.diff(course) >= 0.0)
    assert course[-1] <= abs(target)
    assert course[-1] == pytest.approx(abs(target), rel=1e-6)
    assert np.max(np.diff(course)) * rate <= 0.1 * (1.0 + 1e-9)


def test_the_reference_is_that_of_the_papers_equation():
    target, alpha, beta = -0.05, 0.05, 0.1
    soft, smooth = SoftUpdate(alpha, beta), 0.0
    for k in range(1, 650):
        soft.advance(target, 1.0 / 650.0)
        smooth = alpha * max(target, -beta * k / 650.0) + (1.0 - alpha) * smooth
        assert soft.smooth == pytest.approx(smooth, rel=1e-9)


def test_the_reference_does_not_depend_on_the_rate():
    slow, fast = SoftUpdate(0.05, 0.1), SoftUpdate(0.05, 0.1)
    for _ in range(200):
        slow.advance(0.04, 0.005)
        for _ in range(5):
            fast.advance(0.04, 0.001)
    assert slow.smooth == pytest.approx(fast.smooth, abs=1e-9)


@pytest.mark.parametrize("half_width", [0.06, float("nan")])
def test_a_wide_interval_is_not_trusted(half_width: float, caplog: pytest.LogCaptureFixture):
    model = heavy_robot()
    loop = EquilibriumLqr(widest=0.1).loop(model, KnownPitch(-0.05, half_width))
    held = release(loop, loaded(model, -0.05), 2.0)
    baseline = release(Lqr().loop(model), loaded(model, -0.05), 2.0)
    np.testing.assert_array_equal(held.commands, baseline.commands)
    assert loop.pitch_reference == 0.0
    assert len(loop.notes) == 1
    assert "the reference is held" in loop.notes[0]
    assert caplog.messages == list(loop.notes)


def test_a_trusted_estimate_is_noted_once_and_forgotten_by_a_reset():
    model, estimator = heavy_robot(), KnownPitch(-0.05)
    loop = EquilibriumLqr().loop(model, estimator)
    release(loop, loaded(model, -0.05), 2.0)
    assert loop.notes == ("t = 1.186 s: equilibrium pitch -0.0500 rad, 90 % interval -0.0600 to -0.0400",)
    assert len(estimator.asked or []) == 1
    loop.reset(0.0, np.zeros(4))
    assert loop.notes == ()
    assert loop.pitch_reference == 0.0


def test_the_estimator_sees_what_the_sensors_showed_from_the_release_on(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    estimator = KnownPitch(0.0, length=40, period=0.02)
    loop = EquilibriumLqr().loop(heavy_robot(), estimator)
    released, t = 5.0, 5.0
    loop.reset(released, np.zeros(4))
    while not estimator.asked:
        measured = np.array([0.3 * (t - released), -0.1 * (t - released), 0.0, 0.0])
        if t > released:
            measured[rng.uniform(size=4) < 0.3] = np.nan  # an IMU is slower than the loop, and readings get lost
        loop.step(t, measured, np.zeros(4))
        t += rng.uniform(0.8, 1.2) / 650.0
    seen = estimator.asked[0]
    assert seen.shape == (1, 40, 2)
    # Straight lines survive interpolation; the last sample may be some readings old.
    np.testing.assert_allclose(seen[0, :, 0], 0.3 * 0.02 * np.arange(40), atol=0.3 * 0.01)
    np.testing.assert_allclose(seen[0, :-1, 1], -0.1 * 0.02 * np.arange(39), atol=1e-9)


def test_the_balance_is_read_off_the_motion_under_an_unknown_load(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    pitch, mass = rng.uniform(-0.1, 0.1), rng.uniform(0.3, 2.0)
    model = heavy_robot()
    run = release(Lqr().loop(model), loaded(model, pitch, mass), 2.0)
    watch = BalanceWatch(model, 1.0)
    for t, state in zip(run.t, run.states, strict=True):
        watch.see(t, state)
    # The load changes L + I_b / (m_b L) by up to a fifth, and small angles are assumed.
    assert watch.pitch == pytest.approx(pitch, abs=2e-3 + 0.03 * abs(pitch))


def test_an_adaptive_reference_corrects_a_wrong_first_estimate():
    model, pitch = heavy_robot(), -0.06
    wrong = KnownPitch(-0.04)
    plain = release(EquilibriumLqr().loop(model, wrong), loaded(model, pitch), 5.0)
    adaptive = release(EquilibriumLqr(adaptive=1.0).loop(model, wrong), loaded(model, pitch), 8.0)
    assert abs(plain.states[-1, 0]) > 0.2
    assert abs(adaptive.states[-1, 0]) < 0.02


def test_robots_that_do_not_balance_on_a_carriage_are_refused():
    with pytest.raises(InputError, match="got a pendulum"):
        EquilibriumLqr().loop(robot("pendulum"), KnownPitch(0.0))


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match="alpha is 0"):
        EquilibriumLqr(alpha=0.0)
    with pytest.raises(InputError, match="widest is -1"):
        EquilibriumLqr(widest=-1.0)
    with pytest.raises(InputError, match="adaptive is 0"):
        EquilibriumLqr(adaptive=0.0)
