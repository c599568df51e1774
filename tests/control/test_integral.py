"""Integral action removes the standing error that a load leaves."""

import numpy as np
import pytest
from balancing import heavy_robot, loaded, release
from sim.robots import robot

from wipx.control.integral import Lqi
from wipx.control.linearise import linearise
from wipx.control.lqr import Lqr
from wipx.core.errors import InputError


def test_the_integral_removes_the_standing_error_of_a_load(fresh_seed: int):
    model = heavy_robot()
    body = loaded(model, np.random.default_rng(fresh_seed).choice([-1.0, 1.0]) * 0.06)
    assert abs(release(Lqi().loop(model), body, 9.0).states[-1, 0]) < 0.02
    assert abs(release(Lqr().loop(model), body, 4.0).states[-1, 0]) > 0.3


@pytest.mark.parametrize("kind", ["wip", "pendulum", "linear_axis", "double_pendulum"])
def test_the_augmented_plant_is_stable(kind: str):
    linear, law = linearise(robot(kind)), Lqi().law(robot(kind))
    memories = len(law.intake)
    closed = np.block(
        [[linear.a - linear.b @ law.gains, -linear.b @ law.memory_gains], [law.intake, np.zeros((memories, memories))]]
    )
    assert np.max(np.linalg.eigvals(closed).real) < 0.0


def test_the_integral_does_not_wind_up():
    loop = Lqi(integral_limit=3.0).loop(heavy_robot())
    loop.reset(0.0, np.array([1.0, 0.0, 0.0, 0.0]))
    for k in range(3000):
        loop.step(k / 650.0, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(4))
    assert np.abs(loop.law.memory_gains @ loop.memory) == pytest.approx(3.0)
    loop.reset(0.0, np.zeros(4))
    assert loop.memory == pytest.approx(0.0)


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match="integral is 0"):
        Lqi(integral=0.0)
