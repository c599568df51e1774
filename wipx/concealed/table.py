"""Tables over many scored cases: counts with intervals, parameters, and the cases that were missed."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from wipx.concealed.cases import TIERS
from wipx.concealed.score import CaseScore, ParameterScore

CONFIDENCE = 0.95


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
class TierScore:
    """Scores of the cases of one tier.

    Attributes:
        tier: Its name; "all" for every case.
        cases: How many.
        failures: Cases without an answer.
        exact: Sets of effects that are exactly right.
        verdict: Right verdicts.
        false_alarms: Cases in which something was named that was not hidden.
        site: Right sites.
        flagged: Outside physics that was called unexplained.
        aliased: Outside physics that was explained away.
        covered: True parameters that lie in their 95 % intervals.
        parameter_error: Median relative error of the parameters of effects that were found; None without.
        region_error: Median of 1 - intersection / union for sticky spots.
        time_error: The same for events.
        removed: Median share of the explainable squared error on unseen recordings that is gone.
        seconds: Median time [s].
        slowest: Longest time [s].
    """

    tier: str
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
    seconds: float
    slowest: float


def tier_scores(scores: Sequence[CaseScore]) -> tuple[TierScore, ...]:
    """Scores by tier, in the order of `TIERS`, and of all cases; tiers without cases are left out."""
    groups = [(tier, [one for one in scores if one.tier == tier]) for tier in TIERS]
    return tuple(_tier_score(name, group) for name, group in [*groups, ("all", list(scores))] if group)


def _tier_score(tier: str, scores: Sequence[CaseScore]) -> TierScore:
    parameters = [parameter for one in scores for parameter in one.parameters]
    return TierScore(
        tier=tier,
        cases=len(scores),
        failures=sum(one.failure != "" for one in scores),
        exact=_count(one.exact for one in scores),
        verdict=_count(one.verdict_right for one in scores),
        false_alarms=_count(one.false_alarms > 0 for one in scores if one.outside is None),
        site=_count(one.site_right for one in scores),
        flagged=_count(one.flagged for one in scores),
        aliased=_count(one.aliased for one in scores),
        covered=_count(parameter.covered for parameter in parameters),
        parameter_error=_median(parameter.error for parameter in parameters),
        region_error=_median(one.region_error for one in scores),
        time_error=_median(one.time_error for one in scores),
        removed=_median(one.removed for one in scores),
        seconds=_median(one.seconds for one in scores) or 0.0,
        slowest=max(one.seconds for one in scores),
    )


def _count(answers: Iterable[bool | None]) -> Count:
    known = [answer for answer in answers if answer is not None]
    return Count(sum(known), len(known))


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def misses(scores: Sequence[CaseScore]) -> tuple[CaseScore, ...]:
    """Cases with a wrong set of effects, a wrong verdict or no answer."""
    return tuple(one for one in scores if one.exact is False or not one.verdict_right)


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


_COLUMNS: tuple[tuple[str, Callable[[TierScore], str]], ...] = (
    ("tier", lambda s: s.tier),
    ("cases", lambda s: str(s.cases)),
    ("exact set", lambda s: str(s.exact)),
    ("verdict right", lambda s: str(s.verdict)),
    ("with false alarm", lambda s: str(s.false_alarms)),
    ("site right", lambda s: str(s.site)),
    ("flagged outside", lambda s: str(s.flagged)),
    ("silently aliased", lambda s: str(s.aliased)),
    ("ci95 covers", lambda s: str(s.covered)),
    ("parameter error", lambda s: _number(s.parameter_error)),
    ("region error", lambda s: _number(s.region_error)),
    ("time error", lambda s: _number(s.time_error)),
    ("error removed", lambda s: _number(s.removed)),
    ("seconds, median (max)", lambda s: f"{s.seconds:.1f} ({s.slowest:.1f})"),
    ("failed", lambda s: str(s.failures)),
)


def markdown(scores: Sequence[CaseScore]) -> str:
    """All tables as Markdown: tiers, parameters, misses."""
    names = [name for name, _ in _COLUMNS]
    tiers = [[show(tier) for _, show in _COLUMNS] for tier in tier_scores(scores)]
    parts = [
        "# Diagnoses of concealed physics\n",
        "Counts as right/total = rate [exact 95 % interval]; errors are medians.\n",
        _table(names, tiers),
        "\n## Parameters of effects that were found\n",
        _table(["parameter", "found", "median relative error", "ci95 covers"], _parameter_rows(scores)),
        "\n## Misses\n",
        _table(["case", "tier", "plant", "hidden", "answer", "verdict"], [_miss_row(one) for one in misses(scores)]),
    ]
    return "\n".join(parts) + "\n"


def _parameter_rows(scores: Sequence[CaseScore]) -> list[list[str]]:
    groups: dict[str, list[ParameterScore]] = {}
    for one in scores:
        for parameter in one.parameters:
            groups.setdefault(parameter.name, []).append(parameter)
    return [
        [name, str(len(group)), _number(_median(p.error for p in group)), str(_count(p.covered for p in group))]
        for name, group in sorted(groups.items())
    ]


def _miss_row(one: CaseScore) -> list[str]:
    hidden = [*one.truth, *([] if one.outside is None else [f"outside: {one.outside}"])]
    answer = one.failure or ", ".join(one.answer) or "nothing"
    return [one.case, one.tier, one.plant, ", ".join(hidden) or "nothing", answer, one.verdict]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _table(names: list[str], rows: list[list[str]]) -> str:
    lines = [names, ["---"] * len(names), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in line) + " |" for line in lines
    )
