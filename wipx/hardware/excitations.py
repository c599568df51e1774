"""Motions that show a robot's physics: references of the driven joint, from release to fast sweeps."""

from collections.abc import Callable
from typing import Literal, get_args

import numpy as np

from wipx.core.plant import Plant
from wipx.hardware.target import Reference

ExcitationName = Literal["release", "tracking", "slow", "multisine", "steps", "chirp"]
EXCITATIONS: tuple[ExcitationName, ...] = get_args(ExcitationName)
SINES = np.array([0.2, 0.5, 0.9, 1.4, 2.1])  # [Hz]
SLOPE_STEP = 1e-4  # [s] of differences that give the rate
Path = Callable[[float], float]


def excitation(name: ExcitationName, plant: Plant, rng: np.random.Generator) -> Reference:
    """Coordinates and rates to follow over time since the release.

    Args:
        name: "release" is rest; "tracking" is the paper's task.
        plant: Its first driven joint is moved.
        rng: Draws phases.
    """
    driven, joints = plant.joints.index(plant.actuated[0]), len(plant.joints)
    path = _path(name, rng)

    def reference(t: float) -> np.ndarray:
        state = np.zeros(2 * joints)
        state[driven] = path(t)
        state[joints + driven] = (path(t + SLOPE_STEP) - path(t - SLOPE_STEP)) / (2.0 * SLOPE_STEP)
        return state

    return reference


def _path(name: ExcitationName, rng: np.random.Generator) -> Path:
    """Reference of one coordinate over time [m or rad]."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    if name == "release":
        return lambda t: 0.0
    if name == "tracking":  # 0.3 m/s at 0.4 Hz
        return lambda t: 0.3 / (0.8 * np.pi) * (1.0 - np.cos(0.8 * np.pi * t))
    if name == "slow":  # and small
        return lambda t: 0.03 * np.sin(2.0 * np.pi * 0.2 * t)
    if name == "multisine":
        phases = rng.uniform(0.0, 2.0 * np.pi, len(SINES))
        heights = 0.03 / np.sqrt(SINES)
        return lambda t: min(t, 1.0) * float(heights @ (np.sin(2.0 * np.pi * SINES * t + phases) - np.sin(phases)))
    if name == "steps":
        return lambda t: 0.12 * np.sign(np.sin(2.0 * np.pi * t / 4.0 + phase)) * min(t, 1.0)
    return lambda t: 0.05 * min(t, 1.0) * np.sin(2.0 * np.pi * (0.2 + 0.12 * t) * t)  # chirp to 2.6 Hz
