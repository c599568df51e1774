"""Inverse dynamics against MuJoCo's."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wipx.recordings.robot_model import read_tree
from wipx.sim.tree.inverse import needed_forces

mujoco: Any = pytest.importorskip("mujoco")
TREE = """<mujoco><worldbody><body name="cart"><inertial pos="0 0 0.1" mass="2" diaginertia="0.02 0.02 0.01"/>
<joint name="way" type="slide" axis="1 0 0" armature="0.3"/>
<body name="left" pos="0 0.1 0.3"><inertial pos="0.1 0 -0.2" mass="0.8" diaginertia="0.01 0.01 0.002"/>
<joint name="left" axis="0 1 0"/><body name="hand" pos="0 0 -0.4">
<inertial pos="0 0.02 -0.1" mass="0.3" diaginertia="0.002 0.002 0.001"/>
<joint name="twist" axis="0 0.6 0.8"/></body></body>
<body name="right" pos="0 -0.1 0.3"><inertial pos="0.05 0 -0.15" mass="0.6" diaginertia="0.01 0.01 0.002"/>
<joint name="right" axis="1 0 0"/></body></body></worldbody></mujoco>"""


def test_needed_forces_are_those_of_mujoco(tmp_path: Path):
    path = tmp_path / "tree.xml"
    path.write_text(TREE, encoding="utf-8")
    tree = read_tree(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    q, v, a = np.random.default_rng(2).standard_normal((3, 20, len(tree.links)))
    expected = []
    for row in range(20):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row], v[row], a[row]
        mujoco.mj_inverse(model, data)
        expected.append(data.qfrc_inverse.copy())
    np.testing.assert_allclose(needed_forces(tree, q, v, a), expected, rtol=1e-10, atol=1e-10)
