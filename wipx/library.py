"""The package as a library: functions of `wipx` itself, from files or objects, without a configuration."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.recordings.robot_file import RobotDescription, read_robot
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import StateFeedback


def diagnose_robot(
    recordings: str | Path | Sequence[Recording],
    robot: str | Path | RobotDescription | None,
    suspects: Mapping[str, Mapping[str, float]] | None,
) -> Diagnosis:
    """See `wipx.diagnose`."""
    described = read_robot(Path(robot)) if isinstance(robot, str | Path) else robot
    title, where = "recordings", "robot"
    if isinstance(recordings, str | Path):
        source = RecordingSource(path=str(recordings))
        described = described or source.describe()
        title, where = source.name, str(recordings)
        recordings = source.load()
    if described is None:
        raise InputError("robot: recordings that come without a folder need a robot; give robot.yaml's path")
    known = KnownRobot(described.model, described.uncertainty, feedback_of(described))
    return diagnose(tuple(recordings), known, AnalyticSimulator(), title=title, source=where, suspects=suspects)


def feedback_of(robot: RobotDescription) -> tuple[StateFeedback, float] | None:
    """The robot's controller and its rate [Hz]; None where it is not described."""
    if robot.controller is None:
        return None
    return StateFeedback(np.array(robot.controller.gains)), robot.controller.rate
