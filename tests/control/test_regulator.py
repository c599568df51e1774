"""The regulator: the linear quadratic regulator's gains on an estimated state."""

import numpy as np
import pytest
from sim.robots import robot

from wipx.control.lqr import Lqr
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

LOOP = Inputs.regular(3.0, 650.0, 1)
TILTED = np.array([0.0, 0.05, 0.0, 0.0])


def test_commands_are_the_gains_on_the_estimate_within_the_limit():
    controller = Lqr(limit=3.0)
    loop = controller.loop(robot("wip"))
    assert loop.rate == controller.rate
    loop.reset(0.0, np.zeros(4))
    reference = np.array([0.01, 0.0, 0.0, 0.0])
    commands = loop.step(0.0, np.zeros(4), reference)
    np.testing.assert_allclose(commands, controller.feedback(robot("wip")).gains @ reference, rtol=1e-12)
    loop.reset(0.0, TILTED)
    np.testing.assert_allclose(loop.step(0.0, TILTED, np.zeros(4)), [-3.0])


def test_it_balances_a_robot_whose_rates_nobody_measures():
    model = robot("wip", {"translation/viscous": {"sigma": 0.5}, "actuator/delay": {"tau": 0.003}})
    loop = Lqr().loop(model)
    loop.reset(0.0, TILTED)

    def controller(t: float, measured: np.ndarray) -> np.ndarray:
        return loop.step(t, np.array([measured[0], measured[1], np.nan, np.nan]), np.zeros(4))

    run = AnalyticSimulator().drive(model, LOOP, TILTED, controller)
    assert np.max(np.abs(run.coordinates[:, 1])) < 0.06
    np.testing.assert_allclose(run.coordinates[-1, :, 0, 0], 0.0, atol=0.02)  # the slowest pole decays by exp(-3)


def test_a_reset_forgets_the_past():
    loop = Lqr().loop(robot("wip"))

    def first_steps() -> list[float]:
        loop.reset(0.0, TILTED)
        return [float(loop.step(k / 650.0, TILTED, np.zeros(4))[0]) for k in range(5)]

    assert first_steps() == first_steps()


@pytest.mark.parametrize("kind", ["cartpole", "pendulum", "double_pendulum"])
def test_other_plants_have_loops_too(kind: str):
    model = robot(kind)
    loop = Lqr().loop(model)
    rest = np.zeros(2 * len(model.plant.joints))
    loop.reset(0.0, rest)
    assert loop.step(0.0, rest, rest).shape == (len(model.plant.commands),)
