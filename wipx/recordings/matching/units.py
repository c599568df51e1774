"""Units that columns of positions, rates and forces may be in, and which of them the numbers speak for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi, tau
from types import MappingProxyType

import numpy as np

from wipx.core.tree import Link


@dataclass(frozen=True)
class Measure:
    """A unit with its zero: SI value = factor * logged + centre.

    Attributes:
        words: For people, e.g. "degrees".
        factor: SI units per unit.
        centre: SI value of a logged zero.
        unit: Key of `wipx.recordings.units.UNITS`; empty for a drive's own ticks.
        largest: Of a drive's ticks, the largest value; None for others.
    """

    words: str
    factor: float
    centre: float = 0.0
    unit: str = ""
    largest: float | None = None


TURNING = MappingProxyType(
    {
        "rad": Measure("radians", 1.0, unit="rad"),
        "deg": Measure("degrees", pi / 180.0, unit="deg"),
        "turn": Measure("turns", tau, unit="turn"),
        # Dynamixel e-manuals: MX, X and P series; AX series, 300 degrees
        "4096": Measure("ticks of 4096 a turn, 2048 at zero", tau / 4096.0, -pi, largest=4096.0),
        "1024": Measure(
            "ticks of 1024 over 300 degrees, 512 at zero", 300.0 / 1024.0 * pi / 180.0, -2.618, largest=1023.0
        ),
        "16384": Measure("ticks of 16384 a turn", tau / 16384.0, largest=16384.0),  # 14-bit magnetic encoders
        "65536": Measure("ticks of 65536 a turn", tau / 65536.0, largest=65536.0),
    }
)
SLIDING = MappingProxyType(
    {
        "m": Measure("metres", 1.0, unit="m"),
        "cm": Measure("centimetres", 0.01, unit="cm"),
        "mm": Measure("millimetres", 0.001, unit="mm"),
    }
)
TICKS = ("4096", "1024", "16384", "65536")
BEYOND = 1.1  # times the way between a joint's limits that a recording may span
MOST_TURNS = 10.0  # of a hinge without limits
LEAST_SPAN = {False: 0.1, True: 0.01}  # [rad], [m] of the joint that moves most; smaller spans are another unit
RATES = {"rad/s": 1.0, "deg/s": 180.0 / pi, "rpm": 60.0 / tau, "turn/s": 1.0 / tau}
SLIDING_RATES = {"m/s": 1.0, "cm/s": 100.0, "mm/s": 1000.0}
FORCES = {"N m": 1.0, "N cm": 100.0, "mN m": 1000.0}  # units of the log per N m
SLIDING_FORCES = {"N": 1.0, "kN": 0.001, "mN": 1000.0}
NEAR = 1.8  # factor within which a measured gain speaks for a unit: nominal models are no better


def measures_of(slides: bool) -> Mapping[str, Measure]:
    """What positions of a hinge or a slide may be logged in."""
    return SLIDING if slides else TURNING


def feasible(columns: Sequence[np.ndarray], links: Sequence[Link]) -> tuple[str, ...]:
    """Measures in which all columns, those of hinges or those of slides, can be positions of their links.

    The usual ones come first. A drive's ticks are whole numbers from zero on, and stay in their range.

    Args:
        columns: One for each link, as logged, shape (rows,).
        links: All hinges or all slides.
    """
    slides = links[0].slides
    whole = all(np.all(column == np.round(column)) for column in columns)
    spans = np.array([np.ptp(column) for column in columns])
    ways = np.array([_way(link) for link in links])
    found = []
    for name, measure in measures_of(slides).items():
        if name in TICKS:
            lowest, highest = min(c.min() for c in columns), max(c.max() for c in columns)
            possible = whole and lowest >= 0.0 and highest <= (measure.largest or 0.0) and highest > 100.0
        else:
            possible = float(np.max(spans)) * measure.factor >= LEAST_SPAN[slides]
        if possible and np.all(spans * measure.factor <= BEYOND * ways):
            found.append(name)
    ticks = [name for name in found if name in TICKS]
    return tuple(ticks or found)


def _way(link: Link) -> float:
    if link.limits is None:
        return np.inf if link.slides else MOST_TURNS * tau
    return link.limits[1] - link.limits[0]


def nearest(ratio: float, known: Mapping[str, float], within: float) -> str | None:
    """The unit whose factor is nearest to a measured one; None where none is within that factor."""
    name = min(known, key=lambda unit: abs(np.log(abs(ratio) / known[unit])) if ratio else np.inf)
    return name if ratio and abs(np.log(abs(ratio) / known[name])) <= np.log(within) else None


def unwrapped(column: np.ndarray, turn: float) -> np.ndarray:
    """A column without its jumps by a whole turn, `turn` in its own unit."""
    return np.unwrap(column, period=turn)


def wraps(column: np.ndarray, turn: float) -> bool:
    """Whether a column jumps by about a whole turn between rows that are otherwise near each other."""
    steps = np.abs(np.diff(column))
    jumps = steps > 0.9 * turn
    return bool(np.any(jumps) and np.all(steps[~jumps] < 0.2 * turn) and np.all(steps[jumps] < 1.1 * turn))
