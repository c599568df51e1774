"""Model predictive control: the regulator where no limit acts, and within limits elsewhere."""

import numpy as np
import pytest
from balancing import heavy_robot, loaded, release
from sim.robots import robot

from wipx.control.lqr import Lqr
from wipx.control.plan import Plan, growing_intervals
from wipx.control.predictive import Mpc, Programme
from wipx.core.errors import InputError


def test_without_active_limits_it_is_the_regulator():
    model = heavy_robot()
    # The regulator's gains are those of a command that changes continuously; 1/650 s are 1.5 % of the fastest pole.
    np.testing.assert_allclose(Mpc().law(model).gains, Lqr().law(model).gains, rtol=0.015)
    loop = Mpc().loop(model)
    release(loop, model, 0.5, (0.0, 0.02, 0.0, 0.0))
    assert loop.solve_times == []


def test_it_keeps_its_limits_of_force_and_rail(fresh_seed: int):
    x = np.random.default_rng(fresh_seed).choice([-1.0, 1.0]) * 0.5
    model = heavy_robot({})
    limited = Mpc(limit=4.0, rail=0.55).loop(model)
    run = release(limited, model, 6.0, (x, 0.0, 0.0, 0.0))
    free = release(Lqr().loop(model), model, 6.0, (x, 0.0, 0.0, 0.0))
    assert np.max(np.abs(free.commands)) > 4.0
    assert np.max(np.abs(run.commands)) <= 4.0
    assert np.max(np.abs(run.states[:, 0])) < 0.56  # soft
    assert abs(run.states[-1, 0]) < 0.05
    assert len(limited.solve_times) > 0


def test_the_rail_holds_it_where_the_regulator_runs_beyond():
    model = heavy_robot({})
    start = (0.0, 0.0, -0.8, 0.0)
    free = release(Lqr().loop(model), model, 4.0, start)
    reach = 0.9 * np.max(np.abs(free.states[:, 0]))
    run = release(Mpc(rail=reach).loop(model), model, 4.0, start)
    assert np.max(np.abs(run.states[:, 0])) < reach + 0.01


def test_the_programme_finds_the_constrained_optimum(fresh_seed: int):
    # One bound, on the first command, that is active: the optimum is the projection onto it.
    rng = np.random.default_rng(fresh_seed)
    model = heavy_robot()
    plan: Plan = Mpc().plan(model)
    count = len(plan.weights)
    bounds = np.full(3 * count, 1e3)
    free = np.zeros(3 * count)
    free[0] = 1e3 + rng.uniform(1.0, 5.0)
    move, solved = Programme(plan, bounds).first_move(free)
    assert solved
    assert move == pytest.approx(1e3 - free[0], abs=1e-2)


def test_offset_free_it_leaves_no_standing_error():
    model = heavy_robot()
    body = loaded(model, -0.06)
    assert abs(release(Mpc(offset_free=0.5).loop(model), body, 7.0).states[-1, 0]) < 0.02
    assert abs(release(Mpc().loop(model), body, 4.0).states[-1, 0]) > 0.3


def test_intervals_grow_from_one_period_to_the_horizon():
    intervals = growing_intervals(1.0 / 650.0, 1.5, 20)
    assert intervals[0] == pytest.approx(1.0 / 650.0)
    assert np.sum(intervals) == pytest.approx(1.5)
    assert np.all(np.diff(intervals) > 0.0)


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match="moves is 1"):
        Mpc(moves=1)
    with pytest.raises(InputError, match=r"horizon is 0\.01 s"):
        Mpc(horizon=0.01)
    with pytest.raises(InputError, match="got a double_pendulum"):
        Mpc().loop(robot("double_pendulum"))
