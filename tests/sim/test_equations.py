"""The compiled equations of motion against contract section 2, written a second time."""

import numpy as np
import pytest
from sim.robots import (
    LIVELY,
    PARAMETERS,
    Effects,
    Forces,
    Motion,
    energy,
    move,
    reference,
    robot,
    row_forces,
    sines,
    unit_axis,
)

from wipx.core.model import Model
from wipx.sim.analytic import AnalyticSimulator

ONE_SECOND = np.linspace(0.0, 1.0, 126)  # rows of 8 ms: whole numbers of all the steps below
DRIVEN = {"wip": (0,), "cartpole": (0,), "pendulum": (0,), "linear_axis": (0,), "double_pendulum": (0, 1)}
STRENGTH = {"wip": 6.0, "cartpole": 6.0, "pendulum": 1.5, "linear_axis": 2.0, "double_pendulum": 0.8}


def commanded(kind: str, commands: np.ndarray) -> Forces:
    def forces(row: int, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        pull = np.zeros(len(q))
        pull[list(DRIVEN[kind])] = commands[row]
        return pull

    return forces


def distance(a: Motion, b: Motion) -> float:
    """Largest difference of coordinates and rates [SI]."""
    return float(max(np.max(np.abs(a.q - b.q)), np.max(np.abs(a.v - b.v))))


def errors(model: Model, commands: np.ndarray, exact: Motion, steps: tuple[float, ...]) -> list[float]:
    start = [*exact.q[0], *exact.v[0]]
    return [distance(move(model, start, exact.t, commands, AnalyticSimulator(step)), exact) for step in steps]


def assert_second_order(coarse: float, fine: float, at_most: float) -> None:
    """The error at half the step is a quarter, and small; an exact part has none."""
    assert fine < at_most
    assert fine < 1e-9 or coarse / fine == pytest.approx(4.0, rel=0.2)  # next order: a tenth and less at these steps


@pytest.mark.parametrize("kind", PARAMETERS)
def test_rigid_body_converges_to_the_equations_at_second_order(kind: str):
    commands = sines(ONE_SECOND, STRENGTH[kind], len(DRIVEN[kind]))
    exact = reference(robot(kind), LIVELY[kind], ONE_SECOND, commanded(kind, commands))
    coarse, fine = errors(robot(kind), commands, exact, (1e-3, 5e-4))
    # Rates of up to 20 rad/s change within some 30 ms: h^2 / (12 * 0.03^2) * 20 over 1 s.
    assert_second_order(coarse, fine, at_most=5e-4 * np.max(np.abs(exact.v)) / 5.0)


@pytest.mark.parametrize("kind", PARAMETERS)
def test_fresh_starts_and_commands_agree_with_the_equations(kind: str, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    initial = rng.normal(0.0, 0.5, len(LIVELY[kind]))
    t = np.linspace(0.0, 0.4, 51)
    commands = STRENGTH[kind] * rng.normal(size=(50, len(DRIVEN[kind])))
    exact = reference(robot(kind), initial, t, commanded(kind, commands))
    # At a jump of the command the rate in mid-step is predicted h/2 * jump too far: white commands are the worst case.
    assert distance(move(robot(kind), initial, t, commands, AnalyticSimulator(2e-4)), exact) < 5e-4


def smooth_wip(commands: np.ndarray, exact_lag: np.ndarray) -> Forces:
    """Viscous friction, drag, spring, ripple and lag, as `SMOOTH` has them."""

    def forces(row: int, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        settled = 1.0 - np.exp(-(time - ONE_SECOND[row]) / 0.02)
        drive = exact_lag[row] + settled * (commands[row, 0] - exact_lag[row])
        drive += 0.7 * np.cos(8.0 * q[0] / 0.0625 + 0.5)
        along = drive - 2.0 * v[0] - 0.8 * v[0] * abs(v[0]) - 12.0 * (q[0] - 0.05)
        return np.array([along, -0.05 * v[1] - 0.03 * v[1] * abs(v[1])])

    return forces


SMOOTH: Effects = {
    "translation/viscous": {"sigma": 2.0},
    "translation/quadratic_drag": {"c": 0.8},
    "pitch/viscous": {"sigma": 0.05},
    "pitch/quadratic_drag": {"c": 0.03},
    "environment/spring": {"k": 12.0, "x0": 0.05},
    "actuator/lag": {"tau": 0.02},
    "actuator/ripple": {"A": 0.7, "n": 8.0, "phase": 0.5},
}


def test_smooth_effects_together_converge_at_second_order():
    commands = sines(ONE_SECOND, 6.0)
    lagged = [commands[0, 0]]  # the actuator begins settled
    for k in range(len(commands) - 1):
        lagged.append(commands[k, 0] + (lagged[k] - commands[k, 0]) * np.exp(-0.008 / 0.02))
    exact = reference(robot("wip"), LIVELY["wip"], ONE_SECOND, smooth_wip(commands, np.array(lagged)))
    coarse, fine = errors(robot("wip", SMOOTH), commands, exact, (1e-3, 5e-4))
    # The ripple turns by n v/r = 100 rad/s: h^2/24 * 100^2 of its 0.7 N / 4 kg, the rest as without effects.
    assert_second_order(coarse, fine, at_most=5e-4)


def test_viscous_friction_decays_exponentially():
    t = np.linspace(0.0, 0.5, 101)
    for sigma in (0.5, 50.0):
        v = move(robot("linear_axis", {"translation/viscous": {"sigma": sigma}}), (0.0, 1.0), t).v[:, 0]
        rate = sigma / 2.5
        # Implicit in the mean rate: the exponent is off by the share (rate h)^2 / 12, and y exp(-y) < 0.37.
        np.testing.assert_allclose(v, np.exp(-rate * t), atol=0.37 * (rate * 1e-3) ** 2 / 12.0 + 1e-12)


def test_viscous_friction_is_stable_however_strong():
    v = move(robot("linear_axis", {"translation/viscous": {"sigma": 1e6}}), (0.0, 1.0), ONE_SECOND).v
    assert np.all(np.diff(np.abs(v[:, 0])) <= 0.0)


def test_positive_theta_moves_the_centre_of_mass_to_minus_x():
    # Without forces along the rail the centre of mass of the whole stays where it is.
    model = robot("wip", changes={"wheel_inertia": 0.0})
    p = model.parameters
    motion = move(model, (0.0, 0.1, 0.0, 0.0), ONE_SECOND, simulator=AnalyticSimulator(2e-4))
    total = p["body_mass"] + p["wheel_mass"]
    centre = motion.q[:, 0] - p["body_mass"] * p["com_height"] * np.sin(motion.q[:, 1]) / total
    assert motion.q[:, 1].max() > 1.0  # it fell to positive theta,
    assert motion.q[:, 0].max() > 0.1  # so the wheels ran to +x
    np.testing.assert_allclose(centre, centre[0], atol=1e-5)  # second order at 0.2 ms


def test_positive_command_drives_to_plus_x_and_leans_the_body_to_positive_theta():
    motion = move(robot("wip"), np.zeros(4), np.array([0.0, 0.01]), [1.0])
    assert motion.q[1, 0] > 0.0
    assert motion.q[1, 1] > 0.0


@pytest.mark.parametrize("kind", ["wip", "cartpole", "pendulum"])
def test_upright_is_an_unstable_and_hanging_a_stable_equilibrium(kind: str):
    start = np.zeros(len(LIVELY[kind]))
    pitch = len(start) // 2 - 1
    for rest, stable in ((0.0, False), (np.pi, True)):
        start[pitch] = rest + 1e-3
        away = np.abs(move(robot(kind), start, ONE_SECOND).q[:, -1] - rest)
        assert (np.max(away) < 1.01e-3) == stable


def test_double_pendulum_hangs_at_zero_and_counts_its_second_angle_from_link_1():
    motion = move(robot("double_pendulum"), np.zeros(4), ONE_SECOND)
    assert not motion.q.any()
    # A stretched arm (theta2 = 0) at 90 degrees holds m1 c1 + m2 (l1 + c2) against gravity.
    p = PARAMETERS["double_pendulum"]
    lower = p["link2_mass"] * p["link2_com"] * 9.81
    upper = (p["link1_mass"] * p["link1_com"] + p["link2_mass"] * p["link1_length"]) * 9.81
    held = move(robot("double_pendulum"), (np.pi / 2, 0.0, 0.0, 0.0), np.array([0.0, 0.05]), [[upper + lower, lower]])
    np.testing.assert_allclose(held.q[1], (np.pi / 2, 0.0), atol=1e-12)


def test_pendulum_alone_is_the_wip_with_wheels_too_heavy_to_move():
    heavy = robot("wip", changes={**PARAMETERS["pendulum"], "wheel_mass": 1e9})
    alone = move(robot("pendulum"), (1.0, 0.5), ONE_SECOND)
    wip = move(heavy, (0.0, 1.0, 0.0, 0.5), ONE_SECOND)
    np.testing.assert_allclose(wip.q[:, 1], alone.q[:, 0], atol=1e-7)  # the wheels yield by m_b / 1e9


def test_input_gain_scales_the_command():
    commands = sines(ONE_SECOND, 1.0)
    volts = move(robot("wip", changes={"input_gain": 3.0}), LIVELY["wip"], ONE_SECOND, commands)
    newtons = move(robot("wip"), LIVELY["wip"], ONE_SECOND, 3.0 * commands)
    np.testing.assert_allclose(volts.q, newtons.q, atol=1e-12)


def test_the_work_of_the_command_is_the_gain_of_energy():
    model = robot("wip")
    t = np.linspace(0.0, 1.0, 1001)
    commands = sines(t, 6.0)
    motion = move(model, LIVELY["wip"], t, commands)
    e = energy(model, motion)
    work = np.sum(commands[:, 0] * np.diff(motion.q[:, 0]))  # exact: each command is constant over its row
    assert e[-1] - e[0] == pytest.approx(
        work, abs=2e-3
    )  # breathing of the integrator at 1 ms, measured without command


def test_a_sagging_drive_gives_less_later_and_under_more_load():
    law = {"d": 0.04, "l": 0.1, "t_0": 0.2, "u_0": 0.5, "u_1": 3.0}
    for command in (2.0, -2.0, 0.5, 100.0):
        motion = move(unit_axis({"actuator/sag": law}), (0.0, 0.0), ONE_SECOND, np.full(125, command))
        middles = 0.5 * (ONE_SECOND[1:] + ONE_SECOND[:-1])
        lost = 0.04 * (np.minimum(middles, 0.4) - 0.2) + 0.1 * (min(abs(command), 3.0) / 0.5 - 1.0)
        np.testing.assert_allclose(
            row_forces(motion), command * (1.0 - lost), rtol=5e-5
        )  # time counts from a step's begin


def test_an_eccentric_encoder_errs_with_every_turn():
    law = {"s": 0.02, "c": -0.01, "n": 7.0}
    true = move(robot("pendulum"), LIVELY["pendulum"], ONE_SECOND)
    shown = move(robot("pendulum", {"sensor_theta/eccentricity": law}), LIVELY["pendulum"], ONE_SECOND)
    error = (0.02 * np.sin(7.0 * true.q) - 0.01 * np.cos(7.0 * true.q)) / 7.0
    np.testing.assert_allclose(shown.q, true.q + error, atol=1e-9)
    np.testing.assert_allclose(shown.v, true.v, atol=1e-12)
