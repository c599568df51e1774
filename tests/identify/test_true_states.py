"""True states behind what sensors show."""

import numpy as np
from sim.robots import robot

from wipx.core.model import ModelBatch
from wipx.identify.sensors import true_states


def test_what_sensors_do_to_a_state_is_undone(fresh_seed: int):
    true = np.random.default_rng(fresh_seed).normal(size=(4, 1, 50))  # (2 joints, P, R)
    effects = {
        "sensor_x/scale": {"e": 0.03},
        "sensor_theta/bias": {"b": 0.02},
        "sensor_theta/eccentricity": {"s": 0.02, "c": -0.015, "n": 6.0},
    }
    shown = true.copy()
    shown[[0, 2]] *= 1.03
    shown[1] += 0.02
    shown[1] += (0.02 * np.sin(6.0 * shown[1]) - 0.015 * np.cos(6.0 * shown[1])) / 6.0
    np.testing.assert_allclose(true_states(ModelBatch(robot("wip", effects)), shown), true, atol=1e-6)
