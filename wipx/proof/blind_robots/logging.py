"""What is recorded of a run: rows slower than the controller, mean commands, rounded numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.plant import PLANTS
from wipx.proof.blind_robots.engine import simulate
from wipx.proof.blind_robots.physics import DRIVEN, MOVING
from wipx.proof.blind_robots.robots import Robot
from wipx.proof.blind_robots.scenario import LIMITS, LogSettings, Scenario

PLACES = 5  # decimals of times, coordinates and rates


@dataclass(frozen=True, eq=False)
class Run:
    """A run as it was recorded.

    Attributes:
        columns: Columns of contract section 1 with what is recorded, each of shape (rows,) [SI].
        exact: The coordinates without noise and resolution, by column, on the same rows [SI].
        rates: True rates by coordinate's column, on the same rows [m/s, rad/s].
        fell: Whether the robot left its limits; the columns are empty then.
    """

    columns: Mapping[str, np.ndarray]
    exact: Mapping[str, np.ndarray]
    rates: Mapping[str, np.ndarray]
    fell: bool


@dataclass(frozen=True, eq=False)
class Course:
    """What happens in a run, at every control instant; arrays of shape (n, 2) by joint.

    Attributes:
        fell: Whether the robot left its limits; what follows is zero.
        shown: Coordinates as the sensors show them [m, rad].
        places: True coordinates where the encoders sit [m, rad].
        rates: Their true rates [m/s, rad/s].
        commands: [N, N m].
        forces: Mean forces of the drives until the next instant [N, N m].
        states: Whole states, shape (n, engine.STATES).
    """

    fell: bool
    shown: np.ndarray
    places: np.ndarray
    rates: np.ndarray
    commands: np.ndarray
    forces: np.ndarray
    states: np.ndarray


def record(robot: Robot, truth: np.ndarray, scenario: Scenario, settings: LogSettings) -> Run:
    """Drive a robot through a scenario and log it.

    Args:
        robot: Whose controller it is.
        truth: Record of the real robot, shape (1,), of `physics.physics`.
        scenario: The run.
        settings: Of the log.
    """
    return logged(robot, drive(robot, truth, scenario, settings), scenario, settings)


def drive(robot: Robot, truth: np.ndarray, scenario: Scenario, settings: LogSettings) -> Course:
    """Drive a robot through a scenario."""
    limit = np.array(LIMITS.get(robot.kind, (2.0, 0.5)))
    gyro, resolution = np.array(robot.gyro), np.array(settings.resolution)
    reached, *arrays = simulate(
        truth[0],
        scenario.start,
        scenario.instants,
        scenario.reference,
        scenario.extra,
        scenario.waves,
        scenario.noise,
        scenario.rate_noise,
        gyro,
        resolution,
        robot.gains,
        robot.cutoff,
        limit,
    )
    return Course(reached < len(scenario.instants) - 1, *arrays)


def logged(robot: Robot, course: Course, scenario: Scenario, settings: LogSettings) -> Run:
    """What the log keeps of a course."""
    if course.fell:
        return Run({}, {}, {}, fell=True)
    plant, rows = PLANTS[robot.kind], scenario.rows
    shown, rates, commands = course.shown, course.rates, course.commands
    columns = {"t": scenario.instants[rows]}
    exact, moving = {}, {}
    for joint, name in zip(MOVING[robot.kind], plant.coordinates, strict=True):
        columns[name] = shown[rows, joint]
        exact[name] = shown[rows, joint] - scenario.noise[rows, joint]
        moving[name] = rates[rows, joint]
    for joint, name in zip(MOVING[robot.kind], plant.coordinates, strict=True):
        if joint in settings.rates:
            columns[f"{name}_dot"] = rates[rows, joint] + scenario.rate_noise[rows, joint]
    columns = {name: np.round(values, PLACES) + 0.0 for name, values in columns.items()}
    for joint, name in zip(DRIVEN[robot.kind], plant.commands, strict=True):
        columns[name] = _rounded(_means(commands[:, joint], scenario))
        if settings.force_noise is not None:
            mean = _means(course.forces[:, joint], scenario)
            columns[f"{name}_measured"] = _rounded(mean + np.std(commands[:, joint]) * scenario.force_noise)
    return Run(columns, exact, moving, fell=False)


def _means(values: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Mean over time of held values from each row to the next, shape (rows,)."""
    steps = np.diff(scenario.instants)[: scenario.end]
    sums = np.add.reduceat(values[: scenario.end] * steps, scenario.rows)
    return sums / np.add.reduceat(steps, scenario.rows)


def _rounded(values: np.ndarray) -> np.ndarray:
    """Values with about five significant digits of their largest."""
    digits = 4 - int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-9))))
    return np.round(values, min(max(digits, 2), 8)) + 0.0
