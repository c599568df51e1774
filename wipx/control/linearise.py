"""Linear models about rest: of the rigid body alone, and of a completed model."""

from dataclasses import dataclass

import numpy as np

from wipx.core.load import BALANCE
from wipx.core.model import Model, ModelBatch
from wipx.effects.catalogue import kind_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.tree.inverse import forces_of

STEP = 1e-5  # [s] of one simulated step, from which accelerations are read off
REACH = 1e-4  # [m, rad, m/s, rad/s, N, N m] of the differences


@dataclass(frozen=True)
class LinearModel:
    """y' = A y + B u with y = [coordinates, rates] about rest (paper, Sec. III).

    Attributes:
        a: Shape (2 joints, 2 joints).
        b: Shape (2 joints, inputs).
    """

    a: np.ndarray
    b: np.ndarray


def linearise(model: Model) -> LinearModel:
    """The rigid body of a model about q = 0, without its effects, by differences of simulated accelerations."""
    return _slopes(Model(model.plant, model.parameters, {}), 0.0)


def linearise_about(model: Model, positions: np.ndarray) -> LinearModel:
    """A robot from a model file about an equilibrium, by differences of its inverse dynamics; without dry friction.

    Args:
        model: The robot; effects at its links and at its base count, others do not.
        positions: Of the equilibrium, shape (joints,) [rad or m].
    """
    joints, zero, one = len(positions), np.zeros((len(positions),) * 2), np.eye(len(positions))
    still = forces_of(model, positions[None], zero[:1], zero[:1])
    mass = (forces_of(model, positions + zero, zero, one) - still).T
    ahead, behind = (forces_of(model, positions + reach * one, zero, zero) for reach in (REACH, -REACH))
    stiffness = ((ahead - behind) / (2.0 * REACH)).T
    damping = np.diag([model.parameters[f"{joint}.damping"] for joint in model.plant.joints])
    inputs = np.zeros((joints, len(model.plant.commands)))
    for k, joint in enumerate(model.plant.actuated):
        inputs[model.plant.joints.index(joint), k] = model.parameters[f"{joint}.gain"]
    slopes = np.linalg.solve(mass, np.hstack([-stiffness, -damping, inputs]))
    a = np.block([[zero, one], [slopes[:, : 2 * joints]]])
    return LinearModel(a, np.concatenate([np.zeros_like(inputs), slopes[:, 2 * joints :]]))


def linearise_completed(model: Model) -> LinearModel:
    """A model with those of its effects that have a slope at rest, about the pitch at which it balances.

    Dry friction, dead zone and backlash have none, and sensors do not move a robot. Lags and delays of the actuator
    are no part of it; see `wipx.control.sampled`. Of the paper's friction (Eq. 5) only the viscous part is.
    """
    effects: dict[str, dict[str, float]] = {}
    for name, values in model.effects.items():
        linear = kind_of(name).linear_at_rest
        if linear:
            same = f"{name.partition('/')[0]}/{linear}"
            felt = effects.setdefault(same, {})
            for symbol in kind_of(same).neutral.keys() & values.keys():
                felt[symbol] = felt.get(symbol, 0.0) + values[symbol]
    balance = effects.get(BALANCE, {}).get("theta_eq", 0.0)
    return _slopes(Model(model.plant, model.parameters, effects), balance)


def _slopes(model: Model, pitch: float) -> LinearModel:
    """Slopes of a model's accelerations at rest, its angle against gravity being `pitch` [rad]."""
    joints, inputs = len(model.plant.joints), len(model.plant.commands)
    size = 2 * joints + inputs
    moves = REACH * np.concatenate([np.eye(size), -np.eye(size)])
    window = Inputs.regular(STEP, 1.0 / STEP, inputs, 2 * size)
    commands = moves[:, 2 * joints :].T[None]
    initial = moves[:, : 2 * joints].T[:, None, :].copy()
    if "theta" in model.plant.coordinates:
        initial[model.plant.coordinates.index("theta")] += pitch
    run = AnalyticSimulator(STEP).replay(
        ModelBatch(model), Inputs(window.t, commands, window.first, window.last), initial
    )
    accelerations = (run.rates[1] - run.rates[0])[:, 0] / STEP
    slopes = (accelerations[:, :size] - accelerations[:, size:]) / (2.0 * REACH)
    a = np.block([[np.zeros((joints, joints)), np.eye(joints)], [slopes[:, : 2 * joints]]])
    return LinearModel(a, np.concatenate([np.zeros((joints, inputs)), slopes[:, 2 * joints :]]))
