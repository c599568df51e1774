"""Rollouts of a rigid body with a learned acceleration: fourth-order Runge-Kutta over a batch of windows.

It replays like the analytic simulator, so states are estimated and predictions judged exactly as for other models.
Effects without memory that the owner knows (viscous friction, springs, gains ...) act; others are left to the network.
"""

from dataclasses import dataclass, field

import numpy as np

from wipx.baselines.network import ResidualAcceleration
from wipx.baselines.rigid_body import RigidBody
from wipx.baselines.torque import actuated, joint_forces
from wipx.core.model import Model, ModelBatch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path, Rollouts

FASTEST = 1e3  # [m/s, rad/s]; rates are held below it, so that a rollout that falls over stays a number


@dataclass(frozen=True)
class LearnedSimulator(AnalyticSimulator):
    """A simulator of one model; every model of a batch is taken for the same.

    Attributes:
        network: The acceleration beside the model's.
        rest_speeds: Speeds below which dry friction builds up, shape (joints,) [m/s or rad/s].
    """

    network: ResidualAcceleration | None = None
    rest_speeds: tuple[float, ...] = field(default=())

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """As the analytic simulator, one step for each row, the learned acceleration held over it."""
        joints = len(batch.model.plant.joints)
        body = RigidBody(batch.model)
        state = np.array(np.broadcast_to(initial, (2 * joints, batch.size, inputs.windows)))
        shape = (len(inputs.t), joints, batch.size, inputs.windows)
        coordinates, rates = np.empty(shape), np.empty(shape)
        windows = np.arange(inputs.windows)
        for k in range(len(inputs.t)):
            if path is not None and k < len(path.states):
                state = np.where(k <= path.until, path.states[k], state)
            coordinates[k], rates[k] = state[:joints], state[joints:]
            if k == len(inputs.t) - 1:
                break
            moving = windows[(k >= inputs.first) & (k < inputs.last)]
            if len(moving):
                lanes = state[:, :, moving].reshape(2 * joints, -1)
                t, steps, command = (
                    np.tile(values, batch.size)
                    for values in (
                        inputs.t[k, moving],
                        inputs.t[k + 1, moving] - inputs.t[k, moving],
                        inputs.commands[k][:, moving],
                    )
                )
                moved = self._step(body, lanes, t, steps, command)
                state[:, :, moving] = moved.reshape(2 * joints, batch.size, len(moving))
        return Rollouts(coordinates, rates, inputs.commands[:, :, None, :])

    def _step(
        self, body: RigidBody, state: np.ndarray, t: np.ndarray, steps: np.ndarray, command: np.ndarray
    ) -> np.ndarray:
        """States (2 joints, lanes) one row later."""
        joints = len(state) // 2
        learned = 0.0 if self.network is None else self.network(np.concatenate([state, command]))

        def slope(s: np.ndarray) -> np.ndarray:
            acceleration = nominal_acceleration(body, t, s, command, np.array(self.rest_speeds)) + learned
            return np.concatenate([s[joints:], acceleration])

        k1 = slope(state)
        k2 = slope(state + 0.5 * steps * k1)
        k3 = slope(state + 0.5 * steps * k2)
        k4 = slope(state + steps * k3)
        return np.clip(state + steps * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, -FASTEST, FASTEST)


def nominal_acceleration(
    body: RigidBody, t: np.ndarray, state: np.ndarray, command: np.ndarray, rest_speeds: np.ndarray
) -> np.ndarray:
    """Acceleration that a model without memory gives, shape (joints, N) [m/s^2, rad/s^2].

    Args:
        body: Of the model.
        t: Time, shape (N,) [s].
        state: Coordinates, then rates, shape (2 joints, N).
        command: Shape (inputs, N).
        rest_speeds: Speeds below which dry friction builds up, shape (joints,) [m/s or rad/s].
    """
    model: Model = body.model
    joints = len(state) // 2
    q, rates = state[:joints].T, state[joints:].T
    forces = joint_forces(model, t, q, rates, rest_speeds)
    for i, site in enumerate(model.plant.actuated):
        j = model.plant.joints.index(site)
        forces[:, j] += actuated(model, command[i] * model.parameters["input_gain"], rates[:, j])
    forces -= body.forces(t, q, rates, np.zeros_like(q))
    return np.linalg.solve(body.mass_matrix(t, q), forces[..., None])[..., 0].T


def learned_simulator(network: ResidualAcceleration, noise: np.ndarray) -> LearnedSimulator:
    """A simulator with a learned acceleration.

    Args:
        network: The acceleration.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad]; what it feigns as speed in ten
            milliseconds counts as rest.
    """
    return LearnedSimulator(network=network, rest_speeds=tuple((100.0 * noise).tolist()))
