"""A race of fits: candidates are fitted step by step, side by side, and drop out once they cannot win."""

from collections.abc import Callable, Sequence

from wipx.diagnosis.likelihood.fitting import Climb, Fit
from wipx.diagnosis.selection.criteria import score

CLOSE = 0.5  # of the best score, up to which a candidate stays in the race
FURTHER = 5.0  # times what a linear model expects of a step that a fit may still gain; 2 was too few on a real robot


def run(
    stepped: Callable[[Sequence[Climb]], list[Climb]], base: Fit, starts: Sequence[Sequence[Climb]], steps: int
) -> list[list[Fit]]:
    """Fits of all candidates, from each of their starts, as far as they came.

    Args:
        stepped: Brings several fits one step further each.
        base: From which on evidence is counted.
        starts: Of each candidate.
        steps: At most, from each start.
    """
    runners = [[*own] for own in starts]
    for _ in range(steps):
        running = [(c, i) for c, own in enumerate(runners) for i, climb in enumerate(own) if not climb.has_arrived]
        least = least_score([climb.fit for own in runners for climb in own], base, CLOSE)
        going_on = [(c, i) for c, i in running if _may_win(runners[c][i], runners[c], base, least)]
        if not going_on:
            break
        climbs = stepped([runners[c][i] for c, i in going_on])
        for (c, i), climb in zip(going_on, climbs, strict=True):
            runners[c][i] = climb
    return [[climb.fit for climb in own] for own in runners]


def least_score(fits: Sequence[Fit], base: Fit, share: float) -> float:
    """A share of the best score beyond a base; the best one itself where that is negative."""
    best = max((score(fit, base) for fit in fits), default=0.0)
    return min(best, share * best)


def _may_win(climb: Climb, own: Sequence[Climb], base: Fit, least: float) -> bool:
    """Whether a fit may still reach a score, and the best of those from other starts of its candidate."""
    if climb.close:
        return True
    further = FURTHER * climb.expected
    leading = max(other.fit.log_likelihood for other in own)
    return score(climb.fit, base) + further >= least and climb.fit.log_likelihood + further >= leading
