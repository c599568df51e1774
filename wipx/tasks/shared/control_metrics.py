"""How a trial under control is judged: errors, recovery, and whether the robot had to be stopped.

A robot that was stopped counts to the end of its trial with its last place held.
"""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.control_result import FALL, RAIL_END, ControlTrial, Course
from wipx.core.errors import check_positive
from wipx.core.recording import Recording
from wipx.tasks.shared.control_scenarios import Scenario

FINE, COARSE = 0.005, 0.04  # [s] between samples that are judged, and that are kept
LYING = 0.8  # [rad] beyond which a stopped robot has fallen
EARLY = 0.05  # [s] before the end of a trial at which a recording that ends was cut short


@dataclass(frozen=True)
class TrialJudge:
    """What counts.

    Attributes:
        scenario: What was done.
        near: Distance to the reference within which a robot has recovered [m].
        upright: Distance to its balance, likewise [rad].
    """

    scenario: Scenario
    near: float
    upright: float

    def __post_init__(self) -> None:
        check_positive(near=self.near, upright=self.upright)

    def judged(self, recording: Recording, load: str, number: int, pitch: float, target: float | None) -> ControlTrial:
        """A trial with its errors.

        Args:
            recording: From the release on, shorter than the scenario where the robot was stopped.
            load: Name of its load.
            number: Of the trial with it.
            pitch: At which the robot with the load balances [rad].
            target: Pitch that the controller took for it; None for a controller that aims at zero.
        """
        course = course_of(recording, self.scenario, pitch)
        failure = failure_of(recording, self.scenario.duration)
        counts = course.t >= self.scenario.begin - 0.5 * FINE
        off = course.x - course.x_ref
        tilt = course.theta - course.balance
        recovery = None
        if failure is None:
            # A body swings about its balance while it tracks, so that its pitch says nothing then.
            upright = (np.abs(tilt) <= self.upright) | self.scenario.follows
            recovery = settled(course.t[counts], ((np.abs(off) <= self.near) & upright)[counts])
        return ControlTrial(
            load=load,
            number=number,
            pitch=pitch,
            estimate=target,
            failure=failure,
            stopped=None if failure is None else float(recording.t[-1]),
            rmse_x=_rms(off[counts]),
            rmse_pitch=_rms(tilt[counts]),
            rmse_target=_rms(course.theta[counts] - (target or 0.0)),
            recovery=recovery,
            course=thinned(course, round(COARSE / FINE)),
        )


def course_of(recording: Recording, scenario: Scenario, pitch: float) -> Course:
    """The motion of a trial at even times; see `Course`."""
    t = np.arange(round(scenario.duration / FINE) + 1) * FINE
    x, theta = (np.interp(t, recording.t, recording[name]) for name in ("x", "theta"))
    u = np.interp(t, recording.t, recording["u"], right=0.0)
    x_ref = np.array([scenario.reference(time)[0] for time in t])
    return Course(t, x, theta, u, x_ref, scenario.balance(t, pitch))


def thinned(course: Course, every: int) -> Course:
    """Every so many samples of a course."""
    return replace(course, **{name: values[::every] for name, values in vars(course).items()})


def failure_of(recording: Recording, duration: float) -> str | None:
    """Why a recording ends before its trial was over; None where it does not."""
    if recording.t[-1] > duration - EARLY:
        return None
    return FALL if abs(recording["theta"][-1]) > LYING else RAIL_END


def settled(t: np.ndarray, within: np.ndarray) -> float | None:
    """Time from t[0] after which all samples are `within`; None where the last ones are not."""
    if not within[-1]:
        return None
    outside = np.flatnonzero(~within)
    return 0.0 if len(outside) == 0 else float(t[outside[-1] + 1] - t[0])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
