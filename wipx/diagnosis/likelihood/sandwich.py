"""Uncertainty that does not trust the noise model: sandwich estimates over stretches of time.

Huber 1967; White 1982. Innovations that the noise model did not make quite white, or whose size changes along
the run, leave scores that add up within a stretch of time; their sum over stretches shows by how
much the plain covariance is too small.
"""

import numpy as np
from scipy.special import stdtrit

from wipx.core.results import NINETY_FIVE
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch

STRETCH = 0.5  # [s]; several times the memory of the innovations
MOST_FITTED = 0.98  # share of a stretch's errors along a direction that counts as taken by the fit, at most


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


def robust_deviations(fit: Fit) -> np.ndarray:
    """Half widths of 95 % intervals in the cube over those of a normal variable, shape (D,); at least the plain ones.

    The fit follows few stretches too closely, and their scatter is known poorly. So scores are corrected for the share
    that the fit has taken from a stretch, and Student's t has as many degrees of freedom as the stretches leave each
    number (CR2 with Satterthwaite's approximation: Bell, McCaffrey 2002; Pustejovsky, Tipton 2018).
    """
    plain = np.linalg.pinv(fit.information)
    sizes, axes = np.linalg.eigh(plain)
    root = axes * np.sqrt(np.maximum(sizes, 0.0))
    slopes, labels = fit.jacobian[: fit.white.size] @ root, fit.blocks.ravel()
    pieces = np.split(slopes[np.argsort(labels, kind="stable")], np.cumsum(np.bincount(labels))[:-1])
    fitted, turned = np.linalg.eigh(np.stack([piece.T @ piece for piece in pieces]))
    fitted = np.clip(fitted, 0.0, MOST_FITTED)[:, None, :]

    def along(shares: np.ndarray) -> np.ndarray:
        return (turned * shares) @ turned.swapaxes(1, 2)

    scores = along(1.0 / np.sqrt(1.0 - fitted)) @ sums_over(labels, slopes * fit.white.ravel()[:, None])[:, :, None]
    robust = np.sum((scores[:, :, 0] @ root.T) ** 2, axis=0)
    own = np.einsum("ki,sij,kj->sk", root, along(fitted / (1.0 - fitted)), root)  # variance of each stretch's share
    common = along(fitted / np.sqrt(1.0 - fitted)) @ root.T
    taken = np.sum(common**2, axis=1)
    between = np.einsum("sik,sjk->kij", common, common)
    squares = np.sum(own**2 - 2.0 * own * taken, axis=0) + np.sum(between**2, axis=(1, 2))
    freedom = np.sum(own - taken, axis=0) ** 2 / np.maximum(squares, 1e-300)
    wider = stdtrit(np.maximum(freedom, 1.0), 0.975) / NINETY_FIVE
    return np.sqrt(np.maximum(np.maximum(np.diag(plain), 0.0), wider**2 * robust))


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
