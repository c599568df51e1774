"""`task=new`: from a model file and a log to a folder that other tasks read."""

from pathlib import Path

import numpy as np
import pytest
from test_robot_task import ARM

from wipx.recordings.source import RecordingSource

JOINTS = ("shoulder", "elbow", "wrist")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A model file, and a log in degrees with names of its own."""
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    t = np.arange(0.0, 2.0, 0.005)
    q = np.stack([0.3 * np.sin(2.0 * np.pi * f * t) for f in (0.5, 0.7, 0.9)], axis=1)
    u = np.stack([0.5 * np.cos(2.0 * np.pi * f * t) for f in (0.5, 0.7, 0.9)], axis=1)
    head = ",".join(["time", *(f"{j}_angle_deg" for j in JOINTS), *(f"{j}_torque" for j in JOINTS)])
    table = np.column_stack([t, np.rad2deg(q), u])
    np.savetxt(tmp_path / "run 1.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    return tmp_path


@pytest.mark.slow
def test_a_folder_is_set_up_once_and_read_by_other_tasks(program, files: Path):
    command = ("task=new", "path=new robot", "model=arm.xml", "log=run 1.csv", "hydra.run.dir=out")
    answer = program(*command)
    assert (answer.status, answer.error) == (0, "")
    assert "task=diagnose recordings.path='new robot'" in answer.out
    folder = files / "new robot"
    assert sorted(path.name for path in folder.iterdir()) == ["arm.xml", "robot.html", "robot.yaml", "run 1.csv"]
    recording = RecordingSource(path=str(folder)).load()[0]
    assert np.abs(recording["elbow"]).max() == pytest.approx(0.3, rel=0.01)
    before = (folder / "robot.yaml").read_text(encoding="utf-8")
    again = program(*command)
    assert again.status == 2
    assert "task.overwrite=true" in again.error
    assert (folder / "robot.yaml").read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ("log=none.csv", "no such log"),
        ("model=none.xml", "no such file"),
        ("log=arm.xml", "expected a .csv or .parquet file"),
    ],
)
def test_what_is_not_there_is_said_in_one_line(program, files: Path, changed: str, said: str):
    settings = {"path": "new", "model": "arm.xml", "log": "run 1.csv"}
    settings |= dict([changed.split("=")])
    answer = program("task=new", *(f"{key}={value}" for key, value in settings.items()), "hydra.run.dir=out")
    assert answer.status == 2
    assert said in answer.error
    assert answer.error.count("\n") == 1
    assert not (files / "new").exists()
