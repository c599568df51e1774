"""A rigid body linearised along the motion of recordings."""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.law import law
from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

STEP = 1e-5  # [s] of the simulated steps from which accelerations are read off
REACH = 1e-4  # of the differences [m, rad, m/s, rad/s]
PROBE = 1e-3  # damping by which the answer to a force is found [N s/m or N m s/rad]
APART = 0.02  # [s] between the rows at which the body is linearised, about
SPAN = 0.03  # [s] before a row, from which its rates are read: what comes after must not be known
SMALL = 0.5  # largest product of a slope and a time for which a series of third order is good


@dataclass(frozen=True)
class Linearisation:
    """The rigid body and its drives about the motion of recordings.

    Attributes:
        a: Slopes of the accelerations by coordinates and rates, shape (G, joints, 2 joints).
        b: Inverse mass matrix, shape (G, joints, joints).
        place: Which of the G each row belongs to, shape (K + 1, R).
    """

    a: np.ndarray
    b: np.ndarray
    place: np.ndarray


def linearise_along(model: Model, inputs: Inputs, coordinates: np.ndarray) -> Linearisation:
    """The body of a model, its friction aside, moved and commanded as in R recordings.

    Args:
        model: The model; its effects do not count.
        inputs: Times and commands of the rows.
        coordinates: Recorded ones, shape (K + 1, joints, R).
    """
    joints = coordinates.shape[1]
    place, moving, commands = _visited(inputs, coordinates)
    probed = _bare(model).with_effects({f"{site}/viscous": {"sigma": 0.0} for site in model.plant.joints})
    a = np.zeros((len(commands.T), joints, 2 * joints))
    for i in range(2 * joints):
        up, down = moving.copy(), moving.copy()
        up[i] += REACH
        down[i] -= REACH
        a[:, :, i] = (_accelerations(probed, commands, up) - _accelerations(probed, commands, down)).T / (2.0 * REACH)
    # A known damping at a known rate is a known force: the difference that it makes shows the mass matrix.
    b = np.zeros((len(a), joints, joints))
    for j, site in enumerate(model.plant.joints):
        turning = moving.copy()
        turning[joints + j] += np.copysign(1.0, turning[joints + j])
        free = _accelerations(probed, commands, turning)
        damped = _accelerations(probed.with_values({f"{site}/viscous.sigma": PROBE}), commands, turning)
        b[:, :, j] = ((free - damped) / (PROBE * turning[joints + j])).T
    return Linearisation(a, b, place)


def answers_to_commands(model: Model, inputs: Inputs, coordinates: np.ndarray) -> np.ndarray:
    """Slopes of the body's accelerations by its commands at every row, shape (K + 1, R, joints, inputs)."""
    place, moving, commands = _visited(inputs, coordinates)
    bare, found = _bare(model), np.zeros((len(commands.T), coordinates.shape[1], len(commands)))
    for c, size in enumerate(REACH * np.maximum(np.abs(commands).max(axis=1), REACH)):
        up, down = commands.copy(), commands.copy()
        up[c] += size
        down[c] -= size
        found[:, :, c] = (_accelerations(bare, up, moving) - _accelerations(bare, down, moving)).T / (2.0 * size)
    return found[place]


def _bare(model: Model) -> Model:
    """The body of a model without its effects and without friction that a model file gives."""
    friction = {name: 0.0 for name in model.parameters if name.endswith(".friction")}
    return Model(model.plant, {**model.parameters, **friction}, {})


