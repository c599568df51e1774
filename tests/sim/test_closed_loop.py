"""The loop: state feedback in compiled code, and any Python controller around the same physics."""

from dataclasses import replace

import numpy as np
import pytest
from sim.robots import robot

from wipx.control.lqr import Lqr
from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts, StateFeedback

LOOP = Inputs.regular(4.0, 500.0, 1)
ROWS = len(LOOP.t) - 1
SHORT = Inputs.regular(0.4, 500.0, 1)
TILTED = np.array([0.0, 0.08, 0.0, 0.0])
REAL = {
    "translation/stribeck": {"F_c": 0.5, "F_s": 0.8, "v_s": 0.05},
    "pitch/viscous": {"sigma": 0.02},
    "actuator/delay": {"tau": 0.006},
    "actuator/lag": {"tau": 0.003},
    "sensor_theta/delay": {"tau": 0.004},
}


def loop(
    model: Model, feedback: StateFeedback, inputs: Inputs = LOOP, references: np.ndarray | None = None
) -> Rollouts:
    rows = len(inputs.t) - 1
    still = np.zeros((rows, 4, 1))
    return AnalyticSimulator().close_loop(
        ModelBatch(model), inputs, TILTED[:, None, None], feedback, still if references is None else references
    )


@pytest.fixture(scope="module")
def feedback() -> StateFeedback:
    return Lqr().feedback(robot("wip"))


def test_an_lqr_balances_a_tilted_wip(feedback: StateFeedback):
    run = loop(robot("wip"), feedback)
    assert np.max(np.abs(run.coordinates[:, 1])) < 0.1
    np.testing.assert_allclose(run.coordinates[-1], 0.0, atol=5e-3)  # the slowest pole decays by exp(-4)


def test_an_lqr_with_filtered_differences_balances_the_real_robot_too():
    run = loop(robot("wip", REAL), replace(Lqr().feedback(robot("wip")), rate_filter=0.005))
    assert np.max(np.abs(run.coordinates[:, 1])) < 0.2


@pytest.mark.parametrize("effects", [{}, REAL], ids=["bare", "real"])
def test_a_python_controller_gives_the_same_loop_as_the_compiled_one(effects, feedback: StateFeedback):
    model = robot("wip", effects)
    compiled = loop(model, feedback, SHORT)
    driven = AnalyticSimulator().drive(model, SHORT, TILTED, lambda time, measured: -feedback.gains @ measured)
    # The order in which the four products are added.
    np.testing.assert_allclose(driven.coordinates, compiled.coordinates, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(driven.rates, compiled.rates, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(driven.commands, compiled.commands, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("effects", [{}, REAL], ids=["bare", "real"])
def test_a_replay_of_the_loops_commands_is_the_loop(effects, feedback: StateFeedback):
    model = robot("wip", effects)
    run = loop(model, feedback)
    inputs = Inputs(LOOP.t, run.commands[:, :, 0, :], LOOP.first, LOOP.last)
    replayed = AnalyticSimulator().replay(ModelBatch(model), inputs, TILTED[:, None, None])
    np.testing.assert_array_equal(replayed.coordinates, run.coordinates)


def test_commands_are_the_feedback_of_what_the_sensors_show(feedback: StateFeedback):
    run = loop(robot("wip", {"sensor_theta/bias": {"b": 0.02}}), feedback)
    shown = np.concatenate([run.coordinates, run.rates], axis=1)[:-1, :, 0, 0]
    np.testing.assert_allclose(run.commands[:, 0, 0, 0], -(shown @ feedback.gains[0]), atol=1e-12)


def test_commands_stay_within_the_limit(feedback: StateFeedback):
    limited = StateFeedback(feedback.gains, limit=4.0)
    run = loop(robot("wip"), limited)
    assert np.max(np.abs(run.commands)) == 4.0
    assert np.max(np.abs(loop(robot("wip"), feedback).commands)) > 4.0


def test_the_loop_follows_its_reference(feedback: StateFeedback):
    references = np.zeros((ROWS, 4, 1))
    references[:, 0] = 0.3
    run = loop(robot("wip"), feedback, references=references)
    assert run.coordinates[-1, 0, 0, 0] == pytest.approx(0.3, abs=0.02)  # the slowest pole decays by exp(-4)


def test_noise_enters_the_command_and_not_the_recorded_column(feedback: StateFeedback):
    noise = np.zeros((len(SHORT.t) - 1, 4, 1, 1))
    noise[0, 1] = 0.01
    quiet = loop(robot("wip"), feedback, SHORT)
    noisy = AnalyticSimulator().close_loop(
        ModelBatch(robot("wip")), SHORT, TILTED[:, None, None], feedback, np.zeros((len(SHORT.t) - 1, 4, 1)), noise
    )
    assert noisy.commands[0, 0, 0, 0] - quiet.commands[0, 0, 0, 0] == pytest.approx(-feedback.gains[0, 1] * 0.01)
    np.testing.assert_array_equal(noisy.coordinates[0], quiet.coordinates[0])


def test_filtered_rates_are_a_low_pass_on_differences():
    time_constant, dt = 0.005, 1.0 / 500.0
    rates_only = StateFeedback(np.array([[0.0, 0.0, 1.0, 2.0]]), rate_filter=time_constant)
    run = loop(robot("wip"), rates_only, SHORT)
    shown = run.coordinates[:, :, 0, 0]
    rate, expected = np.zeros(2), [0.0]
    for k in range(1, len(shown) - 1):
        rate = rate + dt / (dt + time_constant) * ((shown[k] - shown[k - 1]) / dt - rate)
        expected.append(-(rate[0] + 2.0 * rate[1]))
    np.testing.assert_allclose(run.commands[:, 0, 0, 0], expected, atol=1e-9)  # round-off of differences over 2 ms


def test_both_commands_of_a_double_pendulum_are_fed_back():
    gains = np.array([[8.0, 1.0, 2.0, 0.3], [0.5, 5.0, 0.2, 1.0]])
    inputs = Inputs.regular(0.2, 500.0, 2)
    initial = np.array([0.3, -0.2, 0.0, 0.0])[:, None, None]
    run = AnalyticSimulator().close_loop(
        ModelBatch(robot("double_pendulum")), inputs, initial, StateFeedback(gains), np.zeros((100, 4, 1))
    )
    shown = np.concatenate([run.coordinates, run.rates], axis=1)[:-1, :, 0, 0]
    np.testing.assert_allclose(run.commands[:, :, 0, 0], -(shown @ gains.T), atol=1e-12)
    assert run.commands.shape == (100, 2, 1, 1)


def test_a_pendulum_is_held_upright_by_its_own_torque():
    feedback = Lqr(coordinates=(100.0,), rates=(5.0,)).feedback(robot("pendulum"))
    inputs = Inputs.regular(3.0, 500.0, 1)
    run = AnalyticSimulator().close_loop(
        ModelBatch(robot("pendulum")), inputs, np.array([0.3, 0.0])[:, None, None], feedback, np.zeros((1500, 2, 1))
    )
    assert abs(run.coordinates[-1, 0, 0, 0]) < 1e-3
