"""Figures over many scored dirty robots."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.proof.blind_robots.score import CaseScore
from wipx.proof.blind_robots.table import Count


@dataclass(frozen=True)
class DirtyGroup:
    """Scores of some dirty robots.

    Attributes:
        name: What they have in common.
        cases: How many.
        named: Dominant effects that were named.
        kin: Further ones for which another law of the same physics was named.
        corrected: Named laws that correct what the owner has wrong.
        false_laws: Other named laws.
        accused: Robots with such a law.
        over_reference: Errors on unseen recordings over those of the fitted true effects, sorted.
        seconds: Median time [s].
        failures: Robots without an answer.
    """

    name: str
    cases: int
    named: Count
    kin: Count
    corrected: int
    false_laws: int
    accused: Count
    over_reference: tuple[float, ...]
    seconds: float
    failures: int

    def error(self, quantile: float) -> float | None:
        """Quantile of the error over that of the fitted true effects; None without any."""
        return float(np.quantile(self.over_reference, quantile)) if self.over_reference else None


def dirty_group(name: str, scores: Sequence[CaseScore]) -> DirtyGroup:
    """The score of some dirty robots, one at least."""
    parts = [one.dirty for one in scores if one.dirty is not None]
    answered = [one.dirty for one in scores if one.dirty is not None and not one.failure]
    dominant = sum(part.dominant for part in parts)
    return DirtyGroup(
        name=name,
        cases=len(parts),
        named=Count(sum(part.named for part in parts), dominant),
        kin=Count(sum(part.kin for part in parts), dominant),
        corrected=sum(part.corrected for part in parts),
        false_laws=sum(part.false_laws for part in parts),
        accused=Count(sum(part.false_laws > 0 for part in answered), len(answered)),
        over_reference=tuple(sorted(part.over_reference for part in parts if part.over_reference is not None)),
        seconds=float(np.median([one.seconds for one in scores])),
        failures=sum(one.failure != "" for one in scores),
    )


def dirty_groups(scores: Sequence[CaseScore]) -> tuple[DirtyGroup, ...]:
    """Dirty robots by the number of their dominant effects, all with any, and those with dirt only."""
    dirty = [one for one in scores if one.dirty is not None]
    counts = ((1, "one effect"), (2, "two effects"), (3, "three effects"))
    parts = [(name, [one for one in dirty if len(one.truth) == count]) for count, name in counts]
    parts.append(("all with effects", [one for one in dirty if one.truth]))
    parts.append(("dirt only", [one for one in dirty if not one.truth]))
    return tuple(dirty_group(name, part) for name, part in parts if part)
