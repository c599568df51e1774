"""Does a number move from run to run: what each recording alone would make of it, the others held.

A random-effects model (DerSimonian, Laird 1986, Control. Clin. Trials 7(3)): estimates of single recordings scatter by
their own errors, which are robust, and by how much the number itself moves.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.sandwich import sums_over

UNSEEN = 1e-6  # information below which a recording says nothing of a number


@dataclass(frozen=True)
class Scatter:
    """How a number moves from run to run, in the cube.

    Attributes:
        deviation: Standard deviation between runs.
        low: Least of the runs' estimates, each as far from their mean as it is trusted.
        high: Largest of them.
    """

    deviation: float
    low: float
    high: float


def scatter_of(fit: Fit, runs: np.ndarray, level: float) -> dict[int, Scatter]:
    """Numbers that move, by index.

    Args:
        fit: Of several recordings.
        runs: Number of the recording of every white error, shape of `Fit.white`.
        level: p value below which a number that stays is no explanation.
    """
    if not len(fit.hypothesis.cube):
        return {}
    jacobian, white, run = fit.jacobian[: fit.white.size], fit.white.ravel(), runs.ravel()
    block, count = fit.blocks.ravel(), int(run.max()) + 1
    of_block = np.zeros(int(block.max()) + 1, dtype=np.int64)
    of_block[block] = run
    informed = sums_over(block, jacobian**2)
    scores = sums_over(block, jacobian * white[:, None])
    information = sums_over(of_block, informed)
    shifts = -sums_over(of_block, scores) / np.maximum(information, UNSEEN)
    chance = sums_over(of_block, (scores + informed * shifts[of_block]) ** 2)  # scores at each run's own value
    variances = np.maximum(chance, information) / np.maximum(information, UNSEEN) ** 2
    found = {}
    for i in np.flatnonzero(fit.free):
        seen = information[:, i] > UNSEEN
        scatter = _scatter(shifts[seen, i], variances[seen, i], len(of_block) - count, level)
        if scatter is not None:
            here = float(fit.hypothesis.cube[i])
            found[int(i)] = Scatter(scatter.deviation, max(here + scatter.low, 0.0), min(here + scatter.high, 1.0))
    return found


def _scatter(values: np.ndarray, variances: np.ndarray, spare: int, level: float) -> Scatter | None:
    """How values scatter beyond their variances, which `spare` degrees of freedom tell; None where that is chance."""
    if spare < 1 or len(values) < 2:
        return None
    weights = 1.0 / variances
    mean = float(np.sum(weights * values) / weights.sum())
    squares, others = float(np.sum(weights * (values - mean) ** 2)), len(values) - 1
    if fdtrc(others, spare, squares / others) > level:
        return None
    between = (squares - others) / float(weights.sum() - np.sum(weights**2) / weights.sum())
    trusted = mean + (values - mean) * between / (between + variances)
    return Scatter(float(np.sqrt(between)), float(trusted.min()), float(trusted.max()))
