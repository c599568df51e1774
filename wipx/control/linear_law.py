"""Linear control laws: gains on the state, and on what a controller remembers of it."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LinearLaw:
    """u = -(K e + H m), m' = W e, with e = [coordinates, rates] minus their reference; limits left out.

    Attributes:
        gains: K, shape (inputs, 2 joints).
        memory_gains: H, shape (inputs, memories).
        intake: W, shape (memories, 2 joints).
    """

    gains: np.ndarray
    memory_gains: np.ndarray
    intake: np.ndarray

    @classmethod
    def of(cls, gains: np.ndarray) -> "LinearLaw":
        """Plain state feedback: gains (inputs, 2 joints), nothing remembered."""
        inputs, states = gains.shape
        return cls(gains, np.zeros((inputs, 0)), np.zeros((0, states)))

    def scaled(self, factor: float) -> "LinearLaw":
        """The law with its command multiplied by a factor."""
        return LinearLaw(factor * self.gains, factor * self.memory_gains, self.intake)
