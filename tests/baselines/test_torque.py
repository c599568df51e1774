"""The torque that a model leaves unexplained."""

import numpy as np
import pytest
from baselines.driven_pendulum import NOISE, VISCOUS, Effects, pendulum, record

from wipx.baselines.torque import TorqueData
from wipx.core.plant import plant_of
from wipx.identify.motion import motions


@pytest.mark.parametrize(
    "effects",
    [
        VISCOUS,
        {"actuator/gain": {"k": 0.8}},
        {"actuator/delay": {"tau": 0.02}},
        {"geometry/payload": {"mass": 0.1, "height": 0.3}},
        {"sensor_theta/scale": {"e": 0.05}},
    ],
    ids=lambda effects: next(iter(effects)),
)
def test_the_torque_residual_of_the_true_model_vanishes_without_noise(effects: Effects, fresh_seed: int):
    recordings = record(effects, np.random.default_rng(fresh_seed), noise=0.0, drive=0.05)
    data = TorqueData(motions(recordings, plant_of("pendulum"), np.array([NOISE])))
    true, nominal = (np.std(data.residual(pendulum(e))) for e in (effects, {}))
    assert true < 0.05 * nominal  # the filter does not commute with the sine of the angle; small swings
