"""The best of many guesses that lie side by side, of which neighbours say the same."""

from collections.abc import Callable

import numpy as np


def peaks(gains: np.ndarray, count: int, alike: Callable[[int], np.ndarray]) -> list[int]:
    """Indices of the guesses that gain most, best first, none of which is like a better one.

    Args:
        gains: What each guess gains, shape (N,); those that gain nothing are left out.
        count: Of indices, at most.
        alike: Which guesses (N,) are like one of them, itself included.
    """
    chosen: list[int] = []
    left = gains > 0.0
    for i in np.argsort(-gains).tolist():
        if len(chosen) == count:
            break
        if left[i]:
            chosen.append(i)
            left &= ~alike(i)
    return chosen
