"""An owner's own URDF is kept but for what a completed model changes."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from wipx.core.model import Model
from wipx.core.tree import Link, Tree
from wipx.export.urdf_file import export_urdf
from wipx.recordings.model_file import read_model, write_model
from wipx.recordings.robot_file import read_robot
from wipx.recordings.robot_model import read_tree
from wipx.sim.mechanism import mechanism

pytest.importorskip("mujoco")
OWNERS = """<?xml version="1.0"?>
<robot name="arm">
  <!-- bought in 2019 -->
  <link name="base"><visual><geometry><mesh filename="meshes/base.stl"/></geometry></visual></link>
  <link name="upper">
    <inertial><origin xyz="0 0 -0.2" rpy="0.1 0 0"/><mass value="0.5"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://arm/upper.stl"/></geometry></visual>
  </link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 1"/>
    <axis xyz="0 -1 0"/><limit lower="-2" upper="2" effort="30" velocity="4"/><dynamics damping="0.05"/></joint>
  <link name="forearm"><inertial><origin xyz="0 0 -0.15"/><mass value="0.3"/>
    <inertia ixx="0.004" iyy="0.004" izz="0.0005" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="forearm"/><origin xyz="0 0 -0.3"/>
    <axis xyz="0 -1 0"/></joint>
  <link name="hand"><inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/>
    <inertia ixx="0.0005" iyy="0.0005" izz="0.0001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="weld" type="fixed"><parent link="forearm"/><child link="hand"/><origin xyz="0 0 -0.3"/></joint>
</robot>
"""
FOUND = {
    "shoulder/coulomb": {"F_c": 0.2},
    "elbow/viscous": {"sigma": 0.03},
    "actuator_elbow/saturation": {"F_max": 5.0},
    "link_forearm/payload": {"mass": 0.2, "x": 0.02, "y": 0.0, "z": -0.3},
    "link_upper/com_offset": {"x": 0.01, "y": 0.0, "z": 0.02},
}


def completed(folder: Path, effects: dict) -> Model:
    (folder / "arm.urdf").write_text(OWNERS, encoding="utf-8")
    (folder / "robot.yaml").write_text("plant: robot\nmodel: arm.urdf\n", encoding="utf-8")
    write_model(read_robot(folder / "robot.yaml").model.with_effects(effects), folder / "model.yaml")
    return read_model(folder / "model.yaml")


def test_the_file_is_kept_but_for_what_the_model_changes(tmp_path: Path):
    model = completed(tmp_path, FOUND)
    file = export_urdf(model)
    assert file.source == tmp_path / "arm.urdf"
    assert "<!-- bought in 2019 -->" in file.text
    meshes = [mesh.get("filename") for mesh in ElementTree.fromstring(file.text).iter("mesh")]
    assert meshes == [str(tmp_path / "meshes" / "base.stl"), "package://arm/upper.stl"]
    joints = {joint.get("name"): joint for joint in ElementTree.fromstring(file.text).iter("joint")}
    limit, dynamics = joints["shoulder"].find("limit"), joints["shoulder"].find("dynamics")
    assert limit is not None
    assert dynamics is not None
    assert limit.attrib == {"lower": "-2", "upper": "2", "effort": "30", "velocity": "4"}
    assert dynamics.attrib == {"damping": "0.05", "friction": "0.2"}
    elbow = joints["elbow"].find("limit")
    assert elbow is not None
    assert elbow.get("effort") == "5.0"


@pytest.mark.parametrize("tilt", [{}, {"environment/base_tilt": {"roll": 0.2, "pitch": -0.1}}], ids=["level", "tilted"])
def test_the_file_read_again_is_the_completed_robot(tilt: dict, tmp_path: Path):
    model = completed(tmp_path, {**FOUND, **tilt})
    again = tmp_path / "again.urdf"
    again.write_text(export_urdf(model).text, encoding="utf-8")
    wanted, found = mechanism(model).tree, read_tree(again)
    assert found.joints == wanted.joints
    for one, other in zip(found.links, wanted.links, strict=True):
        assert one.mass == pytest.approx(other.mass, rel=1e-9)
        for mine, its in zip(in_its_body(one), in_its_body(other), strict=True):
            np.testing.assert_allclose(mine, its, atol=1e-9)
    np.testing.assert_allclose(down(found), down(wanted), atol=1e-9)


def down(tree: Tree) -> np.ndarray:
    """Gravity in the axes of the first body, shape (3,)."""
    return tree.gravity @ tree.links[0].rotation @ tree.links[0].body_rotation


def in_its_body(link: Link) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass (3,) and inertia (3, 3) in the axes of the body itself."""
    turn = link.body_rotation
    return turn.T @ (link.com - link.body_place), turn.T @ link.inertia @ turn


def test_a_file_that_has_changed_is_not_used(tmp_path: Path):
    model = completed(tmp_path, FOUND)
    (tmp_path / "arm.urdf").write_text(OWNERS.replace('value="0.5"', 'value="0.6"'), encoding="utf-8")
    file = export_urdf(model)
    assert (file.source, file.note) == (None, "the file has changed since")
    assert "mesh" not in file.text
