"""The colour of innovations: an autoregression that turns them into white noise.

A fixed observer leaves innovations that are a stationary linear process whatever the sensors' noise is;
least squares on their past makes them white (Box, Jenkins 1976, Time Series Analysis), and the
likelihood of what remains is that of the recordings.
"""

from dataclasses import dataclass


import numpy as np

from wipx.diagnose.log import Log
from wipx.sim.cache import cached

LAGS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])  # rows


@dataclass(frozen=True)
class Colour:
    """An autoregression of innovations.

    Attributes:
        weights: From past to present, shape (len(LAGS) m, m).
        whitening: Inverse Cholesky factor of what it leaves, shape (m, m).
        log_likelihood: Of the innovations that it was fitted to, up to a constant.
    """

    weights: np.ndarray
    whitening: np.ndarray
    log_likelihood: float


def colour_of(innovations: np.ndarray, log: Log) -> Colour:
    """The autoregression of innovations, shape (K + 1, R, m)."""
    past = _past(innovations, log.counted, LAGS)
    now = innovations[log.counted]
    normal = past.T @ past
    normal[np.diag_indices_from(normal)] += 1e-9 * np.trace(normal) / len(normal)
    weights = np.linalg.solve(normal, past.T @ now)
    left = now - past @ weights
    covariance = left.T @ left / len(left)
    factor = np.linalg.cholesky(covariance + 1e-300 * np.eye(len(covariance)))
    log_likelihood = -len(left) * float(np.log(np.diag(factor)).sum())
    return Colour(weights, np.linalg.inv(factor), log_likelihood)


def whitened(innovations: np.ndarray, colour: Colour, log: Log) -> np.ndarray:
    """White innovations of the rows that count, shape (P, N, m), of innovations (P, K + 1, R, m)."""
    return _whitened(innovations, log.counted, LAGS, colour.weights, colour.whitening)


@cached
def _past(innovations, counted, lags):
    rows, recordings, m = innovations.shape
    past = np.zeros((counted.sum(), len(lags) * m))
    n = 0
    for k in range(rows):
        for r in range(recordings):
            if counted[k, r]:
                for i in range(len(lags)):
                    before = k - lags[i]
                    if before >= 0 and counted[before, r]:
                        for c in range(m):
                            past[n, i * m + c] = innovations[before, r, c]
                n += 1
    return past


@cached
def _whitened(innovations, counted, lags, weights, whitening):
    models, rows, recordings, m = innovations.shape
    out = np.zeros((models, counted.sum(), m))
    left = np.zeros(m)
    for p in range(models):
        n = 0
        for k in range(rows):
            for r in range(recordings):
                if not counted[k, r]:
                    continue
                for c in range(m):
                    left[c] = innovations[p, k, r, c]
                for i in range(len(lags)):
                    before = k - lags[i]
                    if before >= 0 and counted[before, r]:
                        for d in range(m):
                            value = innovations[p, before, r, d]
                            for c in range(m):
                                left[c] -= weights[i * m + d, c] * value
                for c in range(m):
                    total = 0.0
                    for d in range(c + 1):
                        total += whitening[c, d] * left[d]
                    out[p, n, c] = total
                n += 1
    return out
