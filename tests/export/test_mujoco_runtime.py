"""The runtime around MuJoCo's step gives what `sim=mujoco` gives, for every effect."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sim.random_trees import mjcf
from sim.robots import LIVELY, robot
from sim.test_tree_engines import DRIVES, EFFECTS

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.export.mjcf import export_mjcf
from wipx.export.mujoco_runtime import ROWS, Runtime
from wipx.recordings.model_file import write_model
from wipx.recordings.robot_model import read_tree
from wipx.sim.inputs import Inputs
from wipx.sim.mujoco import MujocoSimulator

mujoco: Any = pytest.importorskip("mujoco")
DIGITS = 2e-5  # [rad, m]; a file has six digits of masses and lengths
STEP = 1e-3


def stepped(model: Model, runtime: Runtime, commands: np.ndarray, start: np.ndarray) -> np.ndarray:
    """What the sensors show while the runtime is stepped, shape (rows, joints)."""
    count = len(model.plant.joints)
    runtime.reset(start[:count], start[count:])
    return np.array([runtime.shown.copy(), *(runtime.step(command).copy() for command in commands)])


def replayed(model: Model, commands: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The same by `sim=mujoco`."""
    t = np.arange(len(commands) + 1) * STEP
    inputs = Inputs.of([t], [np.vstack([commands, commands[-1:]])], [0])
    run = MujocoSimulator(step=STEP).replay(ModelBatch(model), inputs, start[:, None, None])
    return run.coordinates[:, :, 0, 0]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory):
    path = tmp_path_factory.mktemp("tree") / "tree.xml"
    path.write_text(mjcf(4, np.random.default_rng(7), friction=0.2), encoding="utf-8")
    return read_tree(path)


@pytest.mark.parametrize("effects", [EFFECTS["friction"], EFFECTS["everything"]], ids=["friction", "everything"])
def test_a_tree_moves_in_the_runtime_as_in_the_engine(effects: dict, tree, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    plant = robot_plant(tree, DRIVES)
    model = Model(plant, plant.complete({}, "robot.yaml"), effects)
    runtime = Runtime(model, export_mjcf(model, STEP).model)
    commands = np.repeat(rng.normal(size=(60, 3)), 8, axis=0)
    assert len(commands) > ROWS  # so that rows are forgotten
    start = 0.3 * rng.normal(size=8)
    shown = stepped(model, runtime, commands, start)
    np.testing.assert_allclose(shown, replayed(model, commands, start), rtol=0.0, atol=DIGITS)


@pytest.mark.parametrize("kind", ["wip", "double_pendulum"])
def test_a_plant_moves_in_the_runtime_as_in_the_engine(kind: str):
    """Its numbers have few digits, so that nothing is lost in the file; a payload comes during the motion."""
    event = {"geometry/payload_event": {"mass": 0.5, "height": 0.6, "t0": 0.0503}} if kind == "wip" else {}
    model = robot(kind, {**event, "actuator/delay": {"tau": 0.0123}})
    runtime = Runtime(model, export_mjcf(model).model)
    t = np.arange(150) * STEP
    commands = 0.3 * np.sin(9.0 * t)[:, None] * np.ones(len(model.plant.commands))
    shown = stepped(model, runtime, commands, np.array(LIVELY[kind]))
    np.testing.assert_allclose(shown, replayed(model, commands, np.array(LIVELY[kind])), rtol=0.0, atol=1e-9)


def test_a_step_is_that_of_the_file(tmp_path: Path):
    """A file with steps of 4 ms is stepped four times at once; a reset begins anew; the folder of an export opens."""
    model = robot("wip", {"pitch/coulomb": {"F_c": 0.1}, "sensor_theta/delay": {"tau": 0.004}})
    (tmp_path / "robot.xml").write_text(export_mjcf(model, 4e-3).text, encoding="utf-8")
    write_model(model, tmp_path / "model.yaml")
    runtime = Runtime.open(tmp_path)
    assert runtime.period == pytest.approx(4e-3)
    first = stepped(model, runtime, np.full((30, 1), 0.5), np.array(LIVELY["wip"]))
    assert runtime.data.time == pytest.approx(0.12)
    again = stepped(model, runtime, np.full((30, 1), 0.5), np.array(LIVELY["wip"]))
    np.testing.assert_array_equal(again, first)
    fine = replayed(model, np.full((120, 1), 0.5), np.array(LIVELY["wip"]))
    np.testing.assert_allclose(first, fine[::4], rtol=0.0, atol=1e-9)


def test_places_may_be_changed_between_steps(tmp_path: Path):
    model = robot("pendulum", {"pitch/coulomb": {"F_c": 0.1}})
    runtime = Runtime(model, export_mjcf(model).model)
    runtime.data.qpos[0], runtime.data.qvel[0] = 2.0, 1.0
    shown = np.array([runtime.step(np.zeros(1)).copy() for _ in range(50)])
    np.testing.assert_allclose(shown, replayed(model, np.zeros((50, 1)), np.array([2.0, 1.0]))[1:], atol=1e-9)


def test_the_robot_may_stand_in_a_scene(tmp_path: Path):
    """A ball that lies on a floor beside the robot stays there, and the robot moves as alone."""
    model = robot("pendulum", {"pitch/coulomb": {"F_c": 0.1}})
    file = export_mjcf(model)
    ball = '<geom type="plane" size="1 1 0.1" pos="5 0 0"/><body pos="5 0 0.1"><freejoint/><geom size="0.1"/></body>'
    scene = file.text.replace("<worldbody>", f"<worldbody>{ball}")
    runtime = Runtime(model, mujoco.MjModel.from_xml_string(scene))
    shown = stepped(model, runtime, np.zeros((200, 1)), np.array(LIVELY["pendulum"]))
    np.testing.assert_allclose(shown, replayed(model, np.zeros((200, 1)), np.array(LIVELY["pendulum"])), atol=1e-9)
    assert runtime.data.qpos[2] == pytest.approx(0.1, abs=1e-3)


def test_what_is_missing_is_named(tmp_path: Path):
    with pytest.raises(InputError, match=r"robot.xml: there is no such file; .*task=export"):
        Runtime.open(tmp_path)
    model = robot("wip")
    with pytest.raises(InputError, match="has no joint translation; it has pitch"):
        Runtime(model, export_mjcf(robot("pendulum")).model)
