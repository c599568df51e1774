"""95 % intervals of identified numbers."""

import numpy as np
from scipy import stats

from wipx.identify.problem import SLOPE_STEP, WindowProblem

SMOOTHING = 0.01  # share of the joints' speeds over which dry friction builds up
ROUNDS = 3  # of matching the finite-difference step to the deviation that it yields


def covariance(problem: WindowProblem, cube: np.ndarray) -> tuple[np.ndarray, int]:
    """Covariance (D, D) of the minimum at a position of the unit cube, and its number of clusters.

    Clustered sandwich (White 1982; Liang and Zeger 1986): the scores of whole windows are the
    independent pieces, so errors may be coloured within a window and grow along it, and the
    noise level need not be known. Slopes are secants over about one standard deviation on a
    slightly smoothed problem, since a sticking joint answers in jumps.
    """
    residuals = problem.residuals(cube)
    groups = problem.by_window(residuals)
    smooth = problem.smoothed(SMOOTHING)
    step = np.full(len(cube), SLOPE_STEP)
    matrix = np.zeros((len(cube), len(cube)))
    for _ in range(ROUNDS):
        matrix = _sandwich(smooth.jacobian(cube, step), residuals, groups)
        step = np.clip(np.sqrt(np.diag(matrix)), 1e-6, 0.2)
    return matrix, len(groups)


def _sandwich(jacobian: np.ndarray, residuals: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    scores = np.array([jacobian[g].T @ residuals[g] for g in groups])
    bread = np.linalg.pinv(jacobian.T @ jacobian, rcond=1e-12, hermitian=True)
    clusters, dimension = scores.shape
    return bread @ (scores.T @ scores) @ bread * (clusters / max(clusters - dimension, 1))


def intervals(problem: WindowProblem, cube: np.ndarray) -> np.ndarray:
    """Lower and upper ends of the 95 % intervals within the search intervals, shape (D, 2) [SI]."""
    matrix, clusters = covariance(problem, cube)
    deviation = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    reach = stats.t.ppf(0.975, max(clusters - len(cube), 1)) * deviation
    low, high = np.maximum(cube - reach, 0.0), np.minimum(cube + reach, 1.0)
    return np.stack([problem.space.to_values(low), problem.space.to_values(high)], axis=1)
