"""A robot set up from its model file and logs: what each column is, and what is not sure about it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.drive import Drive
from wipx.core.tree import Tree
from wipx.recordings.matching.assignment import CERTAIN, Assignment, assignment
from wipx.recordings.matching.commands import CommandSource, command_numbers, command_source, drives_of
from wipx.recordings.matching.doubts import doubts_of, drive_doubts, reason
from wipx.recordings.matching.log import Log
from wipx.recordings.matching.motion import Motion, Placed, fit, motion_of
from wipx.recordings.matching.positions import in_si, position_signal, possible_measures, wrapped
from wipx.recordings.matching.sources import JointColumns, joint_columns
from wipx.recordings.matching.units import RATES, SLIDING_RATES, Measure, nearest
from wipx.recordings.signals import Signal

EXPLAINED = 0.1  # mean share of the commands left up to which no other units are tried
RATE_FITS = 0.8  # share of a rate's variance that the position's derivative explains
RATE_WINDOW = 0.05  # [s] over which positions are differentiated
RATE_NEAR = 1.15  # factor within which a rate's unit must be


@dataclass(frozen=True)
class Setup:
    """What a robot.yaml says of a robot's signals and drives.

    Attributes:
        signals: How columns of a recording come from those of the log.
        drives: Of joints for which the model file's actuator does not count.
        uncertainty: Relative standard deviations of what was read off the motion.
        reasons: What each joint's columns are taken for, by joint.
        doubts: What is not sure, one sentence each.
    """

    signals: Mapping[str, Signal]
    drives: Mapping[str, Drive]
    uncertainty: Mapping[str, float]
    reasons: Mapping[str, str]
    doubts: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Reading:
    """The logs, read with one choice of units."""

    measures: tuple[Measure, ...]
    positions: list[np.ndarray]
    sources: list[CommandSource]
    motion: Motion


def set_up(tree: Tree, in_file: Mapping[str, Drive], logs: Sequence[Log]) -> Setup:
    """Match columns to joints and work out units, signs, zeros and drives.

    Args:
        tree: The robot.
        in_file: Actuators of its model file, by joint.
        logs: Of one kind: the same columns in the same units.

    Raises:
        InputError: the logs lack the position of a joint.
    """
    columns = joint_columns(logs, tree.joints)
    readings = _readings(tree, in_file, logs, columns)
    reading, chosen = _best(tree, readings, tuple(each.certain for each in columns))
    unit_doubts = _unit_doubts(tree, reading, readings, chosen)
    drives = drives_of(tree, in_file, logs, reading.sources, reading.positions, chosen)
    signals: dict[str, Signal] = {"t": Signal(logs[0].time, logs[0].unit)}
    reasons, rate_doubts = {}, []
    for j, link in enumerate(tree.links):
        column = chosen.placed.columns[j]
        own, measure = columns[column], reading.measures[column]
        sign, zero = float(chosen.placed.scale[j]), float(chosen.placed.offset[j])
        unwrap = wrapped(logs, own, measure)
        signals[link.joint] = position_signal(own.position, measure, sign, zero, link, unwrap=unwrap)
        if own.rate:
            rate = _rate_signal(own.rate, sign, logs, [q[:, column] for q in reading.positions], slides=link.slides)
            if rate is None:
                rate_doubts.append(
                    f"{own.rate} is not the rate of {own.position} in a unit that is known; it is left out"
                )
            else:
                signals[f"{link.joint}_dot"] = rate
        reasons[link.joint] = reason(own, measure, sign, zero, drives[j])
    signals |= {name: signal for drive in drives for name, signal in drive.signals.items()}
    doubts = [
        *unit_doubts,
        *doubts_of(tree, columns, reading.motion, chosen),
        *drive_doubts(tree, drives),
        *rate_doubts,
    ]
    return Setup(
        signals,
        {joint: d.drive for joint, d in zip(tree.joints, drives, strict=True) if d.drive is not None},
        {name: value for drive in drives for name, value in drive.uncertainty.items()},
        reasons,
        tuple(doubts),
    )


def _readings(
    tree: Tree, in_file: Mapping[str, Drive], logs: Sequence[Log], columns: Sequence[JointColumns]
) -> list[_Reading]:
    """The logs in all units that are possible, the usual ones first."""
    readings = []
    for measures in possible_measures(tree, logs, columns):
        positions = in_si(logs, columns, measures)
        sources = [
            command_source(logs, columns[j], measures[j], [q[:, j] for q in positions], link, in_file.get(link.joint))
            for j, link in enumerate(tree.links)
        ]
        motion = motion_of([log.t for log in logs], positions, [_commands(sources, k) for k in range(len(logs))])
        readings.append(_Reading(measures, positions, sources, motion))
    return readings


def _best(tree: Tree, readings: Sequence[_Reading], certain: tuple[bool, ...]) -> tuple[_Reading, Assignment]:
    """The units in which columns can be placed best; the usual ones unless others are certainly better."""
    first = readings[0]
    best = first, assignment(tree, first.motion, _by_name(tree, first.sources), certain)
    for other in readings[1:]:
        left = best[1].fit.left
        if not np.any(np.isfinite(left)) or float(np.nanmean(left)) < EXPLAINED:
            break
        placed = assignment(tree, other.motion, _by_name(tree, other.sources), certain)
        if 0.5 * first.motion.independent * (best[1].fit.misfit - placed.fit.misfit) > CERTAIN:
            best = other, placed
    return best


def _unit_doubts(tree: Tree, taken: _Reading, readings: Sequence[_Reading], chosen: Assignment) -> list[str]:
    """Units that fit the commands about as well, once the columns are in their places."""
    nats = _nats(taken, readings, [chosen.placed] * len(readings), tree)
    near = [each for each, gain in zip(readings, nats, strict=True) if each is not taken and gain > -CERTAIN]
    words = {measure.words for measure in taken.measures}
    others = {measure.words for each in near for measure in each.measures} - words
    if not others:
        return []
    return [
        f"positions are taken to be in {' and '.join(sorted(words))}; they could be in {' or '.join(sorted(others))}"
    ]


def _nats(first: _Reading, readings: Sequence[_Reading], placed: Sequence[Placed], tree: Tree) -> list[float]:
    """By how much each reading, its columns placed so, is likelier than the first [nats]."""
    misfits = [fit(tree, each.motion, place).misfit for each, place in zip(readings, placed, strict=True)]
    own = misfits[list(readings).index(first)]
    return [0.5 * first.motion.independent * (own - misfit) for misfit in misfits]


def _commands(sources: Sequence[CommandSource], log: int) -> np.ndarray:
    """What is compared with needed forces in one log, shape (rows, drives with a command)."""
    series = [source.values[log] for source in sources if source.kind != "none"]
    return np.stack(series, axis=1) if series else np.zeros((0, 0))


def _by_name(tree: Tree, sources: Sequence[CommandSource]) -> Placed:
    """Columns in the order of the joints that names, or their order, give them."""
    count = len(tree.links)
    return Placed(tuple(range(count)), np.ones(count), np.zeros(count), command_numbers(sources))


def _rate_signal(
    column: str, sign: float, logs: Sequence[Log], positions: Sequence[np.ndarray], *, slides: bool
) -> Signal | None:
    """The signal of a measured rate; None where it is not the derivative of the position in a known unit."""
    from scipy.signal import savgol_filter

    derived, measured = [], []
    for log, q in zip(logs, positions, strict=True):
        rows = max(5, round(RATE_WINDOW * log.rate)) | 1
        if len(q) > rows:
            derived.append(np.asarray(savgol_filter(q, rows, 2, deriv=1, delta=1.0 / log.rate)))
            measured.append(np.asarray(savgol_filter(log.columns[column], rows, 2)))
    if not derived:
        return None
    v, r = np.concatenate(derived), np.concatenate(measured)
    slope = float(v @ r / (v @ v)) if np.any(v) else 0.0
    known = SLIDING_RATES if slides else RATES
    unit = nearest(slope, known, RATE_NEAR)
    if unit is None or np.mean((r - slope * v) ** 2) > (1.0 - RATE_FITS) * np.mean(r**2):
        return None
    return Signal(column, unit, sign * float(np.sign(slope)))
