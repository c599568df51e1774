"""The linear quadratic regulator stabilises what it was designed for."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are
from sim.robots import robot

from wipx.control.linearise import linearise
from wipx.control.lqr import Lqr
from wipx.core.errors import InputError


@pytest.mark.parametrize("kind", ["wip", "cartpole", "pendulum", "double_pendulum"])
def test_the_closed_loop_is_stable(kind: str):
    linear = linearise(robot(kind))
    feedback = Lqr().feedback(robot(kind))
    assert np.max(np.linalg.eigvals(linear.a - linear.b @ feedback.gains).real) < 0.0


def test_gains_solve_the_riccati_equation():
    linear = linearise(robot("wip"))
    weights = np.diag([20.0, 100.0, 2.0, 5.0])
    cost = solve_continuous_are(linear.a, linear.b, weights, 0.2 * np.eye(1))
    expected = linear.b.T @ cost / 0.2
    np.testing.assert_allclose(Lqr().feedback(robot("wip")).gains, expected, rtol=1e-6)


def test_settings_reach_the_feedback():
    feedback = Lqr(limit=7.0).feedback(robot("wip"))
    assert feedback.rate_filter is None
    assert feedback.limit == 7.0
    assert feedback.gains.shape == (1, 4)


def test_a_dearer_command_gives_smaller_first_commands():
    cheap = Lqr(command=0.2).feedback(robot("wip")).gains
    dear = Lqr(command=20.0).feedback(robot("wip")).gains
    assert abs(dear[0, 1]) < abs(cheap[0, 1])


def test_too_few_weights_are_refused_in_one_line():
    with pytest.raises(InputError, match="weights for 2 joints are needed"):
        Lqr(coordinates=(1.0,), rates=(1.0,)).feedback(robot("wip"))


def test_weights_that_leave_the_position_adrift_are_refused():
    with pytest.raises(InputError, match="controller: "):
        Lqr(coordinates=(0.0, 0.0), rates=(0.0, 0.0)).feedback(robot("linear_axis"))
