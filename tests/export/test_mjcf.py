"""Exported MJCF in MuJoCo against the compiled kernel: what is called exact moves alike, what is lost is said."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sim.random_trees import mjcf
from sim.robots import LIVELY, robot

from wipx.core.drive import Drive
from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import PLANTS, robot_plant
from wipx.core.tree import Tree
from wipx.export.file_simulator import FileSimulator
from wipx.export.mjcf import export_mjcf
from wipx.recordings.model_file import read_model, write_model
from wipx.recordings.robot_file import read_robot
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

mujoco: Any = pytest.importorskip("mujoco")
STEP = 2.5e-4  # [s]; MuJoCo's integrator is of first order
DRIVES = {
    "j0": Drive("torque", gain=2.0),
    "j1": Drive("position", kp=8.0, kd=0.4, limit=3.0),
    "j2": Drive("position", kp=5.0, kd=0.2),
}
EXACT = {
    "nothing": {},
    "viscous": {"j0/viscous": {"sigma": 0.3}},
    "drag": {"j0/quadratic_drag": {"c": 0.3}},
    "coulomb": {"j0/coulomb": {"F_c": 0.5}, "j1/coulomb": {"F_c": 0.3}},
    "asymmetric": {"j0/asymmetric_coulomb": {"F_plus": 0.5, "F_minus": 0.2}},
    "presliding": {"j0/presliding": {"F_c": 0.5, "stiffness": 40.0, "damping": 0.1}},
    "lugre": {"j0/lugre": {"F_c": 0.3, "F_s": 0.5, "v_s": 0.2, "stiffness": 40.0, "damping": 0.1}},
    "spring": {"j0/spring": {"k": 3.0, "q0": 0.5}},
    "rotor": {"j0/rotor_inertia": {"J": 0.1}},
    "gain": {"actuator_j0/gain": {"k": 0.7}, "actuator_j1/gain": {"k": 0.7}},
    "kp and kd": {"actuator_j1/kp": {"factor": 0.8}, "actuator_j2/kd": {"factor": 1.3}},
    "offset": {"actuator_j0/offset": {"F_0": 0.3}, "actuator_j1/offset": {"F_0": 0.3}},
    "saturation": {"actuator_j0/saturation": {"F_max": 1.0}, "actuator_j1/saturation": {"F_max": 1.0}},
    "lag": {"actuator_j0/lag": {"tau": 0.03}, "actuator_j2/lag": {"tau": 0.01}},
    "saturation and lag": {"actuator_j0/lag": {"tau": 0.03}, "actuator_j0/saturation": {"F_max": 1.0}},
    "ripple": {"actuator_j0/ripple": {"A": 0.5, "n": 7.0, "phase": 0.4}},
    "delay": {"actuator_j0/delay": {"tau": 0.0073}, "actuator/delay": {"tau": 0.012}},
    "late sensor": {"sensor_j0/delay": {"tau": 0.012}},
    "bodies": {
        "link_b1/payload": {"mass": 0.4, "x": 0.05, "y": -0.1, "z": 0.1},
        "link_b2/com_offset": {"x": 0.02, "y": 0.01, "z": -0.03},
        "link_b0/inertia": {"scale": 1.3},
        "environment/base_tilt": {"roll": 0.1, "pitch": -0.05},
    },
}
APPROXIMATED = {
    "stribeck": ({"j0/stribeck": {"F_c": 0.3, "F_s": 0.6, "v_s": 0.2}}, 0.05),
    "lag behind a limit": ({"actuator_j1/lag": {"tau": 0.03}}, 0.1),
    "speed limit": ({"actuator_j0/speed_limit": {"F_stall": 1.5, "v_free": 20.0}}, 0.01),
    "speed limit and lag": (
        {"actuator_j0/speed_limit": {"F_stall": 1.5, "v_free": 20.0}, "actuator_j0/lag": {"tau": 0.02}},
        0.01,
    ),
}
LOST = {
    "actuator_j0/dead_zone": {"band": 0.5},
    "actuator_j0/backlash": {"gap": 0.05},
    "actuator_j1/elasticity": {"drive_inertia": 0.02, "stiffness": 50.0, "damping": 0.1},
    "sensor_j0/bias": {"b": 0.1},
    "sensor_j1/scale": {"e": 0.1},
    "j1/load_friction": {"K_motor": 0.1, "K_external": 0.1},
    "j1/sticky_spot": {"F_c": 0.3, "lo": -0.1, "hi": 0.1},
}
OWNERS = """<mujoco>
  <compiler angle="degree"/>
  <option timestep="0.00025" integrator="implicitfast"/>
  <asset><material name="red" rgba="1 0 0 1"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0" damping="0.05" range="-170 170"/>
      <inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
      <geom name="bone" type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3" material="red" contype="0" conaffinity="0"/>
      <body name="forearm" pos="0 0 -0.3" euler="0 10 0">
        <joint name="elbow" axis="0 -1 0" armature="0.01"/>
        <inertial pos="0 0 -0.15" mass="0.3" diaginertia="0.004 0.004 0.0005"/>
        <body name="hand" pos="0 0 -0.3"><inertial pos="0 0 -0.05" mass="0.1" diaginertia="0.0005 0.0005 0.0001"/>
          <site name="grip" pos="0 0 -0.1"/></body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" joint="shoulder" gear="2" armature="0.002" damping="0.01"/>
    <position name="m2" joint="elbow" kp="12" kv="0.5"/>
  </actuator>
  <keyframe><key name="home" qpos="0.1 0.2" ctrl="0.3 0.4"/></keyframe>
