"""What a fit leaves over, freed of what its own numbers could imitate, and what scans compare with it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wipx.core.model import ModelBatch
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.force_response import motion_of, response
from wipx.diagnosis.likelihood.innovations import InnovationFitter


@dataclass(frozen=True)
class LeftOver:
    """White errors that a fit leaves over.

    Attributes:
        fitter: Of the fit.
        fit: What is already explained.
    """

    fitter: Fitter
    fit: Fit

    @cached_property
    def errors(self) -> np.ndarray:
        """White errors, freed of what the fit's numbers imitate, shape (N,)."""
        return self.freed(self.fit.white.ravel())

    @cached_property
    def basis(self) -> np.ndarray:
        """What small changes of the fit's free numbers make of its white errors, orthonormal, shape (N, D)."""
        jacobian = self.fit.jacobian[: self.fit.white.size, self.fit.free]
        if not jacobian.shape[1]:
            return np.zeros((len(jacobian), 0))
        return np.linalg.qr(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300))[0]

    def freed(self, changes: np.ndarray) -> np.ndarray:
        """Changes of white errors, (..., N), without what the fit's numbers imitate."""
        return changes - (changes @ self.basis) @ self.basis.T

    def changes(self, batch: ModelBatch) -> np.ndarray:
        """What other models change of the white errors, shape (P, N); nothing is taken away."""
        return self.fitter.white_of(self.fit, batch) - self.fit.white.ravel()


@dataclass(frozen=True)
class LeftOverByRow(LeftOver):
    """White innovations that a fit leaves over, and how they answer to forces at single rows."""

    fitter: InnovationFitter

    @cached_property
    def motion(self) -> dict[str, np.ndarray]:
        """Coordinates, rates, commands and time at every row that its observer expects, shape (K + 1, R) each."""
        return motion_of(self.fitter, self.fit)

    def answer(self, joint: int, forces: np.ndarray) -> np.ndarray:
        """Slopes of the innovations by sizes of forces (C, K + 1, R) on a joint, freed, shape (C, N)."""
        return self.freed(response(self.fitter, self.fit, joint, forces).T)

    @cached_property
    def foretold(self) -> np.ndarray:
        """See `InnovationFitter.foretold`, shape (joints,)."""
        return self.fitter.foretold(self.fit)
