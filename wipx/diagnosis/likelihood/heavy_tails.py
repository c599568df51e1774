"""Errors with heavy tails: the multivariate t distribution (Lange, Little, Taylor 1989, J. Am. Stat. Assoc. 84).

Single predictions fall over; they must not decide what the others say.
"""

import numpy as np

TAILS = 5.0  # degrees of freedom
ROUNDS = 12  # of expectation and maximisation


def fitted_whitening(errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The scale matrix of errors, by expectation and maximisation.

    Args:
        errors: Of P models, N predictions of E errors each, shape (P, N, E).

    Returns:
        whitening: Inverse Cholesky factors, shape (P, E, E).
        log_likelihoods: Shape (P,), up to a constant.
    """
    count, size = errors.shape[1:]
    weights = np.ones(errors.shape[:2])
    prior = size + 1.0  # errors' worth of what is known of correlations beforehand: nothing
    for _ in range(ROUNDS):
        scale = np.einsum("pna,pnb->pab", errors * weights[..., None], errors) / count
        diagonal = np.einsum("paa->pa", scale)
        scale = scale * count / (count + prior)
        scale[:, np.arange(size), np.arange(size)] = np.maximum(diagonal, 1e-12)
        whitening = np.linalg.inv(np.linalg.cholesky(scale))
        squares = np.sum(np.einsum("pab,pnb->pna", whitening, errors) ** 2, axis=2)
        weights = (TAILS + size) / (TAILS + squares)
    determinants = np.log(np.einsum("paa->pa", whitening)).sum(axis=1)
    sums = 0.5 * (TAILS + size) * np.log1p(squares / TAILS).sum(axis=1)
    return whitening, count * determinants - sums


def shrunk(white: np.ndarray) -> np.ndarray:
    """White errors (..., E), half of whose squares are what each prediction loses of its log-likelihood."""
    squares = np.maximum(np.sum(white**2, axis=-1, keepdims=True), 1e-12)
    worth = (TAILS + white.shape[-1]) * np.log1p(squares / TAILS)
    return white * np.sqrt(worth / squares)
