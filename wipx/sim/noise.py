"""Measurement noise of a simulated loop."""

import numpy as np

AMPLITUDE, SPREAD, FREQUENCY = 0.01, 0.5, 0.0002  # A, B, f [Hz] of the paper, Eq. 6


def paper_noise(
    t: np.ndarray,
    shape: tuple[int, ...],
    rng: np.random.Generator,
    *,
    amplitude: float = AMPLITUDE,
    spread: float = SPREAD,
    frequency: float = FREQUENCY,
) -> np.ndarray:
    """The paper's high-frequency noise w = A cos(2 pi f t) B N(0, 1), Eq. 6.

    With the paper's f = 0.0002 Hz the cosine is 1 over any recording: white noise of standard
    deviation A B = 0.005 on every observed signal, as `AnalyticSimulator.close_loop` takes it.

    Args:
        t: Time of each row, shape (K,) [s].
        shape: Shape of one row, e.g. (2 joints, P, R).
        rng: Source of the normal numbers.
        amplitude: A [unit of the signal].
        spread: B [1].
        frequency: f [Hz].

    Returns:
        Noise of shape (K, *shape) [unit of the signal].
    """
    envelope = amplitude * np.cos(2.0 * np.pi * frequency * t)
    return envelope.reshape(-1, *(1 for _ in shape)) * spread * rng.normal(size=(len(t), *shape))
