"""What an experiment with a controller leaves: the type that tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.load import Load

RAIL_END, FALL = "rail end", "fall"


@dataclass(frozen=True)
class Course:
    """Motion during a trial, as the sensors showed it; where the robot was stopped, its last place is held.

    Attributes:
        t: Time since the release, shape (K,) [s].
        x: Position, shape (K,) [m].
        theta: Pitch, shape (K,) [rad].
        u: Command, shape (K,) [N]; zero after a stop.
        x_ref: Position that was asked for, shape (K,) [m].
        balance: Pitch at which the robot balances, with the load that it carries then, shape (K,) [rad].
    """

    t: np.ndarray
    x: np.ndarray
    theta: np.ndarray
    u: np.ndarray
    x_ref: np.ndarray
    balance: np.ndarray


@dataclass(frozen=True)
class ControlTrial:
    """One trial, judged.

    Attributes:
        load: Name of the load of this trial.
        number: Of the trial with it, from 1 on; trials of the same load and number differ in the controller only.
        pitch: At which the robot with the load balances [rad]; the paper's theta_lin.
        estimate: Of it, by the controller; None for a controller that makes none.
        failure: `RAIL_END`, `FALL` or None.
        stopped: When it failed [s]; None where it did not.
        rmse_x: Root mean square of x - x_ref over the time that counts [m].
        rmse_pitch: Of the pitch beside the one at which the robot balances [rad].
        rmse_target: Of the pitch beside the one that the controller aims at [rad]: the paper's error. It is zero for a
            controller without estimate.
        recovery: Time after which the robot stays near reference and balance, from where time counts on [s]; None
            where it never does.
        course: Motion.
        notes: What the controller decided, one line each.
    """

    load: str
    number: int
    pitch: float
    estimate: float | None
    failure: str | None
    stopped: float | None
    rmse_x: float
    rmse_pitch: float
    rmse_target: float
    recovery: float | None
    course: Course
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ControlResult:
    """One controller in one scenario, over all loads and trials.

    Attributes:
        controller: Its kind.
        method: How the simulation came about that gives model and estimator (paper, Sec. V-C).
        estimator: Of the equilibrium pitch; empty where the controller asks none.
        scenario: What was done.
        target: Kind of robot: emulated or real hardware.
        seed: Of adaptation, training set and training.
        gap: Loss of the paper's Eq. 7 that the adaptation left [m^2 and rad^2 added].
        begin: Time from which errors count [s].
        duration: Of a trial [s].
        rail: Half its length [m].
        wheel_radius: [m].
        loads: That were on the robot, by name and in the order of the trials.
        trials: One after the other.
    """

    controller: str
    method: str
    estimator: str
    scenario: str
    target: str
    seed: int
    gap: float
    begin: float
    duration: float
    rail: float
    wheel_radius: float
    loads: Mapping[str, Load]
    trials: tuple[ControlTrial, ...]

    @property
    def failures(self) -> int:
        """Trials in which the robot was stopped."""
        return sum(trial.failure is not None for trial in self.trials)

    def of(self, load: str) -> tuple[ControlTrial, ...]:
        """The trials with one load."""
        return tuple(trial for trial in self.trials if trial.load == load)
