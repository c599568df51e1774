"""A robot from a model file through the tasks: named effects are identified, and the model predicts."""

import json
from pathlib import Path

import numpy as np
import pytest

from wipx.core.model import ModelBatch
from wipx.recordings.robot_file import read_robot
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

ARM = """<mujoco><worldbody><body name="upper"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="shoulder" axis="0 -1 0" damping="0.05"/><body name="lower" pos="0 0 -0.3">
<inertial pos="0 0 -0.15" mass="0.3" diaginertia="0.004 0.004 0.0005"/><joint name="elbow" axis="1 0 0"/>
<body name="hand" pos="0 0 -0.2"><inertial pos="0 0 -0.1" mass="0.2" diaginertia="0.002 0.002 0.0005"/>
<joint name="wrist" axis="0 -1 0"/></body></body></body></worldbody></mujoco>"""
HIDDEN = {"shoulder/coulomb": {"F_c": 0.1}, "actuator_elbow/gain": {"k": 0.9}, "wrist/viscous": {"sigma": 0.02}}
NOISE = 5e-4  # [rad]


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    folder = tmp_path / "arm"
    folder.mkdir()
    (folder / "arm.xml").write_text(ARM, encoding="utf-8")
    description = "plant: robot\nmodel: arm.xml\nuncertainty: {hand.mass: 0.1}\n"
    (folder / "robot.yaml").write_text(description, encoding="utf-8")
    model = read_robot(folder / "robot.yaml").model.with_effects(HIDDEN)
    rng, t = np.random.default_rng(5), np.arange(0.0, 3.0, 0.005)
    for k in range(2):
        phases = rng.uniform(0.0, 6.3, (3, 3))
        waves = np.sin(2.0 * np.pi * np.array([0.4, 0.9, 1.7])[:, None, None] * t + phases[..., None])
        commands = (waves.sum(axis=0) * np.array([0.5, 0.25, 0.08])[:, None]).T
        inputs = Inputs.of([t], [commands], [0])
        run = AnalyticSimulator().replay(ModelBatch(model), inputs, np.zeros((6, 1, 1)))
        q = run.coordinates[:, :, 0, 0] + NOISE * rng.normal(size=(len(t), 3))
        head = "t,shoulder,elbow,wrist,u_shoulder,u_elbow,u_wrist"
        table = np.column_stack([t, q, commands])
        np.savetxt(folder / f"r{k}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    return folder


@pytest.mark.slow
def test_named_effects_are_identified_and_predict(program, robot: Path, tmp_path: Path):
    named = "effects=[shoulder/coulomb,actuator_elbow/gain,wrist/viscous]"
    common = ("free={hand.mass: 0.1}", "friction=none", "optimizer.starts=1", f"recordings.path={robot}")
    answer = program("task=identify", named, *common, "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    found = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))["parameters"]
    for effect, numbers in HIDDEN.items():
        for symbol, value in numbers.items():
            assert found[f"{effect}.{symbol}"]["value"] == pytest.approx(value, rel=0.03)
    assert found["hand.mass"]["value"] == pytest.approx(0.2, rel=0.03)
    predict = ("task=predict", "model.path=out/model.yaml", f"recordings.path={robot}", "hydra.run.dir=seen")
    assert program(*predict).status == 0
    seen = json.loads((tmp_path / "seen" / "metrics.json").read_text(encoding="utf-8"))
    assert all(seen["rms"][joint] < 0.2 * seen["rms_nominal"][joint] for joint in ("shoulder", "wrist"))


@pytest.mark.slow
def test_a_diagnosis_names_what_is_hidden_at_every_joint(program, robot: Path, tmp_path: Path):
    answer = program("task=diagnose", f"recordings.path={robot}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    assert {effect["name"] for effect in found["effects"]} == set(HIDDEN)
    assert set(found["location"]["sites"]) == {"shoulder", "actuator_elbow", "wrist"}


@pytest.mark.parametrize("refused", ["task=baseline"])
def test_what_cannot_be_done_yet_is_refused_in_one_line(program, robot: Path, refused: str):
    answer = program(refused, f"recordings.path={robot}", "hydra.run.dir=out")
    assert answer.status == 2
    assert "yet" in answer.error
    assert answer.error.count("\n") == 1
