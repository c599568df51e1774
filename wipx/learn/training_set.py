"""What an estimator learns from: windows of motion under unknown loads, and the pitch at which each robot balances."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

PARTS = ("train", "validation", "test")
SIGNALS = ("x", "theta")
CHANNELS = len(SIGNALS)


@dataclass(frozen=True)
class TrainingSet:
    """N simulated robots, each with a load of its own.

    Attributes:
        windows: x and theta after the release, shape (N, L, 2) [m, rad].
        pitch: Equilibrium pitch of each, from its centre of mass, shape (N,) [rad].
        loads: Mass, height and side of each load, shape (N, 3) [kg, m, m].
        part: Index into `PARTS` of each, shape (N,).
        period: Time between samples [s].
        card: Where the data come from: method, seed, digest of the model, ranges, noise.
    """

    windows: np.ndarray
    pitch: np.ndarray
    loads: np.ndarray
    part: np.ndarray
    period: float
    card: Mapping[str, object]

    def of(self, part: str) -> "TrainingSet":
        """The robots of one part."""
        kept = self.part == PARTS.index(part)
        return TrainingSet(
            self.windows[kept], self.pitch[kept], self.loads[kept], self.part[kept], self.period, self.card
        )

    def first(self, length: int) -> "TrainingSet":
        """The same robots, seen for `length` samples only."""
        return TrainingSet(self.windows[:, :length], self.pitch, self.loads, self.part, self.period, self.card)
