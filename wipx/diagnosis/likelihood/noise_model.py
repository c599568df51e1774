"""The noise of innovations: an autoregression that turns them into white noise.

A fixed observer leaves innovations that are a stationary linear process whatever the sensors' noise is;
least squares on their past makes them white (Box, Jenkins 1976, Time Series Analysis), and the
likelihood of what remains is that of the recordings. Signals of one group (`RecordingBatch.groups`) share their past.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.law import inlined
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.sim.cache import booleans, cached, cached_for, floats, integers

SURPRISES = 2  # rows before the present whose commands may know of its noise
LARGEST = 1e3  # standard deviations up to which an innovation is counted
LAGS = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])  # rows
NO_SURPRISES = np.zeros((1, 0, 1))


@dataclass(frozen=True)
class NoiseModel:
    """An autoregression of innovations.

    Attributes:
        weights: From past innovations, then from the commands' surprises (see `RecordingBatch.surprises`), to the
            present, shape (len(LAGS) m + SURPRISES inputs, m).
        whitening: Inverse Cholesky factor of what it leaves, shape (m, m).
        by_group: Log-likelihood of the innovations of each group that it was fitted to, up to a constant, shape (G,).
        reported: And of the reported forces.
    """

    weights: np.ndarray
    whitening: np.ndarray
    by_group: np.ndarray
    reported: float

    @property
    def log_likelihood(self) -> float:
        """Of all that it was fitted to, up to a constant."""
        return float(self.by_group.sum()) + self.reported


def noise_model_of(innovations: np.ndarray, data: RecordingBatch) -> NoiseModel:
    """The autoregression of innovations, shape (R, m, K + 1).

    Errors of reported forces have one of their own: what a drive reports beyond the modelled force would explain the
    motion in place of the physics that makes it.
    """
    m, channels = data.signals, len(data.channels)
    inputs = data.surprises.shape[1]
    weights, whitening = np.zeros((len(LAGS) * m + SURPRISES * inputs, m)), np.zeros((m, m))
    # Where the model ran away innovations stand at their limit, which a regression takes for well predicted.
    runaway = LARGEST * np.count_nonzero((np.abs(innovations) >= LARGEST) & data.counted.T[:, None], axis=(0, 2))
    likelihoods = []
    for group in (*data.groups, tuple(range(channels, m))):
        surprises = data.surprises if group and group[0] < channels else NO_SURPRISES
        likelihoods.append(_fit_group(innovations, group, data.counted, surprises, weights, whitening))
        likelihoods[-1] -= float(runaway[list(group)].sum())
    return NoiseModel(weights, whitening, np.array(likelihoods[:-1]), likelihoods[-1])


def _fit_group(
    innovations: np.ndarray,
    group: tuple[int, ...],
    counted: np.ndarray,
    surprises: np.ndarray,
    weights: np.ndarray,
    whitening: np.ndarray,
) -> float:
    """Write weights and whitening of the signals of one group, and return the likelihood of their innovations."""
    if not group:
        return 0.0
    signals, m, rows = list(group), len(whitening), int(counted.sum())
    # Contiguous: numba adds up a strided series one by one.
    products = lagged_products(np.ascontiguousarray(innovations[:, signals]), counted, surprises)
    own, factor = _regressed(products, len(signals), rows)
    past = [lag * m + signal for lag in range(len(LAGS)) for signal in signals]
    known = [*past, *range(len(LAGS) * m, len(LAGS) * m + SURPRISES * surprises.shape[1])]
    weights[np.ix_(known, signals)] = own
    whitening[np.ix_(signals, signals)] = np.linalg.inv(factor)
    return -rows * float(np.log(np.diag(factor)).sum())


def whitened(innovations: np.ndarray, noise_model: NoiseModel, data: RecordingBatch) -> np.ndarray:
    """White innovations of (P, R, m, K + 1), of the same shape; zero at rows that do not count."""
    return _whitened(innovations, data.counted, LAGS, data.surprises, noise_model.weights, noise_model.whitening)


def whitened_change(change: np.ndarray, noise_model: NoiseModel, data: RecordingBatch) -> np.ndarray:
    """What a small change of innovations (P, R, m, K + 1) makes of the white ones; the commands do not change."""
    none = np.zeros_like(data.surprises)
    return _whitened(change, data.counted, LAGS, none, noise_model.weights, noise_model.whitening)


def lagged_products(innovations: np.ndarray, counted: np.ndarray, surprises: np.ndarray) -> np.ndarray:
    """Sums over the rows that count of products of what a regression knows and foretells.

    The present of n signals comes first, then their past, lag by lag, then the commands' surprises: the products are
    X'X of a matrix X (rows, n (1 + len(LAGS)) + SURPRISES inputs), which is nowhere made. Rows that do not count are
    zero in the past of others.

    Args:
        innovations: Of n signals, shape (R, n, K + 1).
        counted: Rows that count, shape (K + 1, R).
        surprises: Of the commands, shape (R, inputs, K + 1); no inputs where they tell nothing.
    """
    lags = np.concatenate([[0], LAGS])
    n, inputs = innovations.shape[1], surprises.shape[1]
    out = np.zeros((n * len(lags) + SURPRISES * inputs,) * 2)
    for r in range(len(innovations)):
        if counted[:, r].any():
            first = int(np.argmax(counted[:, r]))  # rows that count follow each other
            last = first + int(counted[:, r].sum()) - 1
            _add_past(innovations[r], lags, first, last, out)
            if inputs:
                _add_surprises(innovations[r], surprises[r], lags, first, last, out)
    return np.tril(out) + np.tril(out, -1).T


def _regressed(products: np.ndarray, signals: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the past, and the Cholesky factor of the covariance of what they leave."""
    past, cross = products[signals:, signals:], products[signals:, :signals]
    ridge = (1e-9 * np.trace(past) / len(past) + 1e-12) * np.eye(len(past))
    weights = np.linalg.solve(past + ridge, cross)
    taken = np.concatenate([np.eye(signals), -weights])
    covariance = taken.T @ products @ taken / rows
    ridge = (1e-9 * np.trace(covariance) + 1e-12) * np.eye(signals)
    return weights, np.linalg.cholesky(covariance + ridge)