def _visited(inputs: Inputs, coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of G places each row is near (K + 1, R); states (2 joints, G) and commands (inputs, G) there."""
    place, row, recording = _places(inputs)
    moving = np.concatenate([coordinates[row, :, recording], _rates(inputs, coordinates, row, recording)], axis=1).T
    return place, moving, inputs.commands[np.minimum(row, len(inputs.commands) - 1), :, recording].T


def _places(inputs: Inputs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of G rows is the last before each row (K + 1, R); those rows (G,) and their recordings (G,)."""
    every = max(1, round(APART / float(np.median(np.diff(inputs.t[: int(inputs.last.min()) + 1], axis=0)))))
    counts = inputs.last // every + 1
    recording = np.repeat(np.arange(len(counts)), counts)
    first = np.cumsum(counts) - counts
    row = (np.arange(len(recording)) - first[recording]) * every
    return first + np.minimum(np.arange(len(inputs.t))[:, None] // every, counts - 1), row, recording


def _rates(inputs: Inputs, coordinates: np.ndarray, row: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Mean rates just before some rows (G,) of recordings (G,), shape (G, joints); of the first rows, just after."""
    before, after = row - 1, np.maximum(row, 1)
    for r, last in enumerate(inputs.last):
        here, t = recording == r, inputs.t[: last + 1, r]
        before[here] = np.clip(np.searchsorted(t, t[row[here]] - SPAN), 0, np.maximum(before[here], 0))
        after[here] = np.maximum(after[here], min(int(np.searchsorted(t, t[0] + SPAN)), last))
    times = inputs.t[after, recording] - inputs.t[before, recording]
    return (coordinates[after, :, recording] - coordinates[before, :, recording]) / times[:, None]


def _accelerations(model: Model, commands: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Mean accelerations over one tiny step, shape (joints, G), for commands (inputs, G) and states (2 joints, G)."""
    joints = len(model.plant.joints)
    window = replace(Inputs.regular(STEP, 1.0 / STEP, len(commands), states.shape[1]), commands=commands[None].copy())
    run = AnalyticSimulator(STEP, threads=1).replay(ModelBatch(model), window, states[:, None])
    return ((run.rates[1] - run.rates[0]) / STEP).reshape(joints, -1)


@law
def transition_over(a, dt, transition, pushed, work):
    """exp(A dt), written to `transition`, and what accelerations of one, held over dt, do to the state, to `pushed`.

    A has the slopes `a` of the accelerations. A series of third order over so short a time that it is good, doubled as
    often as it takes to reach dt. `work` has room for a matrix like `transition`.
    """
    joints, n = a.shape
    stiffest = 0.0
    for j in range(joints):
        total = 0.0
        for q in range(joints, n):
            total += abs(a[j, q])
        stiffest = max(stiffest, total)
    doublings = 0
    while stiffest * dt > SMALL * 2.0**doublings:
        doublings += 1
    _short_transition(a, dt / 2.0**doublings, transition, pushed)
    for _ in range(doublings):
        _multiply(transition, pushed, work)
        for i in range(n):
            for j in range(joints):
                pushed[i, j] += work[i, j]
        _multiply(transition, transition, work)
        for i in range(n):
            for j in range(n):
                transition[i, j] = work[i, j]


@law
def _multiply(left, right, product):
    """Write the product of two matrices, into the first columns of a third."""
    rows, columns = right.shape
    for i in range(len(left)):
        for j in range(columns):
            product[i, j] = 0.0
        for q in range(rows):
            weight = left[i, q]
            for j in range(columns):
                product[i, j] += weight * right[q, j]


@law
def _short_transition(a, dt, transition, pushed):
    """The same to third order."""
    joints, n = a.shape
    for j in range(joints):
        for i in range(n):
            second = a[j, i - joints] if i >= joints else 0.0
            for q in range(joints):
                second += a[j, joints + q] * a[q, i]
            transition[j, i] = (1.0 if j == i else 0.0) + (dt if i == joints + j else 0.0)
            transition[j, i] += 0.5 * dt * dt * a[j, i] + dt**3 / 6.0 * second
            transition[joints + j, i] = (1.0 if i == joints + j else 0.0) + dt * a[j, i] + 0.5 * dt * dt * second
        for i in range(joints):
            pushed[j, i] = (0.5 * dt * dt if i == j else 0.0) + dt**3 / 6.0 * a[j, joints + i]
            pushed[joints + j, i] = (dt if i == j else 0.0) + 0.5 * dt * dt * a[j, joints + i]
