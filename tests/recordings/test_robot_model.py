"""Robots from model files: what is read, what is refused in one line, and the way through a model.yaml and back."""

import os
from pathlib import Path

import numpy as np
import pybullet_data
import pytest

from wipx.core.drive import Drive
from wipx.core.errors import InputError
from wipx.core.model import ModelBatch
from wipx.effects.catalogue import vocabulary
from wipx.recordings.model_file import read_model, write_model
from wipx.recordings.robot_file import read_robot
from wipx.recordings.robot_model import read_drives, read_tree
from wipx.sim.coefficients import coefficients

BODY = '<inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.001"/>'
ARM = (
    f'<mujoco><worldbody><body name="upper">{BODY}<joint name="shoulder" axis="0 -1 0" damping="0.1"/>'
    f'<body name="hand" pos="0 0 -0.4">{BODY}<joint name="wrist" type="slide" axis="0 0 1"/></body></body></worldbody>'
    '<actuator><motor joint="shoulder"/></actuator></mujoco>'
)
URDF = """<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0 0 -0.2"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="not_there.stl"/></geometry></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/>
<limit lower="-2" upper="2" effort="9" velocity="1"/><dynamics damping="0.1" friction="0.2"/></joint></robot>"""
PYBULLET = Path(pybullet_data.getDataPath())
PUBLIC = [
    path
    for pattern in ("*.urdf", "*.xml")
    for path in sorted(PYBULLET.rglob(pattern))
    if "random_urdfs" not in path.parts and "<joint" in path.read_text(encoding="utf-8", errors="replace")
]
ARMS = Path(os.environ.get("WIPX_ARMS", Path(__file__).parents[3] / "shared" / "arms"))


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def described(folder: Path, text: str) -> Path:
    written(folder / "arm.xml", ARM)
    return written(folder / "robot.yaml", text)


def test_a_file_gives_joints_links_and_friction(tmp_path: Path):
    tree = read_tree(written(tmp_path / "arm.xml", ARM))
    assert tree.joints == ("shoulder", "wrist")
    assert [link.body for link in tree.links] == ["upper", "hand"]
    assert [link.slides for link in tree.links] == [False, True]
    assert [link.damping for link in tree.links] == [0.1, 0.0]


def test_meshes_need_not_be_there(tmp_path: Path):
    link = read_tree(written(tmp_path / "arm.urdf", URDF)).links[0]
    assert (link.damping, link.friction, link.effort, link.limits) == (0.1, 0.2, 9.0, (-2.0, 2.0))


def test_a_locked_joint_joins_its_links(tmp_path: Path):
    tree = read_tree(written(tmp_path / "arm.xml", ARM), {"wrist": 0.1})
    assert tree.joints == ("shoulder",)
    assert tree.links[0].mass == 2.0
    np.testing.assert_allclose(np.linalg.norm(tree.links[0].com), (0.2 + 0.5) / 2.0)  # 0.4 - 0.1 + 0.2 below


def test_what_acts_on_locked_joints_only_is_left_out(tmp_path: Path):
    finger = f'<body name="{{0}}">{BODY}<joint name="{{0}}" type="slide" axis="0 1 0" stiffness="5"/></body>'
    gripper = (
        '<equality><joint joint1="left" joint2="right"/></equality>'
        '<tendon><fixed name="split"><joint joint="left" coef="1"/><joint joint="right" coef="1"/></fixed></tendon>'
        '<actuator><general tendon="split" biastype="affine"/></actuator>'
    )
    text = ARM.replace("<actuator>", gripper + "<actuator>")
    text = text.replace("</body></body>", f"{finger.format('left')}{finger.format('right')}</body></body>")
    path = written(tmp_path / "arm.xml", text)
    with pytest.raises(InputError, match=r"left and right are coupled .* lock both joints"):
        read_tree(path, {"left": 0.0})
    locked = {"left": 0.0, "right": 0.0}
    tree = read_tree(path, locked)
    assert tree.joints == ("shoulder", "wrist")
    assert tree.links[1].mass == 3.0
    assert set(read_drives(path, locked)) == {"shoulder"}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('<mesh filename="not_there.stl"/>', '<box size="1 2"/>'),  # a shape that is at fault
        ("<robot", '\n<?xml version="1.0"?><robot'),  # a declaration that is not first
    ],
)
def test_a_urdf_is_read_whatever_does_not_move_in_it(before: str, after: str, tmp_path: Path):
    assert read_tree(written(tmp_path / "arm.urdf", URDF.replace(before, after))).joints == ("shoulder",)