@cached
def _add_past(z, lags, first, last, out):
    """Products of all pairs of lags of a recording's signals (n, K + 1), to the lower triangle.

    Two lags of the same difference see the same products of rows, except for the last few.
    """
    n = len(z)
    together = np.zeros((lags[-1] + 1, n, n))
    for d in range(len(together)):
        for a in range(n):
            for b in range(n):
                together[d, a, b] = _dot(z[a, first + d : last + 1], z[b, first:])
    for j in range(len(lags)):
        for i in range(j + 1):
            d = lags[j] - lags[i]
            for a in range(n):
                for b in range(n):
                    total = together[d, a, b]
                    for k in range(max(first, last - lags[j] + 1), last - d + 1):
                        total -= z[a, k + d] * z[b, k]
                    out[j * n + b, i * n + a] += total


@cached
def _add_surprises(z, surprises, lags, first, last, out):
    """Products of the commands' surprises (inputs, K + 1) with each other and with all lags, to the lower triangle."""
    n, inputs = len(z), len(surprises)
    for i in range(SURPRISES):
        for c in range(inputs):
            row = len(lags) * n + i * inputs + c
            for j in range(len(lags)):
                k = max(first + lags[j], 1 + i)
                for a in range(n):
                    out[row, j * n + a] += _dot(surprises[c, k - 1 - i : last - i], z[a, k - lags[j] :])
            for j in range(i + 1):
                k = max(first, 1 + i)
                for d in range(inputs):
                    column = len(lags) * n + j * inputs + d
                    out[row, column] += _dot(surprises[c, k - 1 - i : last - i], surprises[d, k - 1 - j :])


@inlined
def _dot(x, y):
    """Sum of products of two series, over the rows of the first."""
    total = 0.0
    for k in range(len(x)):
        total += x[k] * y[k]
    return total


@cached_for(floats(4), booleans(2), integers(1), floats(3), floats(2), floats(2))
def _whitened(innovations, counted, lags, surprises, weights, whitening):
    models, recordings, m, rows = innovations.shape
    out = np.zeros((models, recordings, m, rows))
    before = lags[-1]
    known, left = np.zeros((m, before + rows)), np.zeros((m, rows))
    for r in range(recordings):
        first = np.argmax(counted[:, r])  # rows that count follow each other
        count = counted[:, r].sum()
        for p in range(models):
            known[:, before : before + count] = innovations[p, r, :, first : first + count]
            for c in range(m):
                left[c, :count] = known[c, before : before + count]
                for d in range(m):
                    of_past = weights[d : len(lags) * m : m, c]
                    if of_past.any():
                        _subtract_past(left[c, :count], known[d], lags, of_past)
                _subtract_surprises(left[c, :count], surprises[r], first, weights[len(lags) * m :, c])
            for c in range(m):
                for d in range(c + 1):
                    if whitening[c, d] != 0.0:
                        _subtract(out[p, r, c, first : first + count], left[d], -whitening[c, d])
    return out


@inlined
def _subtract_past(series, known, lags, weights):
    """Take from a series what the lags of another foretell, which begins lags[-1] rows earlier."""
    for i in range(0, len(lags), 2):  # two at a time: half as often through the series
        near, far = known[lags[-1] - lags[i] :], known[lags[-1] - lags[i + 1] :]
        for k in range(len(series)):
            series[k] -= weights[i] * near[k] + weights[i + 1] * far[k]


@inlined
def _subtract_surprises(series, surprises, first, weights):
    """Take from a series, which begins at row `first`, what the commands' surprises foretell."""
    inputs = len(surprises)
    for i in range(SURPRISES):
        for d in range(inputs):
            begin = max(first, 1 + i)
            _subtract(series[begin - first :], surprises[d, begin - 1 - i :], weights[i * inputs + d])


@inlined
def _subtract(series, other, weight):
    """Take from a series the weighted other one."""
    for k in range(len(series)):
        series[k] -= weight * other[k]
