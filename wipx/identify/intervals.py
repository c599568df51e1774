"""95 % intervals of identified numbers."""

import numpy as np
from scipy.special import stdtrit

from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.problem import SLOPE_STEP, WindowProblem

SMOOTHING = 0.01  # share of the joints' speeds over which dry friction builds up
FIRST_STEP = 0.01  # of the search interval; wide enough for slopes that jump
UNSEEN = 1e-8  # standard deviation in shares of the interval, below which it is that of a number without any slope
ROUNDS = 3  # of matching the finite-difference step to the deviation that it yields


def covariance(problem: WindowProblem | ClosedLoopProblem, cube: np.ndarray) -> tuple[np.ndarray, int]:
    """Covariance (D, D) of the minimum at a position of the unit cube, and its number of clusters.

    Clustered sandwich (White 1982; Liang and Zeger 1986): the scores of whole windows, or of whole trials, are the
    independent pieces, so errors may be coloured within one and grow along it, and the
    noise level need not be known. Slopes are secants over about one standard deviation on a
    slightly smoothed problem, since a sticking joint answers in jumps.
    """
    smooth = problem.smoothed(SMOOTHING)
    step = np.full(len(cube), FIRST_STEP)
    matrix, clusters = np.zeros((len(cube), len(cube))), 0
    for _ in range(ROUNDS):
        slopes = smooth.jacobian(cube, step)
        scores = problem.scores(cube, slopes)
        clusters = len(scores)
        matrix = _sandwich(slopes, scores)
        deviation = np.sqrt(np.diag(matrix))
        step = np.where(deviation < UNSEEN, 10.0 * step, deviation).clip(SLOPE_STEP, 0.2)
    return matrix, clusters


def _sandwich(slopes: np.ndarray, scores: np.ndarray) -> np.ndarray:
    bread = np.linalg.pinv(slopes.T @ slopes, rcond=1e-12, hermitian=True)
    clusters, dimension = scores.shape
    return bread @ (scores.T @ scores) @ bread * (clusters / max(clusters - dimension, 1))


def intervals(problem: WindowProblem | ClosedLoopProblem, cube: np.ndarray) -> np.ndarray:
    """Lower and upper ends of the 95 % intervals within the search intervals, shape (D, 2) [SI]."""
    matrix, clusters = covariance(problem, cube)
    deviation = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    deviation = np.where(deviation < UNSEEN, np.inf, deviation)
    reach = stdtrit(max(clusters - len(cube), 1), 0.975) * deviation
    low, high = np.maximum(cube - reach, 0.0), np.minimum(cube + reach, 1.0)
    return np.stack([problem.space.to_values(low), problem.space.to_values(high)], axis=1)
