"""Uncertainty that does not trust the noise model: sandwich estimates over stretches of time.

Huber 1967; White 1982. Innovations that the noise model did not make quite white, or whose size changes along
the run, leave scores that add up within a stretch of time; their sum over stretches shows by how
much the plain covariance is too small.
"""

import numpy as np

from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch

STRETCH = 0.5  # [s]; several times the memory of the innovations


def stretches(data: RecordingBatch) -> np.ndarray:
    """Number of the stretch of time of every row, shape (R, K + 1); rows that do not count share that of others."""
    number = np.floor((data.inputs.t - data.inputs.t[0]) / STRETCH).astype(np.int64)
    labels = np.where(data.rows, number, 0) + 1_000_000 * np.arange(data.inputs.windows)
    return np.unique(labels.T, return_inverse=True)[1].reshape(labels.T.shape)


def covariance(fit: Fit) -> np.ndarray:
    """Covariance of the position in the cube, shape (D, D); at least the plain one."""
    plain = np.linalg.pinv(fit.information)
    scores = _scores(fit)
    sandwich = plain @ (scores.T @ scores) @ plain
    # a number without influence may come out a little below zero
    wider = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(plain), 1e-300), 1.0))
    found = plain * wider[:, None] * wider
    found[np.diag_indices_from(found)] = np.maximum(np.diag(found), 0.0)
    return found


def inflation(fit: Fit, indices: list[int]) -> float:
    """By how much evidence for parameters is overstated: variance of their estimates over the plain one, at least 1."""
    if not indices:
        return 1.0
    plain = np.diag(np.linalg.pinv(fit.information))
    robust = np.diag(covariance(fit))
    return float(max(1.0, np.median(robust[indices] / np.maximum(plain[indices], 1e-300))))


def _scores(fit: Fit) -> np.ndarray:
    """Sum of slopes times white errors over each stretch, shape (stretches, D)."""
    return sums_over(fit.blocks.ravel(), fit.jacobian[: fit.white.size] * fit.white.ravel()[:, None])


def sums_over(labels: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sums of the rows of (N, D) that share a label (N,), shape (labels, D)."""
    return np.stack([np.bincount(labels, weights=column) for column in values.T], axis=1)
