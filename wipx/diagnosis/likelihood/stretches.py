"""Stretches of time as units of evidence: errors within one go with each other, those of two do not."""

from dataclasses import dataclass

import numpy as np

from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.predictions import Predictions

BLOCK = 1.0  # [s] of a stretch
PARTS = 6  # into which stretches are dealt
DAMPED = 1e-3  # relative, of a step to numbers that suit some parts


@dataclass(frozen=True)
class Stretches:
    """The stretches in which N predictions start.

    Attributes:
        number: Of the stretch of each prediction, from 0 on, shape (N,).
        counted: Predictions that count, shape (N,).
    """

    number: np.ndarray
    counted: np.ndarray

    @classmethod
    def of(cls, predictions: Predictions) -> "Stretches":
        """Those of some predictions."""
        number = np.floor(predictions.starts / BLOCK).astype(np.int64) + 1_000_000 * predictions.recording
        return cls(np.unique(number, return_inverse=True)[1], predictions.counted)

    @property
    def part(self) -> np.ndarray:
        """Number of the part to which each prediction belongs, shape (N,)."""
        return self.number % PARTS

    @property
    def count(self) -> int:
        """How many there are in which any prediction counts."""
        return len(np.unique(self.number[self.counted]))

    def chance(self, values: np.ndarray) -> float:
        """Standard deviation of the sum of what predictions have (N,), were stretches drawn anew."""
        sums = np.bincount(self.number, values)[np.bincount(self.number, self.counted) > 0]
        return float(np.sqrt(len(sums)) * np.std(sums, ddof=1))


def step_to_others(fit: Fit, left_out: np.ndarray) -> np.ndarray:
    """From the position of a fit in the cube to the one that suits all predictions but some, shape (D,).

    One Gauss-Newton step, within the cube.

    Args:
        fit: The fit.
        left_out: Which predictions do not count, shape (N,).
    """
    cube = fit.hypothesis.cube
    here = np.flatnonzero(np.repeat(left_out, fit.white.shape[1]))
    jacobian = fit.jacobian[here]
    scale = np.sqrt(np.maximum(np.diag(fit.information), 1e-12))
    slope = fit.slope - jacobian.T @ fit.white.ravel()[here]
    normal = (fit.information - jacobian.T @ jacobian) / np.outer(scale, scale) + DAMPED * np.eye(len(cube))
    step = -np.linalg.solve(normal, slope / scale) / scale
    return np.clip(cube + np.where(fit.free, step, 0.0), 0.0, 1.0) - cube
