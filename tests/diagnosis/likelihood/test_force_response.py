"""The linear response to a force is what a simulation with that force shows."""

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.core.model import ModelBatch
from wipx.diagnosis.likelihood.force_response import motion_of, response

DOSE = 1e-3


@pytest.mark.parametrize(
    ("kind", "joint", "rate"), [("linear_axis", "translation", "x_dot"), ("wip", "pitch", "theta_dot")]
)
def test_drag_changes_innovations_as_the_force_that_it_is(kind: str, joint: str, rate: str, fresh_seed: int):
    case = bench(kind, {}, fresh_seed, duration=2.0)
    fit, index = case.fit(), case.nominal.plant.joints.index(joint)
    force = -motion_of(case.fitter, fit)[rate]
    answered = response(case.fitter, fit, index, force[None])[:, 0]
    model = case.nominal.with_effects({f"{joint}/viscous": {"sigma": DOSE}})
    simulated = (case.fitter.white_of(fit, ModelBatch(model))[0] - fit.white.ravel()) / DOSE
    assert answered @ simulated > 0.99 * np.linalg.norm(answered) * np.linalg.norm(simulated)
    assert np.linalg.norm(answered) == pytest.approx(np.linalg.norm(simulated), rel=0.05)
