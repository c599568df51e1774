"""Identified numbers as rows of a page's table, with their intervals drawn."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from wipx.core.results import Estimate
from wipx.report.outcome import remark
from wipx.report.tables import estimate_rows


@dataclass(frozen=True)
class IntervalMark:
    """Where an estimate's interval lies beside its value before, as positions from 0 to 100.

    Attributes:
        before: Of the value before the identification.
        value: Of the identified value.
        low: Of the lower end.
        high: Of the upper end.
    """

    before: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class EstimateRow:
    """A row of a page's table of identified parameters, ready to print.

    Attributes:
        cells: Texts under `tables.ESTIMATES_HEAD`.
        mark: The interval drawn beside the value before; None where an end is unknown.
        doubtful: Whether the remark is a warning.
    """

    cells: tuple[str, ...]
    mark: IntervalMark | None
    doubtful: bool


def marked_rows(estimates: Sequence[Estimate]) -> list[EstimateRow]:
    """One row per estimate."""
    pairs = zip(estimates, estimate_rows(estimates), strict=True)
    return [EstimateRow(cells, _mark(estimate), doubtful=bool(remark(estimate))) for estimate, cells in pairs]


def _mark(estimate: Estimate) -> IntervalMark | None:
    numbers = (estimate.nominal, estimate.value, estimate.low, estimate.high)
    left, right = min(numbers), max(numbers)
    if not all(math.isfinite(number) for number in numbers) or right <= left:
        return None
    return IntervalMark(*(100.0 * (number - left) / (right - left) for number in numbers))
