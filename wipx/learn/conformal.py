"""Intervals by split conformal prediction: an error that fresh robots exceed one time in ten.

The half-width is a quantile of the absolute errors on robots that took no part in the training. It is the same for
all pitches and holds on average over robots drawn as those were: not for each load by itself, and not for a robot
that the simulation does not resemble (Lei, G'Sell, Rinaldo, Tibshirani and Wasserman 2018, Sec. 2.2).
"""

from math import ceil

import numpy as np

from wipx.core.errors import InputError


def half_width(errors: np.ndarray, coverage: float) -> float:
    """The smallest half-width that a fresh error stays within with probability `coverage` at least.

    Args:
        errors: On robots that took no part in training or stopping, shape (n,) [rad].
        coverage: Of the interval, in (0, 1).

    Raises:
        InputError: as in `rank`.
    """
    return float(np.sort(np.abs(errors))[rank(len(errors), coverage) - 1])


def rank(robots: int, coverage: float) -> int:
    """Which of n absolute errors, by size from 1, is the half-width: ceil((n + 1) coverage).

    The fresh error counts among n + 1 that are alike.

    Raises:
        InputError: it would be beyond the last one.
    """
    slack = 1e-9  # 0.9 * 10 is 9, not a rounding error more
    number = ceil((robots + 1) * coverage - slack)
    if number > robots:
        needed = ceil(coverage / (1.0 - coverage) - slack)
        raise InputError(
            f"estimator: {robots} validation robots to calibrate the {100 * coverage:g} % interval on, expected "
            f"{needed} at least; make a larger training set"
        )
    return number