</mujoco>"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    path = tmp_path_factory.mktemp("tree") / "tree.xml"
    path.write_text(mjcf(3, np.random.default_rng(7)), encoding="utf-8")
    return read_tree(path)


def model_of(tree: Tree, effects: dict) -> Model:
    plant = robot_plant(replace(tree, source=None), DRIVES)
    return Model(plant, plant.complete({}, "robot.yaml"), effects)


def motions(model: Model, start: np.ndarray, duration: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates in the kernel and in the exported file, each (rows, joints)."""
    t = np.arange(0.0, duration + 1e-9, 0.005)
    sizes = np.array([2.0, 0.5, 0.4])[: len(model.plant.commands)]
    commands = sizes * np.sin(np.array([9.0, 5.0, 4.0])[: len(sizes)] * t[:, None])
    inputs, initial = Inputs.of([t], [commands], [0]), start[:, None, None]
    file = FileSimulator(file=export_mjcf(model, STEP))
    ours, theirs = (s.replay(ModelBatch(model), inputs, initial) for s in (AnalyticSimulator(STEP), file))
    return ours.coordinates[:, :, 0, 0], theirs.coordinates[:, :, 0, 0]


@pytest.mark.parametrize("effects", EXACT.values(), ids=list(EXACT))
def test_what_is_exact_moves_as_in_the_kernel(effects: dict, tree: Tree):
    model = model_of(tree, effects)
    assert {s.status for s in export_mjcf(model, STEP).statements} <= {"exact"}
    ours, theirs = motions(model, np.zeros(6))
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-3)  # of motions of 1 rad; first order in the step


@pytest.mark.parametrize(("effects", "share"), APPROXIMATED.values(), ids=list(APPROXIMATED))
def test_what_is_approximated_is_far_nearer_than_nothing(effects: dict, share: float, tree: Tree):
    model = model_of(tree, effects)
    assert "approximated" in {s.status for s in export_mjcf(model, STEP).statements}
    ours, theirs = motions(model, np.zeros(6))
    bare, _ = motions(model_of(tree, {}), np.zeros(6))
    assert np.abs(theirs - ours).max() < share * np.abs(bare - ours).max() + 1e-3


def test_what_mjcf_lacks_is_called_lost(tree: Tree):
    said = export_mjcf(model_of(tree, LOST), STEP).statements
    assert [(s.effect, s.status) for s in said] == [(name, "lost") for name in LOST]


@pytest.mark.parametrize("kind", sorted(PLANTS))
def test_the_plants_are_exported_too(kind: str):
    site = PLANTS[kind].joints[-1]
    effects = {f"{site}/coulomb": {"F_c": 0.05}, f"{site}/viscous": {"sigma": 0.02}, "actuator/gain": {"k": 0.9}}
    if kind in ("wip", "cartpole"):
        effects |= {"environment/rail_tilt": {"angle": 0.05}, "geometry/payload": {"mass": 0.3, "height": 0.5}}
    ours, theirs = motions(robot(kind, effects), np.array(LIVELY[kind]), 0.3)
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-3)


def test_a_sticking_joint_stays_where_it_is(tree: Tree):
    """Also in the file alone: the constraint is as stiff as the step allows."""
    model = model_of(tree, {f"j{i}/coulomb": {"F_c": 50.0} for i in range(3)})
    _, theirs = motions(model, np.zeros(6))
    assert np.abs(theirs).max() < 1e-5


@pytest.fixture
def owners(tmp_path: Path) -> Path:
    """A folder with an owner's file and a model.yaml that was read from it."""
    (tmp_path / "arm.xml").write_text(OWNERS, encoding="utf-8")
    (tmp_path / "robot.yaml").write_text("plant: robot\nmodel: arm.xml\n", encoding="utf-8")
    effects = {
        "shoulder/spring": {"k": 2.0, "q0": 0.3},
        "link_forearm/payload": {"mass": 0.2, "x": 0, "y": 0, "z": -0.3},
    }
    write_model(read_robot(tmp_path / "robot.yaml").model.with_effects(effects), tmp_path / "model.yaml")
    return tmp_path


def test_the_owners_file_is_kept_but_for_what_the_model_changes(owners: Path):
    model = read_model(owners / "model.yaml")
    file = export_mjcf(model)
    before, after = mujoco.MjModel.from_xml_string(OWNERS), file.model
    assert file.source == owners / "arm.xml"
    for part in ("geom", "site", "light", "key", "actuator"):
        many = {"light": "nlight", "key": "nkey", "actuator": "nu"}.get(part, f"n{part}")
        assert getattr(after, many) == getattr(before, many)
    assert after.mat_rgba[after.geom("bone").matid].ravel().tolist() == [1.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(after.jnt_range, before.jnt_range, atol=1e-5)
    assert after.body("hand").mass == before.body("hand").mass
    assert after.body("forearm").mass[0] == pytest.approx(0.5)
    assert after.body("upper").mass == before.body("upper").mass
    assert after.actuator("m1").gear[0] == 2.0
    assert after.joint("shoulder").stiffness[0] == 2.0
    assert after.qpos_spring[0] == pytest.approx(0.3, abs=1e-6)
    start = np.array([0.1, 0.2, 0.0, 0.0])
    ours, theirs = motions(model, start)
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-3)


def test_what_an_actuator_adds_to_its_joint_stays(owners: Path):
    """The motor of the shoulder has an inertia and a damping of its own, through its gear."""
    model = read_model(owners / "model.yaml")
    assert model.value("shoulder.armature") == pytest.approx(0.008)
    assert model.value("shoulder.damping") == pytest.approx(0.09)
    effects = {
        "actuator_shoulder/lag": {"tau": 0.01},
        "shoulder/rotor_inertia": {"J": 0.003},
        "shoulder/stribeck": {"F_c": 0.05, "F_s": 0.06, "v_s": 0.5},
        "elbow/viscous": {"sigma": 0.02},
    }
    changed = model.with_effects(effects)
    file = export_mjcf(changed)
    assert file.source is not None
    ours, theirs = motions(changed, np.array([0.1, 0.2, 0.0, 0.0]))
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-3)


