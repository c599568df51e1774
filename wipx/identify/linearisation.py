"""A rigid body linearised at the angles that recordings visit."""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.cache import cached
from wipx.sim.inputs import Inputs

STEP = 1e-5  # [s] of the simulated steps from which accelerations are read off
REACH = 1e-4  # of the differences [m, rad, m/s, rad/s]
PROBE = 1e-3  # damping by which the answer to a force is found [N s/m or N m s/rad]
GRID = 0.1  # [rad] between the angles about which the body is linearised


@dataclass(frozen=True)
class Linearisation:
    """The rigid body about the places that the recordings visit.

    Attributes:
        a: Slopes of the accelerations by coordinates and rates, shape (G, joints, 2 joints).
        b: Inverse mass matrix, shape (G, joints, joints).
        place: Which of the G each row belongs to, shape (K + 1, R).
    """

    a: np.ndarray
    b: np.ndarray
    place: np.ndarray


def linearise_along(model: Model, coordinates: np.ndarray) -> Linearisation:
    """The body of a model, its friction aside, at rest at the angles of `coordinates`, shape (K + 1, joints, R)."""
    joints = coordinates.shape[1]
    rounded = np.zeros((len(coordinates), coordinates.shape[2], joints), dtype=np.int64)
    for j, site in enumerate(model.plant.joints):
        if site not in model.plant.sliding:
            rounded[..., j] = np.rint(coordinates[:, j] / GRID)
    places, index = np.unique(rounded.reshape(-1, joints), axis=0, return_inverse=True)
    friction = {name: 0.0 for name in model.parameters if name.endswith(".friction")}  # that a model file gives
    bare = Model(model.plant, {**model.parameters, **friction}, {})
    probes = {f"{site}/viscous": {"sigma": 0.0} for site in model.plant.joints}
    probed = bare.with_effects(probes)
    states = np.zeros((2 * joints, len(places), 1 + 4 * joints))
    states[:joints] = (places * GRID).T[:, :, None]
    for i in range(2 * joints):
        states[i, :, 1 + 2 * i] += REACH
        states[i, :, 2 + 2 * i] -= REACH
    rest = _accelerations(ModelBatch(probed), states.reshape(2 * joints, 1, -1))
    rest = rest.reshape(joints, len(places), 1 + 4 * joints)
    slopes = (rest[:, :, 1::2] - rest[:, :, 2::2]) / (2.0 * REACH)
    a = np.ascontiguousarray(np.moveaxis(slopes, 1, 0))
    # A known damping at a known rate is a known force: the difference that it makes shows the mass matrix.
    b = np.zeros((len(places), joints, joints))
    moving = np.zeros((2 * joints, 1, len(places)))
    moving[:joints, 0] = (places * GRID).T
    for j, site in enumerate(model.plant.joints):
        moving[joints:] = 0.0
        moving[joints + j] = 1.0
        free = _accelerations(ModelBatch(probed), moving)
        damped = _accelerations(ModelBatch(probed.with_values({f"{site}/viscous.sigma": PROBE})), moving)
        b[:, :, j] = ((free - damped) / PROBE)[:, 0].T
    return Linearisation(a, b, index.reshape(rounded.shape[:2]))


def _accelerations(batch: ModelBatch, states: np.ndarray) -> np.ndarray:
    """Mean accelerations over one tiny step without commands, shape (joints, P, R)."""
    joints = len(batch.model.plant.joints)
    window = Inputs.regular(STEP, 1.0 / STEP, len(batch.model.plant.commands), states.shape[2])
    run = AnalyticSimulator(STEP, threads=1).replay(batch, window, states)
    return (run.rates[1] - run.rates[0]).reshape(joints, *states.shape[1:]) / STEP


@cached
def transition_over(a, dt, transition):
    """exp(A dt) to third order, written to `transition`; A has the slopes `a` of the accelerations."""
    joints, n = a.shape
    for j in range(joints):
        for i in range(n):
            second = a[j, i - joints] if i >= joints else 0.0
            for q in range(joints):
                second += a[j, joints + q] * a[q, i]
            transition[j, i] = (1.0 if j == i else 0.0) + (dt if i == joints + j else 0.0)
            transition[j, i] += 0.5 * dt * dt * a[j, i] + dt**3 / 6.0 * second
            transition[joints + j, i] = (1.0 if i == joints + j else 0.0) + dt * a[j, i] + 0.5 * dt * dt * second
