"""The path from the command to the force, element by element and in the order of contract section 3.

The robot is a carriage of 1 kg (or, where speed must stay, one of a tonne): its acceleration is the force.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sim.robots import Effects, move, robot, row_forces, sines, unit_axis

from wipx.effects import speed_limit
from wipx.sim.analytic import AnalyticSimulator

T = np.linspace(0.0, 0.5, 251)  # rows of 2 ms
SINES = sines(T, 5.0)[:, 0]
RANDOM = np.random.default_rng(7).normal(0.0, 3.0, 250)


def forces_of(effects: Effects, commands: np.ndarray, speed: float = 0.0, t: np.ndarray = T) -> np.ndarray:
    """Mean force of each row on the carriage, shape (K,) [N]."""
    return row_forces(move(unit_axis(effects), (0.0, speed), t, commands))


def assert_forces(effects: Effects, commands: np.ndarray, expected: np.ndarray, atol: float = 1e-11) -> None:
    """Forces are as expected, up to the round-off of differences of speeds of 1 m/s over 2 ms."""
    np.testing.assert_allclose(forces_of(effects, commands), expected, rtol=0.0, atol=atol)


def test_the_bare_actuator_gives_the_command():
    assert_forces({}, RANDOM, RANDOM)


@pytest.mark.parametrize("rows", [1, 5, 40])
def test_a_delayed_command_is_the_command_shifted_by_whole_rows(rows: int):
    shifted = np.concatenate([np.full(rows, RANDOM[0]), RANDOM[:-rows]])
    assert_forces({"actuator/delay": {"tau": rows * 2e-3}}, RANDOM, shifted)


@settings(max_examples=30)
@given(rows=st.floats(0.0, 20.0))
def test_a_delay_by_a_fraction_of_a_row_mixes_the_two_neighbours(rows: float):
    whole, part = int(rows), rows - int(rows)
    past = np.concatenate([np.full(whole + 1, RANDOM[0]), RANDOM])
    mixed = (1.0 - part) * past[1 : 1 + len(RANDOM)] + part * past[: len(RANDOM)]
    assert_forces({"actuator/delay": {"tau": rows * 2e-3}}, RANDOM, mixed, 1e-10)


def test_delay_commutes_with_a_shift_of_time():
    model = robot("wip", {"actuator/delay": {"tau": 0.012}, "translation/coulomb": {"F_c": 1.0}})
    start = (0.0, 0.05, 0.0, 0.0)
    now = move(model, start, T, SINES)
    later = move(model, start, T + 3.7, SINES)
    np.testing.assert_allclose(later.q, now.q, atol=1e-11)  # round-off of times


def test_delay_takes_uneven_rows_as_they_are():
    rng = np.random.default_rng(3)
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(1e-3, 4e-3, 250))])
    held = forces_of({"actuator/delay": {"tau": 0.011}}, RANDOM, t=t)
    exact = []
    for begin, end in zip(t[:-1] - 0.011, t[1:] - 0.011, strict=True):
        knots = np.unique(np.clip(np.concatenate([[begin, end], t]), begin, end))
        k = np.clip(np.searchsorted(t, 0.5 * (knots[1:] + knots[:-1]), side="right") - 1, 0, 249)
        exact.append(np.sum(np.diff(knots) * RANDOM[k]) / (end - begin))
    np.testing.assert_allclose(held, exact, atol=1e-10)


def test_the_step_response_of_a_lag_is_an_exponential():
    tau = 0.03
    commands = np.concatenate([[0.0], np.full(249, 2.0)])
    since = T[1:-1] - T[1]
    mean = 2.0 * (1.0 - tau / 2e-3 * np.exp(-since / tau) * (1.0 - np.exp(-2e-3 / tau)))
    assert_forces({"actuator/lag": {"tau": tau}}, commands, np.concatenate([[0.0], mean]), 1e-9)
    # And so the force itself: 1 - exp(-t/tau), read off at rows short against tau.
    fine = np.linspace(0.0, 0.1, 1001)
    force = forces_of({"actuator/lag": {"tau": tau}}, np.concatenate([[0.0], np.ones(999)]), t=fine)
    middle = 0.5 * (fine[1:-1] + fine[2:]) - fine[1]
    np.testing.assert_allclose(force[1:], 1.0 - np.exp(-middle / tau), atol=1e-6)  # (1e-4/tau)^2 / 24


def test_a_lag_begins_settled_at_the_first_command():
    assert_forces({"actuator/lag": {"tau": 0.03}}, np.full(250, 2.0), np.full(250, 2.0))


def test_the_dead_zone_swallows_its_band():
    expected = np.sign(RANDOM) * np.maximum(np.abs(RANDOM) - 1.5, 0.0)
    assert_forces({"actuator/dead_zone": {"band": 1.5}}, RANDOM, expected)


def test_gain_offset_and_saturation():
    assert_forces({"actuator/gain": {"k": 0.7}}, RANDOM, 0.7 * RANDOM)
    assert_forces({"actuator/offset": {"F_0": -0.4}}, RANDOM, RANDOM - 0.4)
    assert_forces({"actuator/saturation": {"F_max": 2.0}}, RANDOM, np.clip(RANDOM, -2.0, 2.0))


def test_the_command_passes_delay_dead_zone_gain_and_saturation_in_this_order():
    effects: Effects = {
        "actuator/saturation": {"F_max": 3.0},
        "actuator/gain": {"k": 2.0},
        "actuator/dead_zone": {"band": 1.0},
        "actuator/delay": {"tau": 7e-3},
    }
    past = np.concatenate([np.full(4, RANDOM[0]), RANDOM])

    def passed(u: np.ndarray) -> np.ndarray:
        return np.clip(2.0 * np.sign(u) * np.maximum(np.abs(u) - 1.0, 0.0), -3.0, 3.0)

    # 7 ms are three rows and a half, and a half is a step of 1 ms: each half passes by itself.
    assert_forces(effects, RANDOM, 0.5 * passed(past[:-4]) + 0.5 * passed(past[1:-3]))


def test_speed_limit_comes_after_saturation_and_before_lag():
    # At 1 m/s of 4 the motor can drive with 3/4 of 8 N: the saturation at 7 N does not show, the lag smooths the rest.
    effects: Effects = {
        "actuator/lag": {"tau": 0.01},
        "actuator/speed_limit": {"F_stall": 8.0, "v_free": 4.0},
        "actuator/saturation": {"F_max": 7.0},
    }
    heavy = robot("linear_axis", effects, {"wheel_mass": 1e6})
    commands = np.concatenate([[0.0], np.full(249, 20.0)])
    force = row_forces(move(heavy, (0.0, 1.0), T, commands)) * (1e6 + 2.0)
    mean = 6.0 * (1.0 - 5.0 * np.exp(-(T[1:-1] - T[1]) / 0.01) * (1.0 - np.exp(-0.2)))
    np.testing.assert_allclose(
        force[1:], mean, atol=1e-3
    )  # round-off: 1e-16 * 1e6 kg / 2 ms, and the speed drifts by 1e-6


def test_speed_limit_reads_the_torque_speed_line_when_driving_and_stall_when_braking():
    effects: Effects = {"actuator/speed_limit": {"F_stall": 8.0, "v_free": 4.0}}
    for speed, command, expected in (
        (1.0, 20.0, 6.0),
        (1.0, -20.0, -8.0),
        (1.0, 5.0, 5.0),
        (5.0, 3.0, 0.0),
        (-1.0, -20.0, -6.0),
    ):
        heavy = robot("linear_axis", effects, {"wheel_mass": 1e6})
        force = row_forces(move(heavy, (0.0, speed), T, np.full(250, command)))[-1] * (1e6 + 2.0)
        assert force == pytest.approx(expected, abs=1e-3)


@given(force=st.floats(-20.0, 20.0), v=st.floats(-8.0, 8.0))
def test_the_speed_limit_never_adds_force(force: float, v: float):
    limited = speed_limit.limited(force, v, 8.0, 4.0, 0.0)
    assert abs(limited) <= min(abs(force), 8.0)
    assert limited * force >= 0.0


def test_a_motor_cannot_drive_itself_beyond_its_free_speed():
    model = unit_axis({"actuator/speed_limit": {"F_stall": 8.0, "v_free": 1.0}})
    v = move(model, (0.0, 0.0), np.linspace(0.0, 2.0, 501), np.full(500, 20.0)).v[:, 0]
    # v' = 8 (1 - v) up to 1 m/s
    np.testing.assert_allclose(
        v, 1.0 - np.exp(-8.0 * np.linspace(0.0, 2.0, 501)), atol=5e-5
    )  # first step of 1 ms explicit


def test_back_emf_is_viscous_friction_at_the_driven_joint():
    motor = move(
        robot("wip", {"actuator/back_emf": {"k_e": 2.0}}), (0.0, 0.1, 0.5, 0.0), T, SINES, AnalyticSimulator(2.5e-4)
    )
    joint = move(
        robot("wip", {"translation/viscous": {"sigma": 2.0}}), (0.0, 0.1, 0.5, 0.0), T, SINES, AnalyticSimulator(2.5e-4)
    )
    np.testing.assert_allclose(motor.q, joint.q, atol=1e-6)  # explicit against implicit: second order at 0.25 ms


def test_back_emf_comes_before_the_lag_and_is_lagged_with_it():
    effects: Effects = {"actuator/back_emf": {"k_e": 3.0}, "actuator/lag": {"tau": 0.02}}
    heavy = robot("linear_axis", effects, {"wheel_mass": 1e6})
    force = row_forces(move(heavy, (0.0, 2.0), T, np.full(250, 1.0)))[-1] * (1e6 + 2.0)
    assert force == pytest.approx(1.0 - 3.0 * 2.0, abs=1e-3)


def test_ripple_follows_the_place_and_not_the_time():
    effects: Effects = {"actuator/ripple": {"A": 2.0, "n": 3.0, "phase": 0.4}}
    heavy = robot("linear_axis", effects, {"wheel_mass": 1e6, "wheel_radius": 0.05})
    motion = move(heavy, (0.0, 1.0), T, np.zeros(250))
    middle = 0.5 * (motion.q[1:, 0] + motion.q[:-1, 0])
    # 60 rad/m: mean over a row of 2 mm is cos of its middle up to (0.12)^2 / 24.
    np.testing.assert_allclose(row_forces(motion) * (1e6 + 2.0), 2.0 * np.cos(60.0 * middle + 0.4), atol=3e-3)


@pytest.mark.parametrize(("gap", "drive_inertia"), [(1e-3, 0.5), (4e-3, 0.2)])
def test_backlash_gives_no_force_while_crossing_and_full_force_in_contact(gap: float, drive_inertia: float):
    effects: Effects = {"actuator/backlash": {"gap": gap, "drive_inertia": drive_inertia, "drive_damping": 0.0}}
    commands = np.where(T[:-1] < 0.1, 3.0, -3.0)
    force = forces_of(effects, commands)
    crossing = np.sqrt(2.0 * gap * drive_inertia / 3.0)  # the free drive under its own force
    np.testing.assert_allclose(force[T[1:] <= 0.1], 3.0, atol=1e-11)
    free = (T[:-1] >= 0.1) & (T[1:] <= 0.1 + crossing - 2e-3)  # a step of 1 ms at either end
    np.testing.assert_allclose(force[free], 0.0, atol=1e-11)
    contact = T[:-1] >= 0.1 + crossing + 2e-3
    np.testing.assert_allclose(force[contact], -3.0, atol=1e-11)
    assert np.count_nonzero(free) >= 5


def test_soft_flanks_pass_the_force_on_later_and_none_of_it_is_lost():
    hard = {"gap": 1e-3, "drive_inertia": 0.2, "drive_damping": 0.0}
    commands = np.where(T[:-1] < 0.1, 3.0, -3.0)
    contact_time = 2.5e-3
    late = forces_of({"actuator/backlash": {**hard, "contact_time": contact_time}}, commands)
    prompt = forces_of({"actuator/backlash": hard}, commands)
    impulse = np.cumsum(prompt - late) * (T[1] - T[0])
    # The force falls from 3 N to nothing in the gap, then to -3 N in contact; both changes are a time constant late.
    assert impulse[T[1:] <= 0.1][-1] == pytest.approx(0.0, abs=1e-9)
    assert impulse[-1] == pytest.approx(-6.0 * contact_time, rel=1e-6)


def test_a_gap_of_zero_is_no_backlash():
    model = robot("wip", {"actuator/backlash": {"gap": 0.0, "drive_inertia": 0.3, "drive_damping": 0.0}})
    start = (0.0, 0.05, 0.0, 0.0)
    np.testing.assert_array_equal(move(model, start, T, SINES).q, move(robot("wip"), start, T, SINES).q)


def test_the_drive_pushes_again_only_after_the_whole_gap():
    # A reversal shorter than the crossing leaves no force on the carriage at all.
    effects: Effects = {"actuator/backlash": {"gap": 5e-3, "drive_inertia": 0.5, "drive_damping": 0.0}}
    commands = np.full(250, 1.0)
    commands[50:60] = -1.0  # 20 ms; crossing takes 71 ms
    force = forces_of(effects, commands)
    np.testing.assert_allclose(force[:50], 1.0, atol=1e-11)
    np.testing.assert_allclose(force[50:60], 0.0, atol=1e-11)
    assert force[-1] == pytest.approx(1.0, abs=1e-11)


def test_a_drive_that_returns_its_momentum_makes_the_motion_late_and_no_slower():
    gap, inertia, mass = 4e-3, 0.2, 2.0  # the drive's inertia is part of the mass that the owner weighed
    law = {"gap": gap, "drive_inertia": inertia, "drive_damping": 0.0, "returned": 1.0}
    commands = np.where(T[:-1] < 0.1, 3.0, -3.0)
    axis = {"wheel_mass": mass, "body_mass": 0.0}
    fine = AnalyticSimulator(step=1e-4)
    loose = move(robot("linear_axis", {"actuator/backlash": law}, axis), (0.0, 0.0), T, commands, fine)
    rigid = move(robot("linear_axis", {}, axis), (0.0, 0.0), T, commands, fine)
    free = (mass - inertia) * inertia / mass  # drive and carriage part from each other with the reduced mass
    crossed = 0.1 + np.sqrt(2.0 * gap * free / 3.0) + 4e-3 <= T
    np.testing.assert_allclose(loose.v[crossed, 0], rigid.v[crossed, 0], atol=1e-9)
    # The centre of mass moves as if rigid: the drive is a gap further back, so the carriage that much further ahead.
    ahead = loose.q[crossed, 0] - rigid.q[crossed, 0]
    np.testing.assert_allclose(ahead, gap * inertia / mass, rtol=0.01)


def test_actuator_effects_act_on_every_driven_joint():
    t = np.linspace(0.0, 0.1, 51)
    commands = np.tile([1.0, -1.0], (50, 1))
    weak = move(robot("double_pendulum", {"actuator/gain": {"k": 0.5}}), np.zeros(4), t, commands)
    half = move(robot("double_pendulum"), np.zeros(4), t, 0.5 * commands)
    np.testing.assert_array_equal(weak.q, half.q)
