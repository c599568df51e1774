"""Friction laws among each other: one reduces to another, and each to its steady state."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from sim.robots import LIVELY, Motion, move, robot, sines, unit_axis

from wipx.effects import lagged_stribeck, load_friction, quadratic_drag, sticky_spot, stribeck
from wipx.effects.presliding import bristle

T = np.linspace(0.0, 1.0, 201)
SPEEDS = st.floats(-3.0, 3.0)
LEVELS = st.floats(0.0, 10.0)


def shaken(friction: str, values: dict[str, float]) -> Motion:
    """A wip with that friction at both joints, under a lively command."""
    model = robot("wip", {f"{site}/{friction}": values for site in ("translation", "pitch")})
    return move(model, LIVELY["wip"], T, sines(T, 6.0))


def assert_same(a: Motion, b: Motion, atol: float) -> None:
    np.testing.assert_allclose(a.q, b.q, rtol=0.0, atol=atol)
    np.testing.assert_allclose(a.v, b.v, rtol=0.0, atol=atol)


def test_stribeck_reduces_to_coulomb_at_zero_bump():
    assert_same(shaken("stribeck", {"F_c": 0.3, "F_s": 0.3, "v_s": 0.1}), shaken("coulomb", {"F_c": 0.3}), 0.0)


def test_asymmetric_coulomb_with_equal_levels_is_coulomb():
    assert_same(shaken("asymmetric_coulomb", {"F_plus": 0.3, "F_minus": 0.3}), shaken("coulomb", {"F_c": 0.3}), 0.0)


def test_lugre_without_bump_and_damping_is_presliding():
    lugre = {"F_c": 0.3, "F_s": 0.3, "v_s": 0.1, "stiffness": 2000.0, "damping": 0.0}
    assert_same(shaken("lugre", lugre), shaken("presliding", {"F_c": 0.3, "stiffness": 2000.0}), 0.0)


def test_hysteresis_with_exponent_one_and_no_asymmetry_is_presliding():
    plain = {"F_c": 0.3, "stiffness": 2000.0}
    assert_same(shaken("hysteresis", {**plain, "n": 1.0, "gamma": 0.0}), shaken("presliding", plain), 0.0)


@given(st.floats(1.0, 4.0), st.floats(-0.5, 0.5))
@settings(max_examples=8, deadline=None)
def test_hysteresis_follows_the_equation_of_bouc_and_wen(exponent: float, gamma: float):
    level, stiffness, push = 0.5, 10.0, 0.5
    values = {"F_c": level, "stiffness": stiffness, "n": exponent, "gamma": gamma}
    t = np.linspace(0.0, 3.0, 3001)
    motion = move(unit_axis({"translation/hysteresis": values}), (0.0, push), t)

    def equation(now, state):
        _, v, z = state
        forgets = (1.0 - gamma) * abs(v) * abs(z) ** (exponent - 1.0) * z + gamma * v * abs(z) ** exponent
        return v, -level * z, stiffness / level * (v - forgets)

    exact = solve_ivp(equation, (0.0, 3.0), (0.0, push, 0.0), rtol=1e-8, atol=1e-10, t_eval=t[::50])
    assert exact.y[0].max() > 2.0 * level / stiffness  # it yields
    assert exact.y[1].min() < -0.01  # and springs back
    np.testing.assert_allclose(motion.q[::50, 0], exact.y[0], atol=1e-4 * exact.y[0].max())


def test_a_stiffer_bristle_comes_closer_to_coulomb():
    coulomb = shaken("coulomb", {"F_c": 0.3})
    gaps = []
    for stiffness in (100.0, 1e3, 1e5):
        motion = shaken("presliding", {"F_c": 0.3, "stiffness": stiffness})
        gaps.append(np.max(np.abs(motion.q - coulomb.q)))
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 2e-3  # 3 um of bristle; the rest is the step that holds a reversal, grown by the fall


def test_a_sticky_spot_along_the_whole_rail_is_coulomb():
    spot = robot("wip", {"translation/sticky_spot": {"F_c": 2.0, "lo": -1e3, "hi": 1e3}})
    everywhere = robot("wip", {"translation/coulomb": {"F_c": 2.0}})
    commands = sines(T, 6.0)
    assert_same(move(spot, LIVELY["wip"], T, commands), move(everywhere, LIVELY["wip"], T, commands), 1e-9)


@pytest.mark.parametrize("friction", ["coulomb", "presliding", "lugre", "stribeck"])
def test_steady_sliding_is_resisted_by_the_coulomb_level(friction: str):
    values = {
        "coulomb": {"F_c": 1.0},
        "stribeck": {"F_c": 1.0, "F_s": 1.5, "v_s": 0.01},
        "presliding": {"F_c": 1.0, "stiffness": 1e3},
        "lugre": {"F_c": 1.0, "F_s": 1.5, "v_s": 0.01, "stiffness": 1e3, "damping": 1.0},
    }[friction]
    model = robot("linear_axis", {f"translation/{friction}": values, "translation/viscous": {"sigma": 10.0}})
    t = np.linspace(0.0, 6.0, 601)
    motion = move(model, (0.0, 0.0), t, np.full(600, 3.0))
    assert motion.v[-1, 0] == pytest.approx((3.0 - 1.0) / 10.0, rel=1e-8)  # exp(-6 s * 4/s) of the start is left


def test_a_bristle_is_a_spring_for_small_displacements():
    stiffness, level, mass = 1000.0, 10.0, 2.5
    model = robot("linear_axis", {"translation/presliding": {"F_c": level, "stiffness": stiffness}})
    omega = np.sqrt(stiffness / mass)
    reach = 1e-4 * level / stiffness
    t = np.linspace(0.0, 2.0 * np.pi / omega, 201)
    x = move(model, (0.0, reach * omega), t).q[:, 0]
    # Force 1e-4 of the level: the bristle forgets that share of the way; phase error (omega h)^2 / 24 * 2 pi.
    np.testing.assert_allclose(x, reach * np.sin(omega * t), atol=reach * (4e-4 + 2e-4))


def test_a_bristle_remembers_where_it_was_bent():
    # Dahl under a slow, growing force: stiffness z = F = F_c (1 - exp(-stiffness x / F_c)).
    model = robot(
        "linear_axis",
        {"translation/presliding": {"F_c": 1.0, "stiffness": 100.0}, "translation/viscous": {"sigma": 50.0}},
    )
    t = np.linspace(0.0, 40.0, 2001)
    pull = np.concatenate([np.linspace(0.0, 0.8, 1000), np.full(1000, 0.8)])
    x = move(model, (0.0, 0.0), t, pull).q[-1, 0]
    assert x == pytest.approx(-0.01 * np.log(1.0 - 0.8), rel=2e-3)  # settles as exp(-20 s * 20/50)


def test_a_released_bristle_springs_back_by_less_than_it_went():
    model = robot(
        "linear_axis",
        {"translation/presliding": {"F_c": 1.0, "stiffness": 100.0}, "translation/viscous": {"sigma": 50.0}},
    )
    t = np.linspace(0.0, 60.0, 3001)
    pull = np.concatenate([np.full(1500, 0.8), np.zeros(1500)])
    x = move(model, (0.0, 0.0), t, pull).q[:, 0]
    # Relaxed from F to 0 the bristle gives back F_c/stiffness ln(1 + F/F_c), less than it went.
    went, back = -0.01 * np.log(0.2), 0.01 * np.log(1.8)
    assert x[-1] == pytest.approx(went - back, rel=1e-2)


@given(speed=st.floats(1e-3, 3.0), step=st.sampled_from([2e-4, 1e-3]))
def test_the_deflection_of_a_bristle_is_exact_at_constant_speed(speed: float, step: float):
    stiffness, level = 500.0, 2.0
    rate = stiffness * speed / level
    kept, gain, mean = bristle(rate * step)
    z = kept * 1e-3 + gain * speed * step
    steady = level / stiffness
    assert z == pytest.approx(steady + (1e-3 - steady) * np.exp(-rate * step), rel=1e-9)  # polynomial of exp: 1e-11
    y = rate * step
    exact_mean = 0.5 - y / 6.0 + y * y / 24.0 if y < 1e-4 else (1.0 - (-np.expm1(-y)) / y) / y
    assert mean == pytest.approx(exact_mean, rel=1e-8)  # first term left out of its series: 0.02^4 / 720


@given(v=SPEEDS, static=LEVELS, coulomb=LEVELS, v_s=st.floats(1e-3, 1.0))
def test_the_stribeck_level_lies_between_coulomb_and_static(v: float, static: float, coulomb: float, v_s: float):
    level = coulomb + stribeck.bump(v, static, coulomb, v_s)
    assert level >= coulomb
    assert level <= max(static, coulomb) + 1e-12
    assert stribeck.bump(0.0, static, coulomb, v_s) == pytest.approx(max(static - coulomb, 0.0), abs=1e-12)


@given(v=SPEEDS, epsilon=st.floats(0.0, 0.5))
def test_the_papers_law_has_no_friction_below_epsilon_and_is_odd(v: float, epsilon: float):
    def law(speed: float) -> float:
        return lagged_stribeck.resistance(speed, 2.0, 1.0, 0.1, 0.5, epsilon)

    assert law(-v) == -law(v)
    expected = np.sign(v) * (1.0 + np.exp(-((v / 0.1) ** 2))) + 0.5 * v if abs(v) >= epsilon else 0.0
    assert law(v) == pytest.approx(expected, abs=1e-10)


def test_the_papers_model_at_alpha_1_is_its_steady_law():
    effects = {
        "translation/lagged_stribeck": {"F_s": 1.5, "F_c": 1.0, "v_s": 0.2, "sigma": 0.5, "epsilon": 1e-3, "alpha": 1.0}
    }
    t = np.linspace(0.0, 0.5, 501)
    v = move(robot("linear_axis", effects), (0.0, 2.0), t).v[:, 0]
    mean = 0.5 * (v[1:] + v[:-1])
    law = 1.0 + 0.5 * np.exp(-((mean / 0.2) ** 2)) + 0.5 * mean
    np.testing.assert_allclose(-2.5 * np.diff(v) / 1e-3, law, rtol=1e-3)  # the speed changes by 1e-3 v within a step


def test_the_papers_model_lets_a_joint_creep_where_others_stick():
    values = {"F_s": 1.5, "F_c": 1.0, "v_s": 0.2, "sigma": 0.0, "epsilon": 1e-3, "alpha": 1.0}
    creeping = move(robot("linear_axis", {"translation/lagged_stribeck": values}), (0.0, 5e-4), T)
    np.testing.assert_allclose(creeping.v, 5e-4, rtol=1e-12)


def test_the_papers_lag_delays_friction_by_its_mean_sample():
    values = {"F_s": 1.0, "F_c": 1.0, "v_s": 0.2, "sigma": 0.0, "epsilon": 1e-3, "alpha": 0.25}
    lag = lagged_stribeck.lag_of(0.25)
    assert lag == pytest.approx(0.75 / 650.0)
    # From rest into motion friction comes late by the lag: the impulse F_c lag is left as speed.
    t = np.linspace(0.0, 0.2, 201)
    pull = np.concatenate([[0.0], np.full(199, 4.0)])
    at_once = move(robot("linear_axis", {"translation/lagged_stribeck": {**values, "alpha": 1.0}}), (0.0, 0.0), t, pull)
    late = move(robot("linear_axis", {"translation/lagged_stribeck": values}), (0.0, 0.0), t, pull)
    assert late.v[-1, 0] - at_once.v[-1, 0] == pytest.approx(lag / 2.5, rel=1e-3)


@given(v=SPEEDS, c=LEVELS)
def test_quadratic_drag_is_odd_and_against_the_motion(v: float, c: float):
    assert quadratic_drag.force(v, c) == -quadratic_drag.force(-v, c)
    assert quadratic_drag.force(v, c) * v <= 0.0


@given(a=SPEEDS, b=SPEEDS, lo=SPEEDS, width=st.floats(0.0, 2.0))
def test_the_share_of_a_way_in_a_spot_is_a_share_and_additive(a: float, b: float, lo: float, width: float):
    whole = sticky_spot.share(a, b, lo, lo + width)
    assert 0.0 <= whole <= 1.0 + 1e-6  # a way shorter than 1 nm counts as 1 nm, which has round-off of 1e-7
    assert whole == sticky_spot.share(b, a, lo, lo + width)
    left = sticky_spot.share(a, b, lo, lo + 0.5 * width)
    right = sticky_spot.share(a, b, lo + 0.5 * width, lo + width)
    assert left + right == pytest.approx(whole, abs=2e-6)


@given(motor=SPEEDS, load=SPEEDS)
def test_load_friction_is_a_level_and_balanced_forces_cancel_in_it(motor: float, load: float):
    assert load_friction.level(motor, load, 0.2, 0.3) >= 0.0
    assert load_friction.level(motor, motor, 0.2, 0.2) == pytest.approx(0.0, abs=1e-15)
