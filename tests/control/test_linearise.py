"""Linear models against the paper's equations, linearised by hand."""

import numpy as np
import pytest
from sim.robots import inner_forces, mass_matrix, robot

from wipx.control.linearise import linearise


@pytest.mark.parametrize("kind", ["wip", "cartpole"])
def test_a_and_b_are_those_of_the_linearised_equations(kind: str):
    p = robot(kind).parameters
    rolling = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    arm = p["body_mass"] * p["com_height"]
    turning = arm * p["com_height"] + p["body_inertia"]
    # M q'' = [u, arm g theta] with M = [[rolling, -arm], [-arm, turning]]
    determinant = rolling * turning - arm**2
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2, 1] = arm**2 * p["gravity"] / determinant
    a[3, 1] = rolling * arm * p["gravity"] / determinant
    b = np.array([[0.0], [0.0], [turning / determinant], [arm / determinant]])
    linear = linearise(robot(kind))
    # Differences over 1e-4 of a simulated step of 10 us: (1e-4)^2 of the value, and step/2 of the coupling to rates.
    np.testing.assert_allclose(linear.a, a, rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(linear.b, b, rtol=1e-5, atol=1e-6)


def test_a_pendulum_falls_at_its_own_rate():
    p = robot("pendulum").parameters
    turning = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    linear = linearise(robot("pendulum"))
    stiffness = p["body_mass"] * p["gravity"] * p["com_height"] / turning
    np.testing.assert_allclose(linear.a, [[0.0, 1.0], [stiffness, 0.0]], rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(linear.b, [[0.0], [1.0 / turning]], rtol=1e-6)


def test_a_double_pendulum_hangs_with_two_inputs():
    model = robot("double_pendulum")
    mass = mass_matrix(model, np.zeros(2))
    slope = np.column_stack(
        [(inner_forces(model, d, np.zeros(2)) - inner_forces(model, -d, np.zeros(2))) / 2e-5 for d in 1e-5 * np.eye(2)]
    )
    linear = linearise(model)
    np.testing.assert_allclose(linear.a[2:, :2], np.linalg.solve(mass, slope), rtol=1e-5)
    np.testing.assert_allclose(linear.b[2:], np.linalg.inv(mass), rtol=1e-5)


def test_effects_are_left_out():
    rough = robot(
        "wip", {"translation/coulomb": {"F_c": 5.0}, "actuator/delay": {"tau": 0.02}, "pitch/viscous": {"sigma": 1.0}}
    )
    np.testing.assert_array_equal(linearise(rough).a, linearise(robot("wip")).a)


def test_input_gain_is_part_of_b():
    volts = linearise(robot("wip", changes={"input_gain": 3.0}))
    np.testing.assert_allclose(volts.b, 3.0 * linearise(robot("wip")).b, rtol=1e-6)
