"""The colour of innovations: autoregressions become white, and their likelihoods are those of Gaussian processes."""

import numpy as np
import pytest
from scipy.signal import lfilter

from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.noise_model import LAGS, SURPRISES, lagged_products, noise_model_of, whitened
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch

ROWS = 6000
AR2 = (1.2, -0.5)  # z[k] = 1.2 z[k-1] - 0.5 z[k-2] + e[k]


def empty_log(recordings: int = 1, rows: int = ROWS) -> RecordingBatch:
    """A log whose rows alone matter."""
    t = 0.01 * np.arange(rows)
    zeros = {"t": t, "x": np.zeros(rows), "u": np.zeros(rows)}
    return RecordingBatch.of(tuple(Recording(f"r{r}", zeros) for r in range(recordings)), plant_of("linear_axis"))


def autoregression(rng: np.random.Generator, recordings: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """An AR(2) series and what drives it, shape (R, 1, ROWS) each."""
    kicks = rng.normal(size=(recordings, 1, ROWS))
    return np.asarray(lfilter([1.0], [1.0, -AR2[0], -AR2[1]], kicks)), kicks


def counted(white: np.ndarray, data: RecordingBatch) -> np.ndarray:
    return white[0, 0, 0, data.counted[:, 0]]


def test_an_autoregression_becomes_white(fresh_seed: int):
    data = empty_log()
    series, kicks = autoregression(np.random.default_rng(fresh_seed))
    noise_model = noise_model_of(series, data)
    white = counted(whitened(series[None], noise_model, data), data)[LAGS[-1] :]
    assert np.var(white) == pytest.approx(1.0, abs=0.02)
    for lag in (1, 2, 3, 7):
        assert abs(np.mean(white[lag:] * white[:-lag])) < 4.5 / np.sqrt(len(white))
    driving = kicks[0, 0, data.counted[:, 0]][LAGS[-1] :]
    assert np.corrcoef(white, driving)[0, 1] > 0.99
    # Standard error of a coefficient: below 0.02 with 6000 rows.
    np.testing.assert_allclose(noise_model.weights[:2, 0], AR2, atol=0.1)


def test_white_noise_stays_as_it_is(fresh_seed: int):
    data = empty_log()
    kicks = np.random.default_rng(fresh_seed).normal(size=(1, 1, ROWS))
    noise_model = noise_model_of(kicks, data)
    np.testing.assert_allclose(noise_model.weights, 0.0, atol=5.0 / np.sqrt(ROWS))
    assert (
        np.corrcoef(counted(whitened(kicks[None], noise_model, data), data), kicks[0, 0, data.counted[:, 0]])[0, 1]
        > 0.99
    )


def test_likelihood_ratio_is_that_of_gaussian_processes(fresh_seed: int):
    data = empty_log()
    series, kicks = autoregression(np.random.default_rng(fresh_seed))
    n = int(data.counted.sum())
    # An autoregression and what drives it have the same density: the map between them has determinant one. Each
    # fits ten weights, worth 5 +- 2 nats; the rows before the first one that counts are worth a few more.
    assert noise_model_of(series, data).log_likelihood == pytest.approx(
        noise_model_of(kicks, data).log_likelihood, abs=20.0
    )
    # Half as large noise is likelier by log 2 a row, exactly.
    ratio = noise_model_of(0.5 * kicks, data).log_likelihood - noise_model_of(kicks, data).log_likelihood
    assert ratio == pytest.approx(n * np.log(2.0), abs=0.01)
    # Beside white noise of the same variance the autoregression is likelier by what it predicts.
    phi1, phi2 = AR2
    variance = (1.0 - phi2) / ((1.0 + phi2) * ((1.0 - phi2) ** 2 - phi1**2))
    alike = noise_model_of(np.sqrt(variance) * kicks, data).log_likelihood
    gain = noise_model_of(series, data).log_likelihood - alike
    assert gain == pytest.approx(0.5 * n * np.log(variance), abs=20.0)


def test_recordings_do_not_colour_each_other(fresh_seed: int):
    series, _ = autoregression(np.random.default_rng(fresh_seed), 2)
    both, one = empty_log(2), empty_log(1)
    noise_model = noise_model_of(series, both)
    together = whitened(series[None], noise_model, both)
    for r in range(2):
        np.testing.assert_allclose(together[0, r], whitened(series[None, r : r + 1], noise_model, one)[0, 0])


def test_a_model_that_ran_away_is_the_least_likely():
    data = empty_log()
    lost = np.full((1, 1, ROWS), 1e3)
    noise = np.random.default_rng(0).normal(size=(1, 1, ROWS))
    assert noise_model_of(lost, data).log_likelihood < noise_model_of(100.0 * noise, data).log_likelihood


def design(innovations: np.ndarray, counted: np.ndarray, surprises: np.ndarray) -> np.ndarray:
    """Present, past and surprises at every row that counts, one column each."""
    blocks = []
    for r in range(len(innovations)):
        seen = np.where(counted[:, r], innovations[r], 0.0)
        columns = [np.roll(series, lag) * (np.arange(len(series)) >= lag) for lag in [0, *LAGS] for series in seen]
        columns += [np.roll(series, 1 + i) for i in range(SURPRISES) for series in surprises[r]]
        blocks.append(np.array(columns).T[counted[:, r]])
    return np.concatenate(blocks)


def ragged(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Innovations (3, 4, 200), rows that count (200, 3), few in the last recording, and surprises (3, 2, 200)."""
    counted = np.zeros((200, 3), dtype=bool)
    counted[15:200, 0] = counted[12:150, 1] = counted[20:40, 2] = True
    return rng.normal(size=(3, 4, 200)), counted, rng.normal(size=(3, 2, 200))


def test_products_are_those_of_the_matrix_of_lagged_rows(fresh_seed: int):
    innovations, counted, surprises = ragged(np.random.default_rng(fresh_seed))
    for begin, end, known in ((0, 4, surprises), (0, 3, surprises[:, :0]), (3, 4, surprises[:, :0])):
        matrix = design(innovations[:, begin:end], counted, known)
        found = lagged_products(innovations[:, begin:end], counted, known)
        np.testing.assert_allclose(found, matrix.T @ matrix, atol=1e-10)


def test_a_colour_is_the_least_squares_fit_and_leaves_white_what_it_does_not_foretell(fresh_seed: int):
    data = empty_log(2)
    series, _ = autoregression(np.random.default_rng(fresh_seed), 2)
    noise_model = noise_model_of(series, data)
    matrix = design(series, data.counted, data.surprises)
    now, past = matrix[:, :1], matrix[:, 1:]
    weights = np.linalg.lstsq(past, now, rcond=None)[0]
    left = (now - past @ weights)[:, 0]
    np.testing.assert_allclose(noise_model.weights, weights, atol=1e-6)
    # The ridge of a billionth, times half the 12000 rows.
    assert noise_model.log_likelihood == pytest.approx(-0.5 * len(left) * np.log(np.mean(left**2)), abs=1e-4)
    white = whitened(series[None], noise_model, data)[0, :, 0][data.counted.T]
    np.testing.assert_allclose(white, left / np.sqrt(np.mean(left**2)), atol=1e-5)
