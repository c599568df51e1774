"""Columns of positions in SI, and how a robot.yaml says it."""

from collections.abc import Sequence

import numpy as np

from wipx.core.tree import Link, Tree
from wipx.recordings.matching.log import Log
from wipx.recordings.matching.names import read_name
from wipx.recordings.matching.sources import JointColumns
from wipx.recordings.matching.units import Measure, feasible, measures_of, unwrapped, wraps
from wipx.recordings.signals import Signal


def possible_measures(tree: Tree, logs: Sequence[Log], columns: Sequence[JointColumns]) -> list[tuple[Measure, ...]]:
    """What the positions of all joints may be logged in, the likeliest first; what a name says is taken.

    Hinges whose names say nothing share one unit, and so do slides; only what can be the position of all is possible.
    """
    said = [measures_of(link.slides).get(read_name(columns[j].position).unit) for j, link in enumerate(tree.links)]
    options: list[list[Measure]] = []
    for slides in (False, True):
        group = [j for j, link in enumerate(tree.links) if link.slides == slides and said[j] is None]
        series = [np.concatenate([log.columns[columns[j].position] for log in logs]) for j in group]
        known = measures_of(slides)
        names = feasible(series, [tree.links[j] for j in group]) if group else ()
        options.append([known[name] for name in names or tuple(known)[:1]])
    return [
        tuple(said[j] or (slide if link.slides else hinge) for j, link in enumerate(tree.links))
        for slide in options[1]
        for hinge in options[0]
    ]


def in_si(logs: Sequence[Log], columns: Sequence[JointColumns], measures: Sequence[Measure]) -> list[np.ndarray]:
    """Positions of each log as its columns have them, in SI and without jumps by a turn, shape (rows, N)."""
    found = []
    for log in logs:
        series = []
        for own, measure in zip(columns, measures, strict=True):
            values = log.columns[own.position]
            values = unwrapped(values, turn_of(measure)) if wrapped(logs, own, measure) else values
            series.append(measure.factor * values + measure.centre)
        found.append(np.stack(series, axis=1))
    return found


def turn_of(measure: Measure) -> float:
    """A whole turn in the unit of a column."""
    return 2.0 * np.pi / measure.factor


def wrapped(logs: Sequence[Log], own: JointColumns, measure: Measure) -> bool:
    """Whether a log of a hinge, in a unit that has one turn, jumps by it."""
    turning = measure.unit in ("rad", "deg", "turn")
    return turning and any(wraps(log.columns[own.position], turn_of(measure)) for log in logs)


def position_signal(column: str, measure: Measure, sign: float, zero: float, link: Link, *, unwrap: bool) -> Signal:
    """The signal of a position: sign * (its SI value) + zero."""
    unit = "m" if link.slides else "rad"
    scale = sign if measure.unit else sign * measure.factor
    return Signal(column, measure.unit or unit, scale, sign * measure.centre + zero, unwrap=unwrap)
