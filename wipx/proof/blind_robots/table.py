"""Figures over many scored cases: counts with intervals, by tier and by contrast, confusions and misses."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, isfinite

import numpy as np
from scipy.stats import beta

from wipx.proof.blind_robots.cases import DIRTY_TIERS, TIERS
from wipx.proof.blind_robots.score import CaseScore, ParameterScore
from wipx.proof.blind_robots.trees.cases import TREE_TIERS

CONFIDENCE = 0.95
CONTRASTS = (3.0, 10.0, 30.0, 100.0)  # edges of the bins of signal to noise


@dataclass(frozen=True)
class Count:
    """How often something was right, of so many times that it could be.

    Attributes:
        right: Successes.
        total: Trials.
    """

    right: int
    total: int

    @property
    def interval(self) -> tuple[float, float]:
        """Exact 95 % interval of the rate (Clopper and Pearson 1934)."""
        tail = 0.5 * (1.0 - CONFIDENCE)
        low = float(beta.ppf(tail, self.right, self.total - self.right + 1)) if self.right > 0 else 0.0
        high = float(beta.ppf(1.0 - tail, self.right + 1, self.total - self.right)) if self.right < self.total else 1.0
        return low, high

    def __str__(self) -> str:
        if self.total == 0:
            return "-"
        low, high = self.interval
        return f"{self.right}/{self.total} = {self.right / self.total:.2f} [{low:.2f}, {high:.2f}]"


@dataclass(frozen=True)
class GroupScore:
    """Scores of some of the cases.

    Attributes:
        name: What they have in common; "all" for every case.
        cases: How many.
        failures: Cases without an answer.
        exact: Sets of effects that are exactly right.
        verdict: Right verdicts.
        false_alarms: Cases in which physics was reported that is not hidden.
        site: Right sites.
        flagged: Outside physics that was called unexplained.
        aliased: Outside physics that was explained away.
        covered: True parameters that lie in their 95 % intervals.
        parameter_error: Median relative error of the parameters of effects that were found; None without.
        region_error: Median of 1 - intersection / union for sticky spots.
        time_error: The same for events.
        removed: Median share of the explainable squared error on unseen recordings that is gone.
        over_floor: Median error there over what a perfect model would leave.
        seconds: Median time [s].
        slowest: Longest time [s].
    """

    name: str
    cases: int
    failures: int
    exact: Count
    verdict: Count
    false_alarms: Count
    site: Count
    flagged: Count
    aliased: Count
    covered: Count
    parameter_error: float | None
    region_error: float | None
    time_error: float | None
    removed: float | None
    over_floor: float | None
    seconds: float
    slowest: float


def by_tier(scores: Sequence[CaseScore]) -> tuple[GroupScore, ...]:
    """Scores by tier, exact robots first, dirty ones, trees, and of all cases; tiers without cases are left out."""
    groups = [(tier, [one for one in scores if one.tier == tier]) for tier in (*TIERS, *DIRTY_TIERS, *TREE_TIERS)]
    return tuple(group_score(name, group) for name, group in [*groups, ("all", list(scores))] if group)


def by_contrast(scores: Sequence[CaseScore]) -> tuple[GroupScore, ...]:
    """Scores of the cases with hidden physics by `CaseScore.contrast`, the faintest first; empty bins are left out."""
    found = []
    for low, high in pairwise((0.0, *CONTRASTS, inf)):
        group = [one for one in scores if one.contrast is not None and low <= one.contrast < high]
        name = f"{low:g} to {high:g}" if isfinite(high) else f"over {low:g}"
        found += [group_score(name, group)] if group else []
    return tuple(found)


def group_score(name: str, scores: Sequence[CaseScore]) -> GroupScore:
    """The score of some cases, one at least."""
    parameters = [parameter for one in scores for parameter in one.parameters]
    return GroupScore(
        name=name,
        cases=len(scores),
        failures=sum(one.failure != "" for one in scores),
        exact=_count(one.exact for one in scores),
        verdict=_count(one.verdict_right for one in scores),
        false_alarms=_count(one.accused for one in scores),
        site=_count(one.site_right for one in scores),
        flagged=_count(one.flagged for one in scores),
        aliased=_count(one.aliased for one in scores),
        covered=_count(parameter.covered for parameter in parameters),
        parameter_error=median(parameter.error for parameter in parameters),
        region_error=median(one.region_error for one in scores),
        time_error=median(one.time_error for one in scores),
        removed=median(one.removed for one in scores),
        over_floor=median(one.over_floor for one in scores),
        seconds=median(one.seconds for one in scores) or 0.0,
        slowest=max(one.seconds for one in scores),
    )


def nothing_hidden(scores: Sequence[CaseScore]) -> tuple[CaseScore, ...]:
    """Cases in which the nominal model is complete."""
    return tuple(one for one in scores if not one.truth and one.outside is None)


def _count(answers: Iterable[bool | None]) -> Count:
    known = [answer for answer in answers if answer is not None]
    return Count(sum(known), len(known))


def median(values: Iterable[float | None]) -> float | None:
    """Median of the values that are known; None without any."""
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def misses(scores: Sequence[CaseScore]) -> tuple[CaseScore, ...]:
    """Cases with a wrong set of effects, a wrong verdict or no answer, the worst first.

    First those without an answer, then false alarms (where nothing is hidden first), then what was missed although
    it shows well.
    """
    wrong = [one for one in scores if one.exact is False or not one.verdict_right]
    return tuple(sorted(wrong, key=lambda one: (one.failure == "", not one.accused, -_shows(one), one.case)))


def _shows(one: CaseScore) -> float:
    return inf if one.contrast is None else one.contrast


def confusions(scores: Sequence[CaseScore]) -> Counter[tuple[str, str]]:
    """How often a single hidden effect (or nothing, or outside physics) was answered by what.

    Keys are (hidden, answered); several names in one answer are joined by " + ".
    """
    pairs: Counter[tuple[str, str]] = Counter()
    for one in scores:
        if len(one.truth) > 1:
            continue
        hidden = one.truth[0] if one.truth else f"outside: {one.outside}" if one.outside else "nothing"
        if one.failure:
            answered = "no answer"
        elif one.verdict == "unexplained":
            answered = "unexplained"
        elif one.exact and one.truth:
            answered = hidden
        else:
            answered = " + ".join(one.answer) or "nothing"
        pairs[hidden, answered] += 1
    return pairs


def is_right(hidden: str, answered: str) -> bool:
    """Whether an entry of `confusions` is a right answer."""
    return hidden == answered or (hidden.startswith("outside: ") and answered == "unexplained")


def parameter_groups(scores: Sequence[CaseScore]) -> dict[str, list[ParameterScore]]:
    """Identified parameters of all cases by name, sorted."""
    groups: dict[str, list[ParameterScore]] = {}
    for one in scores:
        for parameter in one.parameters:
            groups.setdefault(parameter.name, []).append(parameter)
    return dict(sorted(groups.items()))


def covered(parameters: Iterable[ParameterScore]) -> Count:
    """How many true values lie in their 95 % intervals."""
    return _count(parameter.covered for parameter in parameters)