@pytest.mark.parametrize("path", PUBLIC, ids=lambda path: path.stem)
def test_a_public_robot_is_read_or_refused_in_one_line(path: Path):
    """PyBullet comes with robots that others have written."""
    refusal = ""
    try:
        read_tree(path)
    except InputError as error:
        refusal = str(error)
    assert "\n" not in refusal


@pytest.mark.parametrize(
    ("name", "locked", "joints", "mass"),
    [
        ("kuka_iiwa/model.urdf", (), 7, 17.5),
        ("franka_panda/panda.urdf", ("panda_finger_joint1", "panda_finger_joint2"), 7, 15.06),
        ("a1/a1.urdf", (), 12, 4 * (0.696 + 1.013 + 0.166 + 0.06)),
    ],
)
def test_a_public_robot_has_its_joints_and_masses(name: str, locked: tuple[str, ...], joints: int, mass: float):
    tree = read_tree(PYBULLET / name, dict.fromkeys(locked, 0.0))
    assert len(tree.links) == joints
    assert sum(link.mass for link in tree.links) == pytest.approx(mass, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ARM.replace('name="shoulder" axis="0 -1 0" damping="0.1"', 'name="root" type="free"'), "root is a free joint"),
        (ARM.replace('name="shoulder" axis="0 -1 0"', 'name="ball" type="ball"'), "ball is a ball joint"),
        (
            ARM.replace("<actuator>", '<equality><joint joint1="shoulder" joint2="wrist"/></equality><actuator>'),
            "shoulder and wrist are coupled",
        ),
        (ARM.replace('damping="0.1"', 'stiffness="3"'), "joint shoulder has a spring"),
        (ARM.replace('damping="0.1"', 'damping="0.1 0.2"'), "joint shoulder has damping beyond the linear"),
        ("<mujoco><worldbody/></mujoco>", "no joint"),
        ("joints: 3", "expected an MJCF or URDF file"),
        (ARM.replace(BODY, "", 1).replace(BODY, ""), "body upper moves and has no mass"),
        (
            ARM.replace("0.01 0.01 0.001", "0.1 0.01 0.001", 1),
            r"body upper has an inertia that no body can have.*0\.1 > 0\.001 \+ 0\.01 kg m\^2",
        ),
        (ARM[:-20], "not XML"),
        (ARM.replace('"wrist"', '"t"'), "the column t would be time"),
        (ARM.replace('"wrist"', '"shoulder_dot"'), "column shoulder_dot would be the rate of joint shoulder"),
        (ARM.replace('"wrist"', '"u_shoulder"'), "column u_shoulder would be the command of joint shoulder"),
        (ARM.replace('"wrist"', '"environment"'), "the site environment"),
        (ARM.replace('"wrist"', '"left/wrist"'), "'/' in its name"),
    ],
)
def test_what_is_no_open_tree_is_refused_in_one_line(text: str, message: str, tmp_path: Path):
    with pytest.raises(InputError, match=message) as error:
        read_tree(written(tmp_path / "arm.xml", text))
    assert "\n" not in str(error.value)
    assert "arm.xml" in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("plant: robot\n", "model is None"),
        ("plant: robot\nmodel: gone.xml\n", "no such file"),
        ("plant: robot\nmodel: arm.xml\nlocked: {finger: 0.0}\n", "no joint finger"),
        ("plant: robot\nmodel: arm.xml\ndrives: {elbow: {kind: torque}}\n", "unknown joint 'elbow'"),
        ("plant: robot\nmodel: arm.xml\ndrives: {wrist: {kind: servo}}\n", "unknown kind of drive 'servo'"),
        ("plant: robot\nmodel: arm.xml\ndrives: {wrist: {kind: position}}\n", "kp is None"),
        ("plant: robot\nmodel: arm.xml\ndrives: {wrist: {kind: torque, kp: 3}}\n", "unknown setting 'kp'"),
    ],
)
def test_bad_descriptions_are_refused(text: str, message: str, tmp_path: Path):
    with pytest.raises(InputError, match=message):
        read_robot(described(tmp_path, text))


