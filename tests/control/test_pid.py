"""The cascaded PID: its rule places poles, and its integral takes up a load."""

import numpy as np
import pytest
from balancing import heavy_robot, loaded, release
from sim.robots import robot

from wipx.control.linearise import linearise
from wipx.control.pid import Pid
from wipx.core.errors import InputError


def test_the_rule_places_the_poles():
    model = heavy_robot()
    linear, law = linearise(model), Pid(pitch_bandwidth=1.2, position_bandwidth=0.2).law(model)
    closed = np.block([[linear.a - linear.b @ law.gains, -linear.b @ law.memory_gains], [law.intake, np.zeros((1, 1))]])
    p = model.parameters
    arm = p["body_mass"] * p["com_height"]
    zero = np.sqrt(arm * p["gravity"] / (arm * p["com_height"] + p["body_inertia"]))
    expected = np.poly(np.repeat([-1.2 * np.sqrt(linear.a[3, 1]), -0.2 * zero], [2, 3]))
    # Multiple poles are ill-conditioned; their polynomial is not.
    np.testing.assert_allclose(np.poly(closed), expected, rtol=1e-3)


def test_it_brings_a_loaded_robot_back():
    model = heavy_robot()
    run = release(Pid().loop(model), loaded(model, 0.06), 10.0)
    assert abs(run.states[-1, 0]) < 0.02


def test_position_asks_for_no_more_than_its_lean():
    loop = Pid(lean=0.05).loop(heavy_robot())
    far = np.array([50.0, 0.0, 0.0, 0.0])
    loop.reset(0.0, far)
    commands = loop.step(0.0, far, np.zeros(4))
    np.testing.assert_allclose(commands, loop.gains.pitch[0] * 0.05, rtol=1e-9)
    for k in range(1, 2000):
        loop.step(k / 650.0, far, np.zeros(4))
    assert loop.gains.position[1] * loop.integral == pytest.approx(0.05)


def test_other_plants_are_refused():
    with pytest.raises(InputError, match="got a linear_axis"):
        Pid().loop(robot("linear_axis"))
