"""Numbers as an engineer writes them: significant digits, SI prefixes, intervals."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

MISSING = "-"
PREFIXABLE = ("m", "rad", "s", "N", "N m", "m/s", "rad/s", "m/s^2", "rad/s^2", "A", "V")
MOST_DIGITS = 5


@dataclass(frozen=True)
class Scale:
    """A unit to show values in.

    Attributes:
        factor: Shown value = factor * SI value.
        unit: The unit with its prefix, e.g. "mrad".
    """

    factor: float
    unit: str


@dataclass(frozen=True)
class Interval:
    """A value and the ends of its interval, rounded alike.

    Attributes:
        value: The value.
        low: Lower end.
        high: Upper end.
    """

    value: str
    low: str
    high: str

    @property
    def ends(self) -> str:
        """Both ends in brackets; a dash where neither is known."""
        return MISSING if self.low == self.high == MISSING else f"[{self.low}, {self.high}]"


def scale_for(values: Iterable[float], unit: str) -> Scale:
    """The prefix in which values of very different size read best together.

    The geometric mean decides, so that 1.2 and 0.002 m become 1200 and 2 mm.

    Args:
        values: Magnitudes in `unit`; zeros and non-finite ones do not count.
        unit: SI unit.
    """
    sizes = [abs(v) for v in values if math.isfinite(v) and v != 0.0]
    if not sizes or unit not in PREFIXABLE:
        return Scale(1.0, unit)
    size = math.exp(float(np.mean(np.log(sizes))))
    if size < 1e-4:
        return Scale(1e6, f"\N{MICRO SIGN}{unit}")
    return Scale(1e3, f"m{unit}") if size < 0.1 else Scale(1.0, unit)


def significant(value: float, digits: int = 3) -> str:
    """A number with that many significant digits; scientific below 1e-4 and from 1e6 on."""
    if not math.isfinite(value):
        return _not_finite(value)
    if value == 0.0:
        return "0"
    exponent = _exponent(value, digits)
    return _fixed(value, digits - 1 - exponent, exponent)


def compact(value: float, digits: int = 4) -> str:
    """A number as its owner would type it: up to that many digits, no trailing zeros."""
    text = significant(value, digits)
    mantissa, mark, power = text.partition("e")
    return (mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa) + mark + power


def with_interval(value: float, low: float, high: float) -> Interval:
    """A value and its interval, with the digits that the interval's width leaves meaningful.

    Two digits of the width are shown, and never more than `MOST_DIGITS` of the largest number.
    """
    ends = [end for end in (low, high) if math.isfinite(end)]
    if not math.isfinite(value) or len(ends) < 2:
        return Interval(significant(value), significant(low), significant(high))
    largest = max(abs(value), abs(low), abs(high))
    if largest == 0.0:
        return Interval("0", "0", "0")
    exponent = _exponent(largest, MOST_DIGITS)
    decimals = MOST_DIGITS - 1 - exponent
    if high > low:
        decimals = min(decimals, 1 - _exponent(high - low, 2))
    shown = [_fixed(number, decimals, exponent) for number in (value, low, high)]
    if value != 0.0 and abs(value) < 10.0**-decimals:
        shown[0] = significant(value, 2)  # an interval far wider than the value must not hide it
    return Interval(*shown)


def _exponent(value: float, digits: int) -> int:
    """Decimal exponent of a value after rounding to that many digits."""
    return int(f"{value:.{digits - 1}e}".partition("e")[2])


def _fixed(value: float, decimals: int, exponent: int) -> str:
    """A number rounded to decimals; as a mantissa of 10^exponent where that is far from one."""
    if exponent < -4 or exponent >= 6:
        return f"{_rounded(value / 10.0**exponent, max(decimals + exponent, 0))}e{exponent:d}"
    return _rounded(value, decimals)


def _rounded(value: float, decimals: int) -> str:
    number = round(value, decimals) + 0.0  # + 0.0 turns a rounded -0.0 into 0.0
    return f"{number:.{max(decimals, 0)}f}"


def _not_finite(value: float) -> str:
    if math.isnan(value):
        return MISSING
    return "inf" if value > 0.0 else "-inf"
