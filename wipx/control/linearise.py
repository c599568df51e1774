"""Linear models about the rest position q = 0."""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

STEP = 1e-5  # [s] of one simulated step, from which accelerations are read off
REACH = 1e-4  # [m, rad, m/s, rad/s, N, N m] of the differences


@dataclass(frozen=True)
class LinearModel:
    """y' = A y + B u with y = [coordinates, rates] about q = 0 (paper, Sec. III).

    Attributes:
        a: Shape (2 joints, 2 joints).
        b: Shape (2 joints, inputs).
    """

    a: np.ndarray
    b: np.ndarray


def linearise(model: Model) -> LinearModel:
    """The rigid body of a model, without its effects, by differences of simulated accelerations."""
    bare = Model(model.plant, model.parameters, {})
    joints, inputs = len(model.plant.joints), len(model.plant.commands)
    size = 2 * joints + inputs
    moves = REACH * np.concatenate([np.eye(size), -np.eye(size)])
    window = Inputs.regular(STEP, 1.0 / STEP, inputs, 2 * size)
    commands = moves[:, 2 * joints :].T[None]
    initial = moves[:, : 2 * joints].T[:, None, :]
    run = AnalyticSimulator(STEP).replay(
        ModelBatch(bare), Inputs(window.t, commands, window.first, window.last), initial
    )
    accelerations = (run.rates[1] - run.rates[0])[:, 0] / STEP
    slopes = (accelerations[:, :size] - accelerations[:, size:]) / (2.0 * REACH)
    a = np.block([[np.zeros((joints, joints)), np.eye(joints)], [slopes[:, : 2 * joints]]])
    return LinearModel(a, np.concatenate([np.zeros((joints, inputs)), slopes[:, 2 * joints :]]))
