"""Robots drawn at random: sizes that one could build, and a controller that keeps them up."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, pi

import numpy as np
from scipy.linalg import solve_continuous_are

from wipx.proof.blind_robots.engine import INPUTS, STATES, derivative
from wipx.proof.blind_robots.physics import DRIVEN, MOVING, Hidden, physics

FINE = 1e-6  # step of the differences that linearise; rounding and curvature are both below 1e-9


@dataclass(frozen=True)
class Robot:
    """A robot as its owner believes it to be.

    Attributes:
        kind: Plant.
        parameters: Rigid body [SI], names of contract section 2.
        gains: State feedback on (q0, q1, rates), shape (2, 4); zero where there is no joint or command.
        rate: Control instants per second [Hz].
        cutoff: Of the filter of differenced coordinates [Hz].
        gyro: Whether the controller has a rate sensor, by joint.
    """

    kind: str
    parameters: Mapping[str, float]
    gains: np.ndarray
    rate: float
    cutoff: float
    gyro: tuple[bool, bool]

    @property
    def written_gains(self) -> list[float] | list[list[float]]:
        """Gains as robot.yaml has them: on the plant's own states; one row for each command."""
        moving = MOVING[self.kind]
        columns = [*moving, *(2 + joint for joint in moving)]
        rows = [[round(float(self.gains[joint, c]), 4) for c in columns] for joint in DRIVEN[self.kind]]
        return rows[0] if len(rows) == 1 else rows


def draw_robot(kind: str, rng: np.random.Generator) -> Robot:
    """A robot of that plant."""
    parameters = {name: float(f"{value:.4g}") for name, value in _DRAWN[kind](rng).items()}
    gyro = bool(rng.random() < 0.4) and kind in ("wip", "cartpole", "pendulum")
    gains = np.round(design(kind, parameters, effort=log_uniform(rng, 0.15, 1.5)), 4)
    rate = float(np.round(rng.uniform(300.0, 700.0)))
    return Robot(kind, parameters, gains, rate, float(rng.uniform(20.0, 50.0)), (False, gyro))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(log(low), log(high))))


def _body(rng: np.random.Generator, mass: float, height: float) -> dict[str, float]:
    return {
        "body_mass": mass,
        "com_height": height,
        "body_inertia": mass * height**2 * rng.uniform(0.15, 0.45),
        "gravity": 9.81,
    }


def _wip(rng: np.random.Generator) -> dict[str, float]:
    mass, radius = log_uniform(rng, 1.0, 8.0), rng.uniform(0.03, 0.1)
    wheel = mass * rng.uniform(0.15, 0.45)
    return {
        **_body(rng, mass, rng.uniform(0.15, 0.5)),
        "wheel_mass": wheel,
        "wheel_inertia": wheel * radius**2 * rng.uniform(0.4, 0.8),
        "wheel_radius": radius,
    }


def _cartpole(rng: np.random.Generator) -> dict[str, float]:
    mass = log_uniform(rng, 0.1, 2.0)
    return {
        **_body(rng, mass, rng.uniform(0.2, 0.5)),
        "wheel_mass": mass * rng.uniform(1.0, 4.0),
        "wheel_inertia": 0.0,
        "wheel_radius": rng.uniform(0.008, 0.03),
    }


def _pendulum(rng: np.random.Generator) -> dict[str, float]:
    return _body(rng, log_uniform(rng, 0.2, 4.0), rng.uniform(0.12, 0.6))


def _linear_axis(rng: np.random.Generator) -> dict[str, float]:
    return {
        "body_mass": log_uniform(rng, 0.3, 6.0),
        "wheel_mass": log_uniform(rng, 0.3, 3.0),
        "wheel_inertia": 0.0,
        "wheel_radius": rng.uniform(0.008, 0.03),
        "gravity": 9.81,
    }


def _double_pendulum(rng: np.random.Generator) -> dict[str, float]:
    drawn = {"gravity": 9.81}
    mass, length = log_uniform(rng, 0.5, 3.0), rng.uniform(0.2, 0.5)
    for link in ("link1", "link2"):
        com = length * rng.uniform(0.4, 0.8)
        drawn |= {
            f"{link}_mass": mass,
            f"{link}_length": length,
            f"{link}_com": com,
            f"{link}_inertia": mass * com**2 * rng.uniform(1.15, 1.5),
        }
        mass, length = mass * rng.uniform(0.4, 0.9), length * rng.uniform(0.6, 1.0)
    return drawn


_DRAWN = {
    "wip": _wip,
    "cartpole": _cartpole,
    "pendulum": _pendulum,
    "linear_axis": _linear_axis,
    "double_pendulum": _double_pendulum,
}


def linearised(kind: str, parameters: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """A, B of s' = A s + B u about rest at q = 0 for s = (coordinates, rates) of the plant's joints.

    Central differences of the equations of motion.
    """
    record = physics(kind, parameters, Hidden())[0]
    moving, driven = MOVING[kind], DRIVEN[kind]
    entries = [*moving, *(3 + joint for joint in moving)]

    def slope(entry: int | None, joint: int | None) -> np.ndarray:
        sides = []
        for sign in (1.0, -1.0):
            y, inputs, rates = np.zeros(STATES), np.zeros(INPUTS), np.zeros(STATES)
            if entry is not None:
                y[entry] = sign * FINE
            if joint is not None:
                inputs[joint] = sign * FINE
            derivative(y, 0.0, inputs, np.zeros(2, np.int64), record, rates)
            sides.append(rates[entries])
        return (sides[0] - sides[1]) / (2.0 * FINE)

    return np.column_stack([slope(e, None) for e in entries]), np.column_stack([slope(None, j) for j in driven])


def design(kind: str, parameters: Mapping[str, float], *, effort: float) -> np.ndarray:
    """Gains of a linear-quadratic regulator, shape (2, 4), weighted by deviations that are bad alike (Bryson).

    Args:
        kind: Plant.
        parameters: Rigid body [SI].
        effort: Relative size of the commands it may use.
    """
    a, b = linearised(kind, parameters)
    moving, driven = MOVING[kind], DRIVEN[kind]
    bad = {"wip": (0.1, 0.1), "cartpole": (0.1, 0.1), "linear_axis": (0.1, 1.0), "pendulum": (1.0, 0.1)}
    places = [bad.get(kind, (0.2, 0.2))[joint] for joint in moving]
    speeds = [2.0 * pi * 0.7 * place for place in places]
    if kind == "double_pendulum":
        effort *= 8.0  # without it the links hang too softly to be moved by their references
    # a command that reaches the bad place from rest in about a fifth of a second
    reach = [effort * 2.0 * places[0] / (0.2**2 * max(np.abs(column).max(), 1e-9)) for column in b.T]
    state_cost = np.diag([1.0 / value**2 for value in (*places, *speeds)])
    command_cost = np.diag([1.0 / value**2 for value in reach])
    cost = solve_continuous_are(a, b, state_cost, command_cost)
    rows = np.linalg.solve(command_cost, b.T @ cost)
    gains = np.zeros((2, 4))
    columns = [*moving, *(2 + joint for joint in moving)]
    for row, joint in zip(rows, driven, strict=True):
        gains[joint, columns] = row
    return gains
