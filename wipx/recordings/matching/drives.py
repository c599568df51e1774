"""What moves a joint, as far as a log shows it."""

from dataclasses import dataclass

import numpy as np

from wipx.recordings.matching.units import Measure, measures_of

SIDE = 0.06  # [s] on each side of a reversal over which commands are averaged, without the innermost sixth
FEWEST_REVERSALS = 4
FOLLOWS = 0.9  # share of a position's variance that a target explains
FOLLOWS_CLOSELY = 0.97  # likewise, where no name says that it is a target
FOLLOWS_LIKE_OTHERS = 0.7  # likewise, where most other columns of that role are targets
RATIOS = (
    1.0,
    180.0 / np.pi,
    np.pi / 180.0,
    4096.0 / (2.0 * np.pi),
    2.0 * np.pi / 4096.0,
    4096.0 / 360.0,
    360.0 / 4096.0,
)
SAME = 1.15  # factor within which a target and a position have one unit


@dataclass(frozen=True)
class TargetUnit:
    """How a target's column stands for a position: SI value = factor * column + centre.

    Attributes:
        factor: SI units per unit; negative where it is counted against the position.
        centre: SI value of a logged zero.
        words: For people.
        unit: Key of `wipx.recordings.units.UNITS`; empty for ticks.
    """

    factor: float
    centre: float
    words: str
    unit: str


def target_unit(target: np.ndarray, position: np.ndarray, own: Measure, *, slides: bool) -> TargetUnit | None:
    """The unit of a target, from the position that follows it; None where it does not follow.

    Args:
        target: As logged, shape (rows,).
        position: Of the joint, shape (rows,) [rad or m].
        own: What the position itself is logged in.
        slides: Whether the joint slides.
    """
    slope, start = line(target, position)
    spread = float(np.var(position))
    if spread == 0.0 or np.var(position - slope * target - start) > (1.0 - FOLLOWS) * spread:
        return None
    known = {own.words: own} | {each.words: each for each in measures_of(slides).values()}
    for measure in known.values():
        if 1.0 / SAME < abs(slope) / measure.factor < SAME:
            sign = float(np.sign(slope))
            # The zero is that of the unit where the target is near the position then, else it is measured.
            centre = sign * measure.centre
            away = float(np.median(position - sign * measure.factor * target))
            centre = centre if abs(away - centre) < 0.1 * float(np.ptp(position)) + 0.02 else away
            return TargetUnit(sign * measure.factor, centre, measure.words, measure.unit)
    return TargetUnit(slope, start, f"a unit of {abs(slope):.4g} rad or m", "")


def follows(target: np.ndarray, position: np.ndarray, share: float = FOLLOWS_CLOSELY) -> bool:
    """Whether a position follows a column as a target, both as logged, in one unit or in two usual ones.

    A torque against gravity resembles the position too, but hardly in the ratio of two units.

    Args:
        target: The column, shape (rows,).
        position: Likewise.
        share: Least share of the position's variance that the target explains.
    """
    slope, start = line(target, position)
    spread = float(np.var(position))
    if spread == 0.0 or np.var(position - slope * target - start) > (1.0 - share) * spread:
        return False
    return any(1.0 / SAME < abs(slope) / ratio < SAME for ratio in RATIOS)


def friction_in_command(t: np.ndarray, q: np.ndarray, u: np.ndarray, coulomb: float) -> float | None:
    """Share of the Coulomb friction by which a command jumps where the motion reverses; None where none can be told.

    Near 1 the command is what a position control made of the friction, so that the motion is smooth; near 0 it was
    chosen without regard to the motion, which is what then has the jump.

    Args:
        t: Time, shape (rows,) [s].
        q: Position, likewise.
        u: Command, likewise.
        coulomb: Coulomb friction [units of the command], signed as the command is.
    """
    from scipy.signal import savgol_filter

    step = float(np.median(np.diff(t)))
    rows = max(5, round(SIDE / step) | 1)
    side = max(3, round(SIDE / step))
    if coulomb == 0.0 or len(q) < 6 * side:
        return None
    v = np.asarray(savgol_filter(q, rows, 2, deriv=1, delta=step))
    fast = float(np.quantile(np.abs(v), 0.9))
    jumps = []
    for row in np.flatnonzero(np.sign(v[1:]) * np.sign(v[:-1]) < 0) + 1:
        before, after = slice(row - side, row - side // 6), slice(row + side // 6, row + side)
        inside = row >= side and row + side <= len(q)
        # A true reversal: it moves on both sides.
        if (
            inside
            and v[row - side] * v[row + side - 1] < 0.0
            and min(abs(v[row - side]), abs(v[row + side - 1])) > 0.02 * fast
        ):
            trend = _slope(u[before]) * 0.5 + _slope(u[after]) * 0.5
            jump = float(np.mean(u[after]) - np.mean(u[before])) - trend * (side + side // 6)
            jumps.append(jump * np.sign(v[row + side - 1]))
    if len(jumps) < FEWEST_REVERSALS:
        return None
    error = 1.25 * float(np.std(jumps)) / np.sqrt(len(jumps))
    return float(np.median(jumps)) / (2.0 * coulomb) if error < 0.4 * abs(2.0 * coulomb) else None


def held_rows(command: np.ndarray) -> int:
    """Rows over which a command is held before it changes, typically; 1 where it changes from row to row."""
    changes = np.flatnonzero(np.diff(command) != 0.0)
    if len(changes) < 10:
        return 1
    return max(1, int(np.median(np.diff(changes))))


def line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope and start of the straight line through points (x, y) of least squares in y."""
    spread = float(np.var(x))
    slope = float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread else 0.0
    return slope, float(y.mean() - slope * x.mean())


def _slope(values: np.ndarray) -> float:
    rows = np.arange(len(values)) - 0.5 * (len(values) - 1)
    return float(rows @ values / (rows @ rows))
