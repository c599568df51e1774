"""What is recorded of a run of a robot with many joints."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.proof.blind_robots.trees.engine import workplace
from wipx.proof.blind_robots.trees.physics import Real, body_of
from wipx.proof.blind_robots.trees.plans import DECIMALS, LogSettings, Scenario
from wipx.proof.blind_robots.trees.robots import GRAVITY, Robot
from wipx.proof.blind_robots.trees.run import Control, simulate

LONGEST_STEP = 5e-4  # [s]
PER_CONTACT = 2e-4  # [s], longest step where a drive has play or a bristle is stiff
BEYOND = 0.25  # of a joint's range that it may leave its limits by: they are stops in life, and not simulated


@dataclass(frozen=True, eq=False)
class Run:
    """A run as it was recorded; arrays of shape (rows, joints), except the columns.

    Attributes:
        columns: By name, as contract section 6 has them, each of shape (rows,).
        exact: Positions without noise and resolution.
        rates: True rates.
        commands: Mean commands.
        forces: Mean forces of the motors until the next row.
    """

    columns: Mapping[str, np.ndarray]
    exact: np.ndarray
    rates: np.ndarray
    commands: np.ndarray
    forces: np.ndarray


@dataclass(frozen=True)
class Tuning:
    """How a controller is tuned.

    Attributes:
        quickness: Natural frequency of a joint with the others free [rad/s].
        damping: Share of critical.
    """

    quickness: float
    damping: float


def control_of(robot: Robot, tuning: Tuning) -> Control:
    """The controller of a robot."""
    low, high = np.array([link.limits for link in robot.links]).T
    beyond = BEYOND * (high - low)
    gears = np.array([drive.gain for drive in robot.drives])
    top = 12.0 * (
        robot.weight + 12.0 * robot.inertia * np.where([link.slides for link in robot.links], high - low, 1.0)
    )
    return Control(
        body_of(robot.links, GRAVITY),
        robot.light * tuning.quickness**2,
        2.0 * tuning.damping * robot.light * tuning.quickness,
        robot.inertia,
        np.maximum(top, 1e-6 * gears),
        robot.cutoff,
        np.stack([low - beyond, high + beyond], axis=1),
    )


def record(robot: Robot, truth: Real, control: Control, scenario: Scenario, settings: LogSettings) -> Run | None:
    """Drive a robot through a scenario and log it; None where a joint leaves its limits.

    Args:
        robot: As its owner believes it to be.
        truth: As it is.
        control: Its controller.
        scenario: The run.
        settings: Of the log.
    """
    plan = scenario.plan
    start = np.zeros(len(truth.joints))
    start[truth.visible] = plan.reference[0, 0]
    stiff = (truth.joints["drive_inertia"] > 0.0) | (truth.joints["bristle_level"] > 0.0)
    step = PER_CONTACT if stiff.any() else LONGEST_STEP
    reached, shown, places, rates, commands, forces = simulate(
        truth.body, truth.joints, truth.cable, truth.visible, control, plan, start, step,
        workplace(len(truth.joints)), workplace(len(robot.links)),
    )  # fmt: skip
    if reached < len(plan.instants) - 1:
        return None
    del places
    rows = scenario.rows
    columns: dict[str, np.ndarray] = {"t": np.round(plan.instants[rows], DECIMALS)}
    for j, name in enumerate(robot.joints):
        columns[name] = np.round(shown[rows, j], DECIMALS + 2) + 0.0
    if settings.rate_noise is not None:
        for j, name in enumerate(robot.joints):
            columns[f"{name}_dot"] = np.round(
                rates[rows, j] + settings.rate_noise[j] * scenario.rate_noise[:, j], DECIMALS
            )
    mean, made = _means(commands, scenario), _means(forces, scenario)
    for j, (name, drive) in enumerate(zip(robot.joints, robot.drives, strict=True)):
        if drive.kind == "none":
            continue
        columns[f"u_{name}"] = _rounded(mean[:, j])
        if settings.force_noise is not None:
            noisy = made[:, j] + settings.force_noise * np.std(made[:, j]) * scenario.force_noise[:, j]
            columns[f"u_{name}_measured"] = _rounded(noisy)
    return Run(columns, shown[rows] - plan.noise[rows], rates[rows], mean, made)


def _means(values: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Mean over time of held values from each row to the next, shape (rows, joints)."""
    steps = np.diff(scenario.plan.instants)[: scenario.end, None]
    sums = np.add.reduceat(values[: scenario.end] * steps, scenario.rows)
    return sums / np.add.reduceat(steps, scenario.rows)


def _rounded(values: np.ndarray) -> np.ndarray:
    """Values with about six significant digits of their largest."""
    digits = 5 - int(np.floor(np.log10(max(float(np.abs(values).max()), 1e-9))))
    return np.round(values, digits) + 0.0
