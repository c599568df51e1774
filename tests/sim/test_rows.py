"""Rows of the log: uneven, missing, slower than the loop; and windows of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim.robots import LIVELY, move, robot, sines

from wipx.core.model import ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import AFTER_THE_END, Inputs

FRICTION = {"translation/coulomb": {"F_c": 1.0}, "actuator/delay": {"tau": 0.008}, "pitch/viscous": {"sigma": 0.02}}


def test_the_steps_of_the_integrator_do_not_depend_on_the_rate_of_the_log():
    model = robot("wip", FRICTION)
    fast, slow = np.linspace(0.0, 0.8, 801), np.linspace(0.0, 0.8, 201)
    commands = sines(slow, 6.0)
    every = move(model, LIVELY["wip"], fast, np.repeat(commands, 4, axis=0))
    fourth = move(model, LIVELY["wip"], slow, commands)
    np.testing.assert_allclose(fourth.q, every.q[::4], atol=1e-11)  # round-off of times


def test_half_the_rows_with_the_mean_command_agree():
    t = np.linspace(0.0, 0.8, 401)
    commands = sines(t, 6.0)
    mean = commands.reshape(-1, 2).mean(axis=1)
    # The impulse of 4 ms is the same; its two halves differ by up to 0.2 N: 2e-7 m at 2.5 kg in each of 200 rows,
    # on a wip grown by the fall.
    for kind, atol in (("linear_axis", 4e-5), ("wip", 2e-4)):
        rest = np.zeros(len(LIVELY[kind]))
        all_rows = move(robot(kind), rest, t, commands)
        half = move(robot(kind), rest, t[::2], mean)
        np.testing.assert_allclose(half.q, all_rows.q[::2], atol=atol)


def test_missing_rows_change_nothing_where_the_command_is_held():
    model = robot("wip", FRICTION)
    t = np.linspace(0.0, 0.8, 401)
    commands = np.repeat(sines(t[::5], 6.0), 5, axis=0)
    kept = np.sort(np.unique(np.concatenate([np.arange(0, 401, 5), np.random.default_rng(4).integers(0, 401, 150)])))
    whole = move(model, LIVELY["wip"], t, commands)
    holed = move(model, LIVELY["wip"], t[kept], commands[kept[:-1]])
    np.testing.assert_allclose(holed.q, whole.q[kept], atol=1e-11)  # round-off of times


def test_uneven_rows_are_cut_into_equal_steps_of_at_most_the_longest():
    inputs = Inputs.of([np.array([0.0, 0.0005, 0.0015, 0.0050, 0.0060000000001])], [np.zeros((5, 1))], [0])
    assert inputs.substeps(1e-3)[:, 0].tolist() == [1, 1, 4, 1]  # 3.5 ms in four; a billionth over is no step more


@given(lengths=st.lists(st.integers(2, 9), min_size=1, max_size=5), first=st.integers(0, 1))
def test_windows_are_padded_at_their_end_and_cost_no_steps_there(lengths: list[int], first: int):
    times = [np.arange(n) * 1e-3 for n in lengths]
    commands = [np.full((n, 1), float(n)) for n in lengths]
    inputs = Inputs.of(times, commands, [first] * len(lengths))
    assert inputs.windows == len(lengths)
    assert inputs.t.shape == (max(lengths), len(lengths))
    np.testing.assert_array_equal(inputs.last, np.array(lengths) - 1)
    np.testing.assert_array_equal(inputs.substeps(1e-3).sum(axis=0), np.array(lengths) - 1 - first)
    for r, n in enumerate(lengths):
        assert np.all(inputs.t[n:, r] == AFTER_THE_END)
        assert np.all(inputs.commands[:, 0, r] == n)


def test_a_short_window_beside_a_long_one_rests_at_its_end():
    model = robot("wip", FRICTION)
    short, long = np.linspace(0.0, 0.2, 51), np.linspace(0.0, 0.8, 161)
    inputs = Inputs.of([short, long], [np.ones((51, 1)), np.ones((161, 1))], [0, 0])
    initial = np.tile(np.array(LIVELY["wip"])[:, None, None], (1, 1, 2))
    run = AnalyticSimulator().replay(ModelBatch(model), inputs, initial)
    alone = move(model, LIVELY["wip"], short, np.ones(50))
    np.testing.assert_array_equal(run.coordinates[:51, :, 0, 0], alone.q)
    np.testing.assert_array_equal(run.coordinates[51:, :, 0, 0], np.tile(alone.q[-1], (110, 1)))


def test_rows_before_the_first_are_remembered_for_delays_and_not_integrated():
    model = robot("wip", {"actuator/delay": {"tau": 0.01}})
    t = np.linspace(0.0, 0.4, 201)
    commands = sines(t, 6.0)
    whole = move(model, (0.0, 0.05, 0.0, 0.0), t, commands)
    held = np.vstack([commands, commands[-1:]])[40:]
    inputs = Inputs.of([t[40:]], [held], [10])
    start = np.array([*whole.q[50], *whole.v[50]])[:, None, None]
    later = AnalyticSimulator().replay(ModelBatch(model), inputs, start)
    np.testing.assert_array_equal(later.coordinates[:11, :, 0, 0], np.tile(whole.q[50], (11, 1)))
    # The restart forgets the acceleration that predicts the rate in its first mid-step.
    np.testing.assert_allclose(later.coordinates[10:, :, 0, 0], whole.q[50:], atol=1e-5)


def test_windows_can_be_cut():
    inputs = Inputs.regular(0.1, 100.0, 1, windows=3)
    cut = inputs.until(np.array([4, 7, 20]))
    np.testing.assert_array_equal(cut.last, [4, 7, 10])
    assert len(Inputs.regular(0.1, 100.0, 1).until(np.array([4])).t) == 5


@pytest.mark.parametrize("step", [1e-3, 2e-4])
def test_a_split_run_goes_on_where_it_stopped(step: float):
    # A Python controller drives the same code row by row: states carry everything a rollout needs.
    model = robot(
        "wip", {**FRICTION, "actuator/lag": {"tau": 0.01}, "pitch/presliding": {"F_c": 0.1, "stiffness": 100.0}}
    )
    t = np.linspace(0.0, 0.3, 61)
    commands = sines(t, 6.0)
    whole = move(model, LIVELY["wip"], t, commands, AnalyticSimulator(step))
    rows = iter(commands)
    inputs = Inputs.of([t], [np.zeros((61, 1))], [0])
    driven = AnalyticSimulator(step).drive(model, inputs, np.array(LIVELY["wip"]), lambda time, measured: next(rows))
    np.testing.assert_array_equal(driven.coordinates[:, :, 0, 0], whole.q)
