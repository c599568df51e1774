"""Robots without a controller, and robots drawn for a test."""

import numpy as np

from wipx.proof.blind_robots.engine import simulate
from wipx.proof.blind_robots.physics import Hidden, physics

BODIES = {
    "wip": {
        "body_mass": 3.0,
        "com_height": 0.3,
        "body_inertia": 0.08,
        "wheel_mass": 1.0,
        "wheel_inertia": 0.002,
        "wheel_radius": 0.06,
        "gravity": 9.81,
    },
    "linear_axis": {
        "body_mass": 2.0,
        "wheel_mass": 1.0,
        "wheel_inertia": 0.0,
        "wheel_radius": 0.02,
        "gravity": 9.81,
    },
    "pendulum": {"body_mass": 1.0, "com_height": 0.3, "body_inertia": 0.03, "gravity": 9.81},
    "double_pendulum": {
        "link1_mass": 1.5,
        "link1_length": 0.35,
        "link1_com": 0.2,
        "link1_inertia": 0.08,
        "link2_mass": 1.0,
        "link2_length": 0.3,
        "link2_com": 0.18,
        "link2_inertia": 0.045,
        "gravity": 9.81,
    },
}


def open_loop(
    kind: str,
    hidden: Hidden | None = None,
    *,
    start: tuple[float, float] = (0.0, 0.0),
    command: np.ndarray | None = None,
    rows: int = 1000,
    rate: float = 500.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates, rates and drives' forces of a robot that is left alone, each of shape (rows, 2)."""
    nothing = np.zeros((rows, 2))
    extra = nothing.copy()
    if command is not None:
        extra[:, 1 if kind == "pendulum" else 0] = command
    reached, _shown, q, v, _commands, forces, _states = simulate(
        physics(kind, BODIES[kind], hidden or Hidden())[0],
        np.array(start),
        np.arange(rows + 1) / rate,
        np.zeros((rows, 4)),
        extra,
        np.zeros((rows, 4)),
        nothing,
        nothing,
        np.array((False, False)),
        np.zeros(2),
        np.zeros((2, 4)),
        30.0,
        np.full(2, 1e9),
    )
    assert reached == rows
    return q, v, forces
