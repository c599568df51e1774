"""`task=export` as a user calls it: files, statuses with what they cost, refusals in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.core.model import ModelBatch
from wipx.recordings.model_file import write_model
from wipx.recordings.robot_file import read_robot
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

pytest.importorskip("mujoco")
BODY = {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037}
FOUND = {
    "pitch/stribeck": {"F_c": 0.05, "F_s": 0.1, "v_s": 0.2},
    "pitch/viscous": {"sigma": 0.02},
    "actuator/dead_zone": {"band": 0.3},
}
NOISE = 5e-4  # [rad]


@pytest.fixture
def pendulum(tmp_path: Path) -> Path:
    """Three recordings of a driven pendulum, and the completed model beside them."""
    folder = tmp_path / "pendulum"
    folder.mkdir()
    (folder / "robot.yaml").write_text(yaml.safe_dump({"plant": "pendulum", "parameters": BODY}), encoding="utf-8")
    model = read_robot(folder / "robot.yaml").model.with_effects(FOUND)
    write_model(model, tmp_path / "model.yaml")
    rng, t = np.random.default_rng(3), np.arange(0.0, 3.0, 0.01)
    for k in range(3):
        u = np.sin(4.0 * t + k) + np.sin(7.0 * t + 2.0 * k)
        inputs = Inputs.of([t], [u[:, None]], [0])
        run = AnalyticSimulator(2.5e-4).replay(ModelBatch(model), inputs, np.array([np.pi, 0.0])[:, None, None])
        theta = run.coordinates[:, 0, 0, 0] + NOISE * rng.normal(size=len(t))
        table = np.column_stack([t, theta, u])
        np.savetxt(folder / f"r{k}.csv", table, delimiter=",", header="t,theta,u", comments="", fmt="%.9g")
    return folder


def test_an_export_says_what_it_costs(program, pendulum: Path, tmp_path: Path):
    common = ("task=export", "model.path=model.yaml", f"recordings.path={pendulum}")
    answer = program(*common, "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert {"robot.xml", "model.yaml", "isaac_lab.yaml", "export.json", "export.png"} <= {
        path.name for path in (tmp_path / "out").iterdir()
    }
    said = json.loads((tmp_path / "out" / "export.json").read_text(encoding="utf-8"))
    assert {name: each["status"] for name, each in said["effects"].items()} == {
        "pitch/stribeck": "approximated",
        "pitch/viscous": "exact",
        "actuator/dead_zone": "lost",
    }
    rms = {way: errors["theta"] for way, errors in said["errors"]["rms"].items()}
    assert rms["wipx"] < 2.0 * NOISE
    assert rms["file_with_runtime"] == pytest.approx(rms["wipx"], rel=0.02)
    costs = {name: each["cost"]["theta"] for name, each in said["effects"].items() if each["cost"] is not None}
    assert set(costs) == {"pitch/stribeck", "actuator/dead_zone"}
    assert costs["pitch/stribeck"] < 0.2 * rms["wipx"]
    assert costs["actuator/dead_zone"] == pytest.approx(rms["file"] - rms["wipx"], rel=0.2)
    assert "actuator/dead_zone: lost" in answer.out


def test_a_urdf_says_less(program, pendulum: Path, tmp_path: Path):
    answer = program("task=export", "model.path=model.yaml", "format=urdf", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    said = json.loads((tmp_path / "out" / "export.json").read_text(encoding="utf-8"))
    assert said["effects"]["pitch/stribeck"] == {
        "status": "approximated",
        "how": "friction of the joint, without the static level",
        "cost": None,
    }
    assert "errors" not in said
    assert 'friction="0.05"' in (tmp_path / "out" / "robot.urdf").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("strict=true",), "strict=true: format=mjcf cannot say pitch/stribeck"),
        (("format=sdf",), "unknown format 'sdf'; valid: mjcf, urdf"),
        (("model.path=null",), "task=export needs a completed model; give model.path="),
        (("model.path=nowhere.yaml",), "nowhere.yaml"),
        (("task.step=0",), "step is 0, expected a positive number"),
        (("recordings.path=other",), "choose those of the same robot"),
    ],
)
def test_bad_input_is_one_line(program, pendulum: Path, tmp_path: Path, change: tuple[str, ...], expected: str):
    other = tmp_path / "other"
    other.mkdir()
    axis = {"plant": "linear_axis", "parameters": {"body_mass": 1.0, "wheel_mass": 0.5}}
    (other / "robot.yaml").write_text(yaml.safe_dump(axis), encoding="utf-8")
    common = ["task=export", "model.path=model.yaml", "hydra.run.dir=out"]
    kept = [each for each in common if not change[0].startswith(each.partition("=")[0] + "=")]
    answer = program(*kept, *change)
    assert answer.status == 2
    assert expected in answer.error
    assert answer.error.count("\n") == 1
    assert not (tmp_path / "out").exists()
