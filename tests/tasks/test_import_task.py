"""`task=import` as a user types it: preview, recordings, and one line for every fault of the input."""

import json
from pathlib import Path

import log_writers as logs
import numpy as np
import pytest
import yaml


def motion(rows: int = 300) -> logs.Motion:
    return logs.motion(np.random.default_rng(0), rows)


def test_without_a_mapping_a_log_is_listed(program, tmp_path: Path):
    path = logs.write_mcap(tmp_path / "run.mcap", motion())
    answer = program("task=import", f"log.path={path}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    for part in ("/joint_states", "sensor_msgs/msg/JointState", "position.elbow", "/command", "data[0]"):
        assert part in answer.out
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["config.yaml", "import.json"]


def test_a_preview_writes_no_recordings(program, tmp_path: Path):
    path = logs.write_mcap(tmp_path / "run.mcap", motion())
    answer = program("task=import", "import=joint_state", f"log.path={path}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert "write=true writes 1 recordings" in answer.out
    assert "is received 2 ms after its header stamp" in answer.out
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["config.yaml", "import.json", "import.png"]


@pytest.mark.slow
def test_a_written_set_is_read_by_the_other_tasks(program, folder, tmp_path: Path):
    t = np.arange(400) * 0.01
    theta = np.pi + 0.2 * np.cos(4.2 * t)
    np.savez(tmp_path / "run.npz", time=t, qpos=theta[:, None], ctrl=np.zeros((400, 1)))
    answer = program(
        "task=import",
        "import=mujoco",
        "log.path=run.npz",
        "log.rename={0: theta}",
        "log.columns={u: {stream: arrays, field: 'ctrl[0]', unit: N m}}",
        "write=true",
        "task.suffix=parquet",
        f"task.robot={folder.path / 'robot.yaml'}",
        "hydra.run.dir=set",
    )
    assert (answer.status, answer.error) == (0, "")
    assert (tmp_path / "set" / "r01.parquet").is_file()
    answer = program("task=predict", "recordings.path=set", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["recordings"].keys() == {"r01.parquet"}


def test_a_mapping_of_ones_own_is_an_option(program, tmp_path: Path):
    option = tmp_path / "mine" / "import" / "my_robot.yaml"
    option.parent.mkdir(parents=True)
    content = {
        "_target_": "wipx.importing.mapping.LogMapping",
        "path": None,
        "format": {"_target_": "wipx.importing.formats.by_name.AnyLog"},
        "columns": {"theta": {"stream": "/joint_states", "field": "position.elbow", "unit": "rad"}},
    }
    option.write_text(f"# @package log\n{yaml.safe_dump(content)}")
    path = logs.write_mcap(tmp_path / "run.mcap", motion())
    answer = program(
        f"--config-dir={tmp_path / 'mine'}",
        "task=import",
        "import=my_robot",
        f"log.path={path}",
        "write=true",
        "hydra.run.dir=out",
    )
    assert (answer.status, answer.error) == (0, "")
    assert (tmp_path / "out" / "r01.csv").read_text().startswith("t,theta\n0.000000000,")


def test_interrupted_reading_leaves_nothing(program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from wipx.importing import pipeline

    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(pipeline, "estimate_shifts", interrupted)
    path = logs.write_mcap(tmp_path / "run.mcap", motion())
    answer = program("task=import", "import=joint_state", f"log.path={path}", "write=true", "hydra.run.dir=out")
    assert answer.status == 130
    assert not (tmp_path / "out").exists()


FAULTS = {
    "no file": (["import=joint_state", "log.path=none.mcap"], ["log.path none.mcap does not exist"]),
    "unknown stream": (
        ["import=joint_state", "log.path=run.mcap", "log.columns={u: {stream: /cmd, field: data}}"],
        ["no stream /cmd", "/joint_states (sensor_msgs/msg/JointState)", "/command"],
    ),
    "a robot of other joints": (
        ["import=joint_state", "log.path=run.mcap", "write=true", "task.robot=swing/robot.yaml"],
        ["robot.yaml: recordings of this robot need the column theta", "shoulder, elbow"],
    ),
    "nothing mapped": (["log.path=run.mcap", "write=true"], ["write=true: no column is mapped"]),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_input_is_one_line(program, folder, tmp_path: Path, name: str):
    logs.write_mcap(tmp_path / "run.mcap", motion())
    arguments, parts = FAULTS[name]
    answer = program("task=import", *arguments, "hydra.run.dir=out")
    assert answer.status == 2
    assert answer.error.count("\n") == 1
    for part in parts:
        assert part in answer.error
    assert not (tmp_path / "out").exists()


def test_recordings_of_another_log_are_not_mixed_in(program, folder, tmp_path: Path):
    logs.write_mcap(tmp_path / "run.mcap", motion())
    before = sorted(path.name for path in folder.path.iterdir())
    arguments = ("import=joint_state", "log.path=run.mcap", "write=true", "hydra.run.dir=swing")
    answer = program("task=import", *arguments)
    assert answer.status == 2
    assert "swing: there are recordings already (a.csv)" in answer.error
    assert sorted(path.name for path in folder.path.iterdir()) == before
