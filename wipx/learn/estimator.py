"""The contract of every estimator of the equilibrium pitch: networks and classical ones."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.learn.training_set import SIGNALS, TrainingSet
from wipx.sim.simulator import Simulator, StateFeedback

COVERAGE = 0.9  # of the intervals
Watcher = Callable[[str, float], None]


@dataclass(frozen=True)
class PitchEstimate:
    """Equilibrium pitches with 90 % intervals.

    Attributes:
        pitch: Shape (N,) [rad].
        low: Lower ends, shape (N,).
        high: Upper ends, shape (N,).
    """

    pitch: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Workshop:
    """What an estimator may be made of.

    Attributes:
        training: Simulated robots; calibration of intervals uses its validation part, the test part is not touched.
        model: The simulation that they come from, without load; of random methods a typical one.
        simulator: Its engine.
        feedback: The controller that closes the loop, and its rate [Hz].
        seed: Of every random number.
        folder: Takes what an estimator keeps; it exists.
    """

    training: TrainingSet
    model: Model
    simulator: Simulator
    feedback: tuple[StateFeedback, float]
    seed: int
    folder: Path


def check_windows(windows: np.ndarray, length: int, period: float) -> None:
    """Refuse windows that an estimator cannot read.

    Args:
        windows: Expected: x and theta, shape (N, length, 2) [m, rad].
        length: Samples of a window.
        period: Time between them [s].

    Raises:
        InputError: windows of another length, or with values that are not finite.
    """
    if windows.ndim != 3 or windows.shape[1:] != (length, len(SIGNALS)):
        raise InputError(
            f"estimator: windows of shape {windows.shape}, expected (N, {length}, 2): the {length} "
            f"samples of x and theta from the release on, {1e3 * period:.4g} ms apart"
        )
    if not np.isfinite(windows).all():
        window, sample, signal = np.argwhere(~np.isfinite(windows))[0]
        raise InputError(
            f"estimator: {SIGNALS[signal]} of window {window}, sample {sample} is "
            f"{windows[window, sample, signal]}, expected a finite number; fill the gap or drop the window"
        )


class Estimator(Protocol):
    """Ready to estimate."""

    @property
    def length(self) -> int:
        """Samples of a window."""
        ...

    @property
    def period(self) -> float:
        """Time between them [s]."""
        ...

    def estimate(self, windows: np.ndarray) -> PitchEstimate:
        """The pitch at which each robot would balance.

        Args:
            windows: x, from the release, and theta, shape (N, length, 2) [m, rad].

        Raises:
            InputError: windows of another length, or with values that are not finite.
        """
        ...


class Recipe(Protocol):
    """A member of the group `estimator`: how one is made."""

    def prepare(self, workshop: Workshop, watcher: Watcher) -> Estimator:
        """Train or calibrate.

        Args:
            workshop: What it is made of.
            watcher: Told the stage and the share that is done.
        """
        ...
