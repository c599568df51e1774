"""A rollout is the same alone and among thousands of others."""

import numpy as np
import pytest
from sim.robots import Effects, robot

from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts, StateFeedback

EVERYTHING: Effects = {
    "translation/viscous": {"sigma": 1.0},
    "translation/quadratic_drag": {"c": 0.5},
    "translation/stribeck": {"F_c": 1.0, "F_s": 1.5, "v_s": 0.05},
    "translation/sticky_spot": {"F_c": 0.5, "lo": 0.02, "hi": 0.1},
    "translation/load_friction": {"K_motor": 0.05, "K_external": 0.05},
    "translation/rotor_inertia": {"J": 0.1},
    "pitch/lugre": {"F_c": 0.05, "F_s": 0.08, "v_s": 0.1, "stiffness": 300.0, "damping": 0.1},
    "actuator/delay": {"tau": 0.007},
    "actuator/offset": {"F_0": 0.1},
    "actuator/dead_zone": {"band": 0.2},
    "actuator/gain": {"k": 1.1},
    "actuator/saturation": {"F_max": 9.0},
    "actuator/speed_limit": {"F_stall": 8.0, "v_free": 5.0},
    "actuator/back_emf": {"k_e": 0.5},
    "actuator/lag": {"tau": 0.004},
    "actuator/ripple": {"A": 0.3, "n": 6.0, "phase": 0.2},
    "actuator/backlash": {"gap": 1e-3, "drive_inertia": 0.2, "drive_damping": 0.0},
    "geometry/payload": {"mass": 0.1, "height": 0.4},
    "geometry/payload_event": {"mass": 0.2, "height": 0.5, "t0": 0.1},
    "geometry/com_offset": {"theta_eq": 0.01},
    "geometry/inertia": {"scale": 1.1},
    "environment/rail_tilt": {"angle": 0.02},
    "environment/spring": {"k": 5.0, "x0": 0.1},
    "sensor_theta/bias": {"b": 0.01},
    "sensor_theta/scale": {"e": 0.02},
    "sensor_theta/delay": {"tau": 0.006},
    "sensor_x/delay": {"tau": 0.003},
}
PAPER: Effects = {
    f"{site}/lagged_stribeck": {"F_s": 0.5, "F_c": 0.3, "v_s": 0.1, "sigma": 0.1, "epsilon": 1e-3, "alpha": 0.4}
    for site in ("translation", "pitch")
}
VARIED = ("body_mass", "com_height")


def batch_of(model: Model, size: int, rng: np.random.Generator) -> ModelBatch:
    return ModelBatch(model, VARIED, np.column_stack([rng.uniform(2.0, 3.0, size), rng.uniform(0.3, 0.4, size)]))


def uneven_windows(count: int, rng: np.random.Generator) -> tuple[list[np.ndarray], list[np.ndarray], list[int]]:
    """Windows of different lengths, time steps and histories."""
    lengths = rng.integers(30, 60, count)
    times = [np.cumsum(rng.uniform(1e-3, 8e-3, n)) for n in lengths]
    commands = [rng.normal(0.0, 5.0, (n, 1)) for n in lengths]
    return times, commands, [int(k) for k in rng.integers(0, 5, count)]


def assert_equal(a: Rollouts, b: Rollouts, rows: int | None = None) -> None:
    np.testing.assert_array_equal(a.coordinates[:rows], b.coordinates[:rows])
    np.testing.assert_array_equal(a.rates[:rows], b.rates[:rows])


