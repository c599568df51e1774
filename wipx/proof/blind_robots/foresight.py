"""Predictions of a run by records of a robot that lack something: how much what they lack matters within half a second.

A prediction starts every 0.5 s from what perfect sensors show of the run, and gets its commands.
"""

import math
from dataclasses import dataclass

import numpy as np

from wipx.core.results import HORIZON
from wipx.proof.blind_robots.compiled import kept
from wipx.proof.blind_robots.engine import STATES, interval
from wipx.proof.blind_robots.logging import Course
from wipx.proof.blind_robots.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Foretold:
    """Predictions of a run, as perfect sensors would show them.

    Attributes:
        places: At every control instant, shape (n, 2) [m, rad]; NaN where nothing is predicted.
    """

    places: np.ndarray

    def difference(self, other: "Foretold") -> np.ndarray:
        """Mean squared difference by joint, shape (2,)."""
        return np.nanmean((self.places - other.places) ** 2, axis=0)


def shown(truth: np.ndarray, course: Course, scenario: Scenario) -> Foretold:
    """What sensors without noise and steps show of a run."""
    return Foretold(_sensed(truth, course, scenario.instants[:-1], np.zeros(2))[0])


def motion(truth: np.ndarray, course: Course, scenario: Scenario) -> np.ndarray:
    """Mean squared way from the start of a prediction, by joint, shape (2,)."""
    places = shown(truth, course, scenario).places
    starts, ends = _windows(scenario)
    ways = [places[first:last] - places[first] for first, last in zip(starts, ends, strict=True)]
    return np.mean(np.concatenate(ways) ** 2, axis=0)


def foretell(model: np.ndarray, truth: np.ndarray, course: Course, scenario: Scenario) -> Foretold:
    """Predict a run.

    Args:
        model: Record of the robot as it is believed to be, shape (1,), of `physics.physics`.
        truth: Record of the real robot, likewise.
        course: What the real robot did.
        scenario: The run.
    """
    starts, ends = _windows(scenario)
    instants, late = scenario.instants[:-1], model["sensor_delay"][0]
    # the model knows how late, scaled and biased its own sensors are, so it takes that back at the start
    places, rates = _sensed(truth, course, instants, late)
    scale = 1.0 + model["sensor_scale"][0]
    places, rates = (places - model["sensor_bias"][0]) / scale, rates / scale
    q = replay(
        model[0],
        scenario.instants,
        course.commands,
        np.zeros((len(instants), 4)),
        starts,
        ends,
        course.states,
        places[starts],
        rates[starts],
    )
    found = np.full_like(q, np.nan)
    for first, last in zip(starts, ends, strict=True):
        t = instants[first:last]
        for joint in range(2):
            then = np.interp(t - late[joint], t, q[first:last, joint])
            known = t >= t[0] + late[joint]
            found[first:last, joint] = np.where(known, scale[joint] * then + model["sensor_bias"][0, joint], np.nan)
    return Foretold(found)


def _windows(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """First instants of the predictions, and those at which they end."""
    begin = scenario.instants[scenario.rows[0]]
    count = int((scenario.duration - begin) / HORIZON)
    edges = np.searchsorted(scenario.instants[:-1], begin + HORIZON * np.arange(count + 1) - 1e-9)
    return edges[:-1], edges[1:]


def _sensed(
    truth: np.ndarray, course: Course, instants: np.ndarray, ahead: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What sensors without noise show some time ahead of each instant, and how fast it changes, each (n, 2)."""
    places, rates = np.empty_like(course.places), np.empty_like(course.rates)
    for joint in range(2):
        when = instants + ahead[joint] - truth["sensor_delay"][0, joint]
        place = np.interp(when, instants, course.places[:, joint])
        rate = np.interp(when, instants, course.rates[:, joint])
        number, size = truth["wobble_number"][0, joint], truth["wobble"][0, joint]
        angle = number * place + truth["wobble_phase"][0, joint]
        scale = 1.0 + truth["sensor_scale"][0, joint]
        places[:, joint] = scale * (place + size * np.sin(angle)) + truth["sensor_bias"][0, joint]
        rates[:, joint] = scale * rate * (1.0 + size * number * np.cos(angle))
    return places, rates


@kept
def replay(r, instants, commands, waves, starts, ends, states, places, rates):
    """Coordinates under recorded commands, restarted at some instants, shape (n, 2); zero where nothing is predicted.

    Args:
        r: Record of the robot.
        instants: Control instants, shape (n + 1,) [s].
        commands: Shape (n, 2) [N or N m].
        waves: As of `engine.simulate`, shape (n, 4).
        starts: Instants at which predictions start, shape (w,).
        ends: Instants before which they end, shape (w,).
        states: Of a run, shape (n, STATES), for lag, bristles and the drive at the start.
        places: Coordinates at the starts, shape (w, 2).
        rates: Their rates, shape (w, 2).
    """
    q = np.zeros((len(instants) - 1, 2))
    work, impulse, mode = np.zeros((7, STATES)), np.zeros(2), np.zeros(2, np.int64)
    for w in range(len(starts)):
        y = states[starts[w]].copy()
        y[16] += places[w, 0] - y[0]
        y[17] += rates[w, 0] - y[3]
        for j in range(2):
            y[j], y[3 + j] = places[w, j], rates[w, j]
            mode[j] = 0 if y[3 + j] == 0.0 else int(math.copysign(1.0, y[3 + j]))
        active = -1
        for k in range(starts[w], ends[w]):
            q[k, 0], q[k, 1] = y[0], y[1]
            active = interval(y, k, instants, commands, waves, active, mode, r, work, impulse)
    return q
