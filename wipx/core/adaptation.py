"""What a real-to-sim adaptation leaves: the type that tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.results import SearchHistory


@dataclass(frozen=True)
class ClassTrajectory:
    """The mean trajectory of the trials with one load, recorded and simulated.

    Attributes:
        name: Of the load.
        equilibrium: Pitch at which the loaded robot balances, from the load's weight and place [rad].
        held_out: Whether the adaptation never saw it.
        t: Time since the release, shape (L,) [s].
        recorded: Mean of the recorded trials, shape (L, joints) [m, rad].
        simulated: Mean of the simulated ones, shape (L, joints).
    """

    name: str
    equilibrium: float
    held_out: bool
    t: np.ndarray
    recorded: np.ndarray
    simulated: np.ndarray


@dataclass(frozen=True)
class GapLoss:
    """The paper's Eq. 7 over some classes: the reality gap.

    Attributes:
        value: Mean squared distance of mean trajectories [m^2 and rad^2 added].
        low: Smallest over the draws of a method with random numbers; `value`, their median, elsewhere.
        high: Largest.
        floor: What noise and chance leave of it for a perfect model.
    """

    value: float
    low: float
    high: float
    floor: float


@dataclass(frozen=True)
class AdaptationResult:
    """One adapted simulation beside the robot that it is to resemble.

    Attributes:
        method: How the simulation came about (paper, Sec. V-C).
        optimizer: Search of its numbers; empty where nothing was searched.
        engine: Simulator.
        seed: Of the search or of the draws.
        target: Folder of the recordings.
        fit: Loss on the classes that the search saw.
        held_out: Loss on the others; None where there are none.
        parameters: Identified numbers by name [SI]; of random ones the draw with the median loss.
        intervals: 95 % intervals of identified numbers; empty where nothing was searched.
        history: Course of the search; None where nothing was searched.
        coordinates: Names of the joints' columns.
        classes: One entry for each load.
    """

    method: str
    optimizer: str
    engine: str
    seed: int
    target: str
    fit: GapLoss
    held_out: GapLoss | None
    parameters: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    history: SearchHistory | None
    coordinates: tuple[str, ...]
    classes: tuple[ClassTrajectory, ...]