def test_joints_that_are_locked_at_zero_leave_the_file(owners: Path):
    arm = owners / "arm.xml"
    held = '<equality><joint joint1="elbow"/></equality></mujoco>'
    arm.write_text(arm.read_text(encoding="utf-8").replace("</mujoco>", held), encoding="utf-8")
    (owners / "robot.yaml").write_text("plant: robot\nmodel: arm.xml\nlocked: {elbow: 0.0}\n", encoding="utf-8")
    model = read_robot(owners / "robot.yaml").model.with_effects({"shoulder/viscous": {"sigma": 0.1}})
    file = export_mjcf(model)
    assert (file.source, file.note) == (arm, "")
    assert (file.model.njnt, file.model.nu, file.model.nkey, file.model.neq) == (1, 1, 1, 0)
    assert file.model.key_qpos.tolist() == [[0.1]]
    ours, theirs = motions(model, np.array([0.4, 0.0]))
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("damage", "note"),
    [
        (lambda text: None, "not there any more"),
        (lambda text: text.replace('mass="0.5"', 'mass="0.6"'), "has changed since"),
        (lambda text: text.replace('axis="0 -1 0" armature', 'axis="0 -2 1" armature'), "has changed since"),
    ],
)
def test_a_file_that_is_not_what_it_was_is_not_used(owners: Path, damage: Any, note: str):
    model, path = read_model(owners / "model.yaml"), owners / "arm.xml"
    text = damage(OWNERS)
    path.unlink()
    if text is not None:
        path.write_text(text, encoding="utf-8")
    file = export_mjcf(model)
    assert file.source is None
    assert note in file.note
    assert file.model.body("forearm").mass[0] == pytest.approx(0.6)  # the hand is welded to it


def test_a_link_that_is_no_rigid_body_is_refused(tree: Tree):
    with pytest.raises(InputError, match="cannot do link b1"):
        export_mjcf(model_of(tree, {"link_b1/payload": {"mass": -5.0, "x": 0.5, "y": 0.0, "z": 0.0}}))
