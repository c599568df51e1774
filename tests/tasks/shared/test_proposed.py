"""The command that records what a diagnosis proposes: of the robot that was recorded, where it can do it alone."""

from dataclasses import replace
from pathlib import Path

import pytest
from report import synthetic_diagnosis

from wipx.core.diagnosis import Diagnosis
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.proposed import record_command
from wipx.tasks.shared.record_note import begin_note


def changed(**changes: object) -> Diagnosis:
    diagnosis = synthetic_diagnosis.mismatch()
    assert diagnosis.next_experiment is not None
    return replace(diagnosis, next_experiment=replace(diagnosis.next_experiment, **changes))


def test_a_robot_that_was_recorded_with_wipx_is_named_as_it_was_then(tmp_path: Path):
    begin_note(tmp_path, ["task=record", "target=emulated_hardware", "target.lines=pty", "task.duration=3", "seed=2"])
    command = record_command(changed(), RecordingSource(path=str(tmp_path)), Path("answer"))
    robot = "target=emulated_hardware target.lines=pty"
    assert command == f"python -m wipx task=record {robot} task.experiment=answer"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, True),
        ({"reference": {}, "release": 0.05}, True),
        ({"mass": 0.25}, False),  # somebody must put it on the body
        ({"reference": {"t": [0.0], "u": [0.0]}}, False),  # without its controller the robot falls
    ],
)
def test_a_command_is_told_only_where_the_robot_can_do_it_alone(tmp_path: Path, changes: dict, told: bool):
    command = record_command(changed(**changes), RecordingSource(path=str(tmp_path)), Path("answer"))
    expected = "python -m wipx task=record target=hardware task.experiment=answer"
    assert command == (expected if told else None)
