"""Sensors: between the true state and the recorded column, and nowhere else."""

import numpy as np
import pytest
from sim.robots import LIVELY, move, robot, sines

from wipx.sim.analytic import AnalyticSimulator

T = np.linspace(0.0, 1.0, 201)  # rows of 5 ms
COMMANDS = sines(T, 6.0)
BARE = move(robot("wip"), LIVELY["wip"], T, COMMANDS)


@pytest.mark.parametrize(
    ("effects", "column", "scale", "bias"),
    [
        ({"sensor_theta/bias": {"b": 0.03}}, 1, 1.0, 0.03),
        ({"sensor_theta/scale": {"e": -0.1}}, 1, 0.9, 0.0),
        ({"sensor_x/scale": {"e": 0.2}}, 0, 1.2, 0.0),
    ],
)
def test_scale_and_bias_change_their_own_column_only(effects, column: int, scale: float, bias: float):
    shown = move(robot("wip", effects), LIVELY["wip"], T, COMMANDS)
    np.testing.assert_allclose(shown.q[:, column], scale * BARE.q[:, column] + bias, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(shown.q[:, 1 - column], BARE.q[:, 1 - column])
    np.testing.assert_array_equal(shown.v, BARE.v)


def test_a_bias_is_added_after_the_scale():
    shown = move(
        robot("wip", {"sensor_theta/scale": {"e": 0.5}, "sensor_theta/bias": {"b": 0.1}}), LIVELY["wip"], T, COMMANDS
    )
    np.testing.assert_allclose(shown.q[:, 1], 1.5 * BARE.q[:, 1] + 0.1, atol=1e-14)


@pytest.mark.parametrize("column", [0, 1])
def test_a_sensor_delay_shows_the_coordinate_of_earlier_rows(column: int):
    name = ("sensor_x/delay", "sensor_theta/delay")[column]
    shown = move(robot("wip", {name: {"tau": 0.015}}), LIVELY["wip"], T, COMMANDS)
    np.testing.assert_allclose(shown.q[3:, column], BARE.q[:-3, column], atol=1e-9)  # slope * round-off of times
    before = BARE.q[0, column] + BARE.v[0, column] * (T[:3] - 0.015)  # the start: at a steady rate
    np.testing.assert_allclose(shown.q[:3, column], before, atol=1e-12)
    np.testing.assert_array_equal(shown.q[:, 1 - column], BARE.q[:, 1 - column])
    np.testing.assert_array_equal(shown.v, BARE.v)


def test_a_sensor_delay_by_a_fraction_of_a_row_shows_the_state_in_between():
    # A grid four times as fine, of the same steps, has rows at the moments in between.
    steps, fine = AnalyticSimulator(6.25e-4), np.linspace(0.0, 1.0, 801)
    exact = move(robot("wip"), LIVELY["wip"], fine, np.repeat(COMMANDS, 4, axis=0), steps)
    shown = move(robot("wip", {"sensor_theta/delay": {"tau": 0.00875}}), LIVELY["wip"], T, COMMANDS, steps)
    # Cubic between rows of 5 ms: h^4 / 384 of a fourth derivative of 1e4 rad/s^4.
    np.testing.assert_allclose(shown.q[2:, 1], exact.q[1:-7:4, 1], atol=5e-8)


def test_equal_delays_of_both_sensors_are_an_actuator_delay_seen_later():
    # Contract section 3: from rest they cannot be told apart.
    tau, rest = 0.02, np.zeros(4)
    commands = COMMANDS.copy()
    commands[:1] = 0.0
    sensors = move(
        robot("wip", {"sensor_x/delay": {"tau": tau}, "sensor_theta/delay": {"tau": tau}}), rest, T, commands
    )
    actuator = move(robot("wip", {"actuator/delay": {"tau": tau}}), rest, T, commands)
    np.testing.assert_allclose(sensors.q, actuator.q, atol=1e-9)


@pytest.mark.parametrize("angle", [0.05, -0.2])
def test_a_centre_of_mass_off_the_axis_is_a_biased_angle_sensor(angle: float):
    off_axis = move(
        robot("wip", {"geometry/com_offset": {"theta_eq": angle}}), (0.0, 0.1 + angle, 0.3, 0.0), T, COMMANDS
    )
    biased = move(robot("wip", {"sensor_theta/bias": {"b": angle}}), (0.0, 0.1, 0.3, 0.0), T, COMMANDS)
    np.testing.assert_allclose(off_axis.q, biased.q, atol=1e-11)  # round-off, grown by the fall
    np.testing.assert_allclose(off_axis.v, biased.v, atol=1e-11)


def test_each_angle_of_a_double_pendulum_has_its_sensor():
    t = np.linspace(0.0, 0.3, 61)
    bare = move(robot("double_pendulum"), LIVELY["double_pendulum"], t)
    shown = move(
        robot("double_pendulum", {"sensor_theta1/bias": {"b": 0.1}, "sensor_theta2/scale": {"e": 0.1}}),
        LIVELY["double_pendulum"],
        t,
    )
    np.testing.assert_allclose(shown.q, bare.q * [1.0, 1.1] + [0.1, 0.0], atol=1e-14)