def test_uncertain_places_are_in_metres(tmp_path: Path):
    robot = read_robot(
        described(tmp_path, "plant: robot\nmodel: arm.xml\nuncertainty: {hand.mass: 0.1, hand.com: 0.02}\n")
    )
    assert robot.uncertainty == {"hand.mass": 0.1, "hand.com_x": 0.02, "hand.com_y": 0.02, "hand.com_z": 0.02}


def test_a_model_file_holds_the_robot_itself(tmp_path: Path):
    text = "plant: robot\nmodel: arm.xml\ndrives: {wrist: {kind: position, kp: 30.0, kd: 1.0}}\n"
    robot = read_robot(described(tmp_path, text)).model.with_effects({"shoulder/coulomb": {"F_c": 0.2}})
    write_model(robot, tmp_path / "model.yaml")
    (tmp_path / "arm.xml").unlink()
    again = read_model(tmp_path / "model.yaml")
    assert again.effects == robot.effects
    assert again.plant.drives == robot.plant.drives
    before, after = (coefficients(ModelBatch(model)) for model in (robot, again))
    np.testing.assert_array_equal(after.body, before.body)
    np.testing.assert_array_equal(after.joints, before.joints)


def test_what_a_logged_torque_hides_is_not_asked_for(tmp_path: Path):
    text = "plant: robot\nmodel: arm.xml\ndrives: {shoulder: {kind: torque, logged: motor}, wrist: {kind: none}}\n"
    names = vocabulary(read_robot(described(tmp_path, text)).model.plant)
    assert {"actuator_shoulder/gain", "shoulder/coulomb", "link_hand/payload", "sensor_wrist/bias"} <= names.keys()
    assert not {"actuator_shoulder/delay", "actuator_shoulder/dead_zone", "actuator_wrist/gain"} & names.keys()


@pytest.mark.parametrize("arm", ["staubli_tx40", "kuka_kr300", "ur10_unisa"])
def test_arms_of_public_recordings_are_read(arm: str):
    folder = ARMS / arm / "visible"
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing: recordings of real arms; WIPX_ARMS names their folder")
    robot = read_robot(folder / "robot.yaml")
    assert len(robot.model.plant.joints) == 6
    assert robot.model.plant.commands == tuple(f"u_{joint}" for joint in robot.model.plant.joints)


def test_a_joint_that_is_left_out_has_the_drive_of_the_file(tmp_path: Path):
    actuators = '<motor joint="shoulder" gear="50"/><position joint="wrist" kp="30" kv="2" forcerange="-3 3"/>'
    arm = ARM.replace('<motor joint="shoulder"/>', actuators)
    written(tmp_path / "arm.xml", arm)
    plain = written(tmp_path / "robot.yaml", "plant: robot\nmodel: arm.xml\n")
    drives = read_robot(plain).model.plant.drives
    assert drives["shoulder"] == Drive("torque", gain=50.0)
    assert drives["wrist"] == Drive("position", kp=30.0, kd=2.0, limit=3.0)
    said = written(tmp_path / "robot.yaml", "plant: robot\nmodel: arm.xml\ndrives: {wrist: {kind: torque}}\n")
    assert read_robot(said).model.plant.drives["wrist"] == Drive("torque")
    written(tmp_path / "arm.xml", arm.replace('kp="30"', 'kp="30" gear="2"'))
    with pytest.raises(InputError, match="neither the only motor nor the only position servo"):
        read_robot(plain)
