"""Robots, rollouts and an independent integrator that the tests of the physics share.

The equations of motion stand here a second time, as matrices for `scipy.integrate.solve_ivp`,
so that the compiled simulator is checked against something that shares no code with it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator

BODY = {"body_mass": 2.6, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.11}
LINKS = {
    "link1_mass": 0.5,
    "link1_length": 0.2,
    "link1_com": 0.15,
    "link1_inertia": 0.015,
    "link2_mass": 0.6,
    "link2_length": 0.3,
    "link2_com": 0.25,
    "link2_inertia": 0.05,
}
PARAMETERS: Mapping[str, Mapping[str, float]] = {
    "wip": {**BODY, "wheel_inertia": 0.0023, "wheel_radius": 0.0625},
    "cartpole": BODY,
    "pendulum": {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037},
    "linear_axis": {"body_mass": 2.0, "wheel_mass": 0.5},
    "double_pendulum": LINKS,
}
# Starts that let every joint move, coordinates then rates.
LIVELY = {
    "wip": (0.0, 0.4, 0.3, -0.5),
    "cartpole": (0.1, 2.5, -0.2, 1.0),
    "pendulum": (2.0, 1.0),
    "linear_axis": (0.1, 0.7),
    "double_pendulum": (0.9, -0.7, 0.5, 2.0),
}
Effects = Mapping[str, Mapping[str, float]]
Forces = Callable[[int, float, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Motion:
    """A rollout of one model: times (K + 1,), recorded coordinates and true rates (K + 1, joints)."""

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray


def robot(kind: str, effects: Effects | None = None, changes: Mapping[str, float] | None = None) -> Model:
    """A robot of that kind with some effects and some parameters changed."""
    plant = plant_of(kind)
    return Model(plant, plant.complete({**PARAMETERS[kind], **(changes or {})}, "test"), effects or {})


def unit_axis(effects: Effects) -> Model:
    """A carriage of 1 kg: the force on it is its acceleration."""
    return robot("linear_axis", effects, {"body_mass": 0.0, "wheel_mass": 1.0})


def move(model: Model, initial, t: np.ndarray, commands=None, simulator: Simulator | None = None) -> Motion:
    """Replay `commands` (K,) or (K, inputs), none by default, on rows at times `t` (K + 1,)."""
    held = np.zeros((len(t) - 1, len(model.plant.commands)))
    if commands is not None:
        held += np.reshape(commands, (len(t) - 1, -1))
    inputs = Inputs.of([t], [np.vstack([held, held[-1:]])], [0])
    start = np.array(initial, dtype=float)[:, None, None]
    run = (simulator or AnalyticSimulator()).replay(ModelBatch(model), inputs, start)
    return Motion(t, run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0])


def row_forces(motion: Motion) -> np.ndarray:
    """Mean force of each row on a `unit_axis`, shape (K,) [N]."""
    return np.diff(motion.v[:, 0]) / np.diff(motion.t)


def sines(t: np.ndarray, amplitude: float, inputs: int = 1) -> np.ndarray:
    """Commands of two frequencies, shape (K, inputs)."""
    phases = np.arange(inputs)
    return amplitude * (np.sin(7.0 * t[:-1, None] + phases) + 0.5 * np.sin(19.0 * t[:-1, None] + 2.0 * phases))


def mass_matrix(model: Model, q: np.ndarray) -> np.ndarray:
    """M(q), shape (joints, joints)."""
    p = model.parameters
    if model.plant.kind == "double_pendulum":
        elbow = p["link2_mass"] * p["link1_length"] * p["link2_com"] * np.cos(q[1])
        tip = p["link2_inertia"]
        base = p["link1_inertia"] + p["link2_mass"] * p["link1_length"] ** 2 + tip + 2.0 * elbow
        return np.array([[base, tip + elbow], [tip + elbow, tip]])
    if model.plant.kind == "linear_axis":
        return np.array([[_rolling_mass(p)]])
    turning = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    if model.plant.kind == "pendulum":
        return np.array([[turning]])
    coupling = -p["body_mass"] * p["com_height"] * np.cos(q[1])
    return np.array([[_rolling_mass(p), coupling], [coupling, turning]])


def _rolling_mass(p: Mapping[str, float]) -> float:
    return p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2


def inner_forces(model: Model, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Gravity and centrifugal forces, shape (joints,); M(q) q'' = these + forces from outside."""
    p = model.parameters
    g = p["gravity"]
    if model.plant.kind == "double_pendulum":
        swing = p["link2_mass"] * p["link1_length"] * p["link2_com"] * np.sin(q[1])
        lower = p["link2_mass"] * p["link2_com"] * g * np.sin(q[0] + q[1])
        upper = (p["link1_mass"] * p["link1_com"] + p["link2_mass"] * p["link1_length"]) * g * np.sin(q[0])
        return np.array([swing * (2.0 * v[0] * v[1] + v[1] ** 2) - upper - lower, -swing * v[0] ** 2 - lower])
    if model.plant.kind == "linear_axis":
        return np.zeros(1)
    arm = p["body_mass"] * p["com_height"]
    if model.plant.kind == "pendulum":
        return np.array([arm * g * np.sin(q[0])])
    return np.array([-arm * np.sin(q[1]) * v[1] ** 2, arm * g * np.sin(q[1])])


def energy(model: Model, motion: Motion) -> np.ndarray:
    """Kinetic plus potential energy at each row, shape (K + 1,) [J]."""
    p = model.parameters
    kinetic = np.array([0.5 * v @ mass_matrix(model, q) @ v for q, v in zip(motion.q, motion.v, strict=True)])
    q = motion.q
    if model.plant.kind == "double_pendulum":
        upper = (p["link1_mass"] * p["link1_com"] + p["link2_mass"] * p["link1_length"]) * np.cos(q[:, 0])
        return kinetic - p["gravity"] * (upper + p["link2_mass"] * p["link2_com"] * np.cos(q[:, 0] + q[:, 1]))
    if model.plant.kind == "linear_axis":
        return kinetic
    return kinetic + p["body_mass"] * p["gravity"] * p["com_height"] * np.cos(q[:, -1])


def reference(model: Model, initial, t: np.ndarray, forces: Forces) -> Motion:
    """The motion by `solve_ivp`, far more exact than any tolerance of these tests.

    Args:
        model: Its rigid body alone is used.
        initial: Coordinates, then rates.
        t: Times of the rows, shape (K + 1,); integrated row by row, so that forces may jump between rows.
        forces: Force on each joint at (row, time, q, v), shape (joints,) [N, N m].
    """
    n = len(model.plant.joints)
    states = [np.array(initial, dtype=float)]
    for row, (begin, end) in enumerate(pairwise(t)):

        def slope(time: float, y: np.ndarray, row: int = row) -> np.ndarray:
            q, v = y[:n], y[n:]
            pull = inner_forces(model, q, v) + forces(row, time, q, v)
            return np.concatenate([v, np.linalg.solve(mass_matrix(model, q), pull)])

        solution = solve_ivp(slope, (begin, end), states[-1], method="DOP853", rtol=1e-11, atol=1e-12)
        states.append(solution.y[:, -1])
    path = np.array(states)
    return Motion(t, path[:, :n], path[:, n:])
