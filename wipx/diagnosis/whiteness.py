"""The colour of innovations: an autoregression that turns them into white noise.

A fixed observer leaves innovations that are a stationary linear process whatever the sensors' noise is;
least squares on their past makes them white (Box, Jenkins 1976, Time Series Analysis), and the
likelihood of what remains is that of the recordings.
"""

from dataclasses import dataclass

import numpy as np

from wipx.diagnosis.log import Log
from wipx.sim.cache import cached

LARGEST = 1e3  # standard deviations up to which an innovation is counted
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
    """The autoregression of innovations, shape (R, m, K + 1)."""
    past, now = _past_and_present(innovations, log.counted, LAGS)
    normal = past.T @ past
    normal[np.diag_indices_from(normal)] += 1e-9 * np.trace(normal) / len(normal) + 1e-12
    weights = np.linalg.solve(normal, past.T @ now)
    left = now - past @ weights
    covariance = left.T @ left / len(left)
    factor = np.linalg.cholesky(covariance + (1e-9 * np.trace(covariance) + 1e-12) * np.eye(len(covariance)))
    log_likelihood = -len(left) * float(np.log(np.diag(factor)).sum())
    # Where the model ran away innovations stand at their limit, which a regression takes for well predicted.
    log_likelihood -= LARGEST * np.count_nonzero(np.abs(now) >= LARGEST)
    return Colour(weights, np.linalg.inv(factor), log_likelihood)


def whitened(innovations: np.ndarray, colour: Colour, log: Log) -> np.ndarray:
    """White innovations of (P, R, m, K + 1), of the same shape; zero at rows that do not count."""
    return _whitened(innovations, log.counted, LAGS, colour.weights, colour.whitening)


@cached
def _past_and_present(innovations, counted, lags):
    recordings, m, _ = innovations.shape
    past = np.zeros((counted.sum(), len(lags) * m))
    now = np.zeros((len(past), m))
    n = 0
    for r in range(recordings):
        for k in range(counted.shape[0]):
            if counted[k, r]:
                for c in range(m):
                    now[n, c] = innovations[r, c, k]
                for i in range(len(lags)):
                    before = k - lags[i]
                    if before >= 0 and counted[before, r]:
                        for c in range(m):
                            past[n, i * m + c] = innovations[r, c, before]
                n += 1
    return past, now


@cached
def _whitened(innovations, counted, lags, weights, whitening):
    models, recordings, m, rows = innovations.shape
    out = np.zeros((models, recordings, m, rows))
    left = np.zeros((m, rows))
    for r in range(recordings):
        first = np.argmax(counted[:, r])  # rows that count follow each other
        last = first + counted[:, r].sum() - 1
        for p in range(models):
            _whiten_one(innovations[p, r], lags, weights, whitening, first, last, left, out[p, r])
    return out


@cached
def _whiten_one(z, lags, weights, whitening, first, last, left, out):
    """One recording (m, K + 1) of one model; the innermost loops run along its rows."""
    m = len(z)
    for c in range(m):
        for k in range(first, last + 1):
            left[c, k] = z[c, k]
        for i in range(len(lags)):
            for d in range(m):
                weight = weights[i * m + d, c]
                for k in range(first + lags[i], last + 1):
                    left[c, k] -= weight * z[d, k - lags[i]]
    for c in range(m):
        for d in range(c + 1):
            weight = whitening[c, d]
            for k in range(first, last + 1):
                out[c, k] += weight * left[d, k]
