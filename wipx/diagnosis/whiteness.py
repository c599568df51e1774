"""The colour of innovations: an autoregression that turns them into white noise.

A fixed observer leaves innovations that are a stationary linear process whatever the sensors' noise is;
least squares on their past makes them white (Box, Jenkins 1976, Time Series Analysis), and the
likelihood of what remains is that of the recordings.
"""

from dataclasses import dataclass

import numpy as np

from wipx.diagnosis.log import Log
from wipx.sim.cache import cached

SURPRISES = 2  # rows before the present whose commands may know of its noise
LARGEST = 1e3  # standard deviations up to which an innovation is counted
LAGS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])  # rows


@dataclass(frozen=True)
class Colour:
    """An autoregression of innovations.

    Attributes:
        weights: From past innovations, then from the commands' surprises (see `Log.surprises`), to the present,
            shape (len(LAGS) m + SURPRISES inputs, m).
        whitening: Inverse Cholesky factor of what it leaves, shape (m, m).
        log_likelihood: Of the innovations that it was fitted to, up to a constant.
        reported: The part of it that is the reported forces'.
    """

    weights: np.ndarray
    whitening: np.ndarray
    log_likelihood: float
    reported: float


def colour_of(innovations: np.ndarray, log: Log) -> Colour:
    """The autoregression of innovations, shape (R, m, K + 1).

    Errors of reported forces have one of their own: what a drive reports beyond the modelled force would explain the
    motion in place of the physics that makes it.
    """
    past, now = _past_and_present(innovations, log.counted, LAGS, log.surprises)
    m, inputs = now.shape[1], log.surprises.shape[1]
    lagged = np.tile(np.arange(m), len(LAGS))
    motion = np.concatenate([lagged < len(log.channels), np.ones(SURPRISES * inputs, dtype=bool)])
    weights, whitening = np.zeros((past.shape[1], m)), np.zeros((m, m))
    likelihoods = []
    for known, signals in ((motion, np.arange(m) < len(log.channels)), (~motion, np.arange(m) >= len(log.channels))):
        likelihoods.append(0.0)
        if signals.any():
            own, factor = _regressed(past[:, known], now[:, signals])
            weights[np.ix_(known, signals)] = own
            whitening[np.ix_(signals, signals)] = np.linalg.inv(factor)
            likelihoods[-1] -= len(now) * float(np.log(np.diag(factor)).sum())
    # Where the model ran away innovations stand at their limit, which a regression takes for well predicted.
    runaway = LARGEST * np.count_nonzero(np.abs(now) >= LARGEST)
    return Colour(weights, whitening, sum(likelihoods) - runaway, likelihoods[1])


def whitened(innovations: np.ndarray, colour: Colour, log: Log) -> np.ndarray:
    """White innovations of (P, R, m, K + 1), of the same shape; zero at rows that do not count."""
    return _whitened(innovations, log.counted, LAGS, log.surprises, colour.weights, colour.whitening)


def whitened_change(change: np.ndarray, colour: Colour, log: Log) -> np.ndarray:
    """What a small change of innovations (P, R, m, K + 1) makes of the white ones; the commands do not change."""
    none = np.zeros_like(log.surprises)
    return _whitened(change, log.counted, LAGS, none, colour.weights, colour.whitening)


def _regressed(past: np.ndarray, now: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the past, and the Cholesky factor of the covariance of what they leave."""
    normal = past.T @ past
    normal[np.diag_indices_from(normal)] += 1e-9 * np.trace(normal) / len(normal) + 1e-12
    weights = np.linalg.solve(normal, past.T @ now)
    left = now - past @ weights
    covariance = left.T @ left / len(left)
    ridge = (1e-9 * np.trace(covariance) + 1e-12) * np.eye(len(covariance))
    return weights, np.linalg.cholesky(covariance + ridge)


@cached
def _past_and_present(innovations, counted, lags, surprises):
    recordings, m, _ = innovations.shape
    inputs = surprises.shape[1]
    past = np.zeros((counted.sum(), len(lags) * m + SURPRISES * inputs))
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
                for i in range(SURPRISES):
                    for c in range(inputs):
                        past[n, len(lags) * m + i * inputs + c] = surprises[r, c, k - 1 - i] if k > i else 0.0
                n += 1
    return past, now


@cached
def _whitened(innovations, counted, lags, surprises, weights, whitening):
    models, recordings, m, rows = innovations.shape
    out = np.zeros((models, recordings, m, rows))
    left = np.zeros((m, rows))
    for r in range(recordings):
        first = np.argmax(counted[:, r])  # rows that count follow each other
        last = first + counted[:, r].sum() - 1
        for p in range(models):
            _whiten_one(innovations[p, r], lags, surprises[r], weights, whitening, first, last, left, out[p, r])
    return out


@cached
def _whiten_one(z, lags, surprises, weights, whitening, first, last, left, out):
    """One recording (m, K + 1) of one model; the innermost loops run along its rows."""
    m = len(z)
    for c in range(m):
        left[c, first : last + 1] = z[c, first : last + 1]
        for i in range(len(lags)):
            for d in range(m):
                _subtract(left[c], z[d], weights[i * m + d, c], lags[i], first + lags[i], last)
        for i in range(SURPRISES):
            for d in range(len(surprises)):
                weight = weights[len(lags) * m + i * len(surprises) + d, c]
                _subtract(left[c], surprises[d], weight, 1 + i, max(first, 1 + i), last)
    for c in range(m):
        for d in range(c + 1):
            _subtract(out[c], left[d], -whitening[c, d], 0, first, last)


@cached
def _subtract(series, other, weight, lag, first, last):
    """Take from a series the weighted other one, `lag` rows before."""
    for k in range(first, last + 1):
        series[k] -= weight * other[k - lag]