@pytest.mark.parametrize("effects", [{}, EVERYTHING, PAPER], ids=["bare", "everything", "paper"])
def test_a_rollout_does_not_depend_on_its_neighbours(effects: Effects, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    model, simulator = robot("wip", effects), AnalyticSimulator()
    batch = batch_of(model, 23, rng)
    assert batch.values is not None
    times, commands, first = uneven_windows(7, rng)
    initial = rng.normal(0.0, 0.1, (4, 23, 7))
    together = simulator.replay(batch, Inputs.of(times, commands, first), initial)
    for p, r in ((0, 0), (22, 6), (11, 3), (5, 1), (17, 5)):
        alone = simulator.replay(
            ModelBatch(model, VARIED, batch.values[p : p + 1]),
            Inputs.of([times[r]], [commands[r]], [first[r]]),
            initial[:, p : p + 1, r : r + 1],
        )
        rows = len(times[r])
        np.testing.assert_array_equal(together.coordinates[:rows, :, p, r], alone.coordinates[:, :, 0, 0])
        np.testing.assert_array_equal(together.rates[:rows, :, p, r], alone.rates[:, :, 0, 0])
        assert np.isfinite(alone.coordinates).all()


def test_a_rollout_does_not_depend_on_its_place_in_the_batch(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    model = robot("wip", EVERYTHING)
    batch = batch_of(model, 70, rng)
    assert batch.values is not None
    inputs = Inputs.of(*uneven_windows(3, rng))
    initial = rng.normal(0.0, 0.1, (4, 70, 3))
    shuffle = rng.permutation(70)
    straight = AnalyticSimulator().replay(batch, inputs, initial)
    shuffled = AnalyticSimulator().replay(ModelBatch(model, VARIED, batch.values[shuffle]), inputs, initial[:, shuffle])
    np.testing.assert_array_equal(shuffled.coordinates, straight.coordinates[:, :, shuffle])


def test_a_rollout_that_left_the_numbers_shows_it_and_harms_no_neighbour():
    rng = np.random.default_rng(6)
    model = robot("wip", EVERYTHING)
    inputs = Inputs.of(*uneven_windows(1, rng))
    initial = rng.normal(0.0, 0.1, (4, 3, 1))
    lost = initial.copy()
    lost[3, 1] = np.nan
    batch = batch_of(model, 3, rng)
    whole, harmed = (AnalyticSimulator().replay(batch, inputs, start).coordinates for start in (initial, lost))
    assert np.isnan(harmed[-1, :, 1]).all()
    np.testing.assert_array_equal(harmed[:, :, [0, 2]], whole[:, :, [0, 2]])


def test_threads_change_nothing():
    rng = np.random.default_rng(5)
    batch = batch_of(robot("wip", EVERYTHING), 300, rng)
    inputs = Inputs.of(*uneven_windows(6, rng))  # 1800 rollouts of some 200 steps: enough for two threads
    initial = rng.normal(0.0, 0.1, (4, 300, 6))
    one, three = (AnalyticSimulator(threads=n).replay(batch, inputs, initial) for n in (1, 3))
    assert_equal(one, three)


def test_a_closed_loop_does_not_depend_on_its_neighbours():
    rng = np.random.default_rng(8)
    model = robot("wip", EVERYTHING)
    batch = batch_of(model, 90, rng)
    assert batch.values is not None
    inputs = Inputs.regular(0.2, 200.0, 1)
    feedback = StateFeedback(np.array([[-3.0, 100.0, -6.0, 18.0]]), rate_filter=0.005, limit=20.0)
    references = rng.normal(0.0, 0.01, (40, 4, 1))
    noise = rng.normal(0.0, 1e-3, (40, 4, 90, 1))
    initial = rng.normal(0.0, 0.02, (4, 90, 1))
    together = AnalyticSimulator().close_loop(batch, inputs, initial, feedback, references, noise)
    one = slice(77, 78)  # in the second block
    alone = AnalyticSimulator().close_loop(
        ModelBatch(model, VARIED, batch.values[one]), inputs, initial[:, one], feedback, references, noise[:, :, one]
    )
    np.testing.assert_array_equal(together.coordinates[:, :, one], alone.coordinates)
    np.testing.assert_array_equal(together.commands[:, :, one], alone.commands)


def test_models_of_a_batch_are_the_models_one_by_one():
    rng = np.random.default_rng(2)
    model = robot("wip", EVERYTHING)
    names = ("body_mass", "translation/stribeck.F_c", "actuator/delay.tau", "geometry/payload_event.t0")
    values = np.column_stack(
        [rng.uniform(2.0, 3.0, 4), rng.uniform(0.5, 1.5, 4), rng.uniform(0.0, 0.01, 4), rng.uniform(0.0, 0.2, 4)]
    )
    inputs = Inputs.of(*uneven_windows(1, rng))
    initial = rng.normal(0.0, 0.1, (4, 1, 1))
    together = AnalyticSimulator().replay(ModelBatch(model, names, values), inputs, initial)
    for p, row in enumerate(values):
        single = model.with_values(dict(zip(names, row, strict=True)))
        alone = AnalyticSimulator().replay(ModelBatch(single), inputs, initial)
        np.testing.assert_array_equal(together.coordinates[:, :, p], alone.coordinates[:, :, 0])
