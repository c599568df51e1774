"""Sizes of effects with their intervals, and the same size from several groups of runs."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Size:
    """A number of a named effect.

    Attributes:
        effect: "site/kind".
        symbol: Of the number.
        value: The estimate [unit].
        low: Lower end of its 95 % interval.
        high: Upper end.
        unit: SI unit.
    """

    effect: str
    symbol: str
    value: float
    low: float
    high: float
    unit: str

    def agrees(self, other: "Size") -> bool:
        """Whether the two differ by no more than their intervals allow.

        The half widths that face each other are added in quadrature, which is a test at 5 % where both estimates
        are normal and independent.
        """
        small, large = sorted((self, other), key=lambda size: size.value)
        return large.value - small.value <= math.hypot(small.high - small.value, large.value - large.low)


@dataclass(frozen=True)
class SizeSeries:
    """One number of an effect over the groups of runs of a rig.

    Attributes:
        rig: Title of the rig.
        ways: Way of splitting that each size comes from; sizes of one way stand together.
        sizes: One for each group that names the effect, all of one effect and symbol.
        published: The authors' figure [unit]; None where they give none.
    """

    rig: str
    ways: tuple[str, ...]
    sizes: tuple[Size, ...]
    published: float | None
