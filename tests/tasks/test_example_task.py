"""`task=example`: robots from public numbers, recorded by emulation, that other tasks take."""

import json
from pathlib import Path

import pytest

from wipx.recordings.robot_file import read_robot
from wipx.recordings.source import RecordingSource

ROBOTS = Path(__file__).parents[2] / "wipx" / "robots"
JOINTS = {"six_axis_arm": 6, "servo_arm": 4, "leg": 3}
MASSES = {"six_axis_arm": 16.995, "servo_arm": 0.5129, "leg": 1.694}  # [kg] of all moving links, as published
SLOW = [pytest.param("leg"), *(pytest.param(name, marks=pytest.mark.slow) for name in ("six_axis_arm", "servo_arm"))]


@pytest.mark.parametrize("name", JOINTS)
def test_an_example_is_a_whole_robot(name: str):
    plant = read_robot(ROBOTS / name / "robot.yaml").model.plant
    assert plant.tree is not None
    assert len(plant.joints) == JOINTS[name]
    assert sum(link.mass for link in plant.tree.links) == pytest.approx(MASSES[name], rel=1e-3)
    assert all(link.limits is not None and link.effort is not None for link in plant.tree.links)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_an_example_is_recorded_within_its_limits_and_lacks_physics(program, name: str, tmp_path: Path):
    made = program("task=example", f"task.robot={name}", "task.path=robot", "task.runs=1", "task.duration=4")
    assert (made.status, made.error) == (0, "")
    recording = RecordingSource(path=str(tmp_path / "robot")).load()[0]
    tree = read_robot(tmp_path / "robot" / "robot.yaml").model.plant.tree
    assert tree is not None
    for link in tree.links:
        assert link.limits is not None
        assert link.limits[0] < recording[link.joint].min() < recording[link.joint].max() < link.limits[1]
    assert program("task=predict", "recordings.path=robot", "hydra.run.dir=seen").status == 0
    seen = json.loads((tmp_path / "seen" / "metrics.json").read_text(encoding="utf-8"))
    errors = [seen["rms_nominal"][joint] / seen["noise_floor"][joint] for joint in tree.joints]
    assert max(errors) > 3.0


def test_a_humanoid_is_recorded_while_it_balances(program, tmp_path: Path):
    made = program(
        "task=example", "task.robot=humanoid", "task.path=robot", "task.runs=1", "task.duration=4", "sim=mujoco"
    )
    assert (made.status, made.error) == (0, "")
    recording = RecordingSource(path=str(tmp_path / "robot")).load()[0]
    assert 0.1 < recording["pitch"].min() < recording["pitch"].max() < 0.6
    assert recording["left_elbow"].max() - recording["left_elbow"].min() > 0.2


def test_an_unknown_example_lists_those_that_there_are(program):
    answer = program("task=example", "task.robot=dog", "task.path=robot")
    assert answer.status == 2
    assert "leg, servo_arm, six_axis_arm" in answer.error
