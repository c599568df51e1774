"""Exported URDF: the same bodies, damping and friction as the model, whatever the direction of gravity."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sim.random_trees import mjcf
from sim.robots import robot

from wipx.core.model import Model
from wipx.core.plant import PLANTS, robot_plant
from wipx.export.mjcf import export_mjcf
from wipx.export.urdf_file import export_urdf
from wipx.recordings.robot_model import read_tree

mujoco: Any = pytest.importorskip("mujoco")
EFFECTS = {
    "j0/viscous": {"sigma": 0.3},
    "j1/stribeck": {"F_c": 0.2, "F_s": 0.4, "v_s": 0.1},
    "link_b1/payload": {"mass": 0.4, "x": 0.05, "y": -0.1, "z": 0.1},
    "environment/base_tilt": {"roll": 0.1, "pitch": -0.05},
    "actuator_j0/gain": {"k": 0.8},
    "actuator_j2/saturation": {"F_max": 3.0},
    "sensor_j0/bias": {"b": 0.1},
}


def dynamics(model: Any, joints: tuple[str, ...], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (N, N) without armature and bias forces (N,) at a random state."""
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    order = [int(model.joint(name).dofadr[0]) for name in joints]
    data.qpos[order], data.qvel[order] = rng.uniform(-2.0, 2.0, len(order)), rng.normal(size=len(order))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return (full - np.diag(model.dof_armature))[np.ix_(order, order)], data.qfrc_bias[order]


@pytest.mark.parametrize("joints", [1, 3, 6])
def test_a_tree_has_the_same_bodies_in_both_formats(joints: int, tmp_path: Path, fresh_seed: int):
    path = tmp_path / "tree.xml"
    path.write_text(mjcf(joints, np.random.default_rng(fresh_seed)), encoding="utf-8")
    plant = robot_plant(replace(read_tree(path), source=None), {})
    have = {site for site in plant.sites}
    effects = {name: values for name, values in EFFECTS.items() if name.partition("/")[0] in have}
    model = Model(plant, plant.complete({}, "robot.yaml"), effects)
    ours, theirs = (
        dynamics(file.model, plant.joints, np.random.default_rng(fresh_seed))
        for file in (export_mjcf(model), export_urdf(model))
    )
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-4 * np.abs(one).max())  # six digits in MJCF


@pytest.mark.parametrize("kind", sorted(PLANTS))
def test_the_plants_are_written_too(kind: str, fresh_seed: int):
    model = robot(kind)
    ours, theirs = (
        dynamics(file.model, model.plant.joints, np.random.default_rng(fresh_seed))
        for file in (export_mjcf(model), export_urdf(model))
    )
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-4 * max(1.0, np.abs(one).max()))


def test_every_effect_has_its_status(tmp_path: Path):
    path = tmp_path / "tree.xml"
    path.write_text(mjcf(3, np.random.default_rng(7)), encoding="utf-8")
    plant = robot_plant(read_tree(path), {})
    file = export_urdf(Model(plant, plant.complete({}, "robot.yaml"), EFFECTS))
    said = {s.effect: s.status for s in file.statements}
    armature = {f"j{i}.armature": "lost" for i in range(3)}
    assert said == armature | {
        "j0/viscous": "exact",
        "j1/stribeck": "approximated",
        "link_b1/payload": "exact",
        "environment/base_tilt": "exact",
        "actuator_j0/gain": "lost",
        "actuator_j2/saturation": "approximated",
        "sensor_j0/bias": "lost",
    }
    assert 'damping="0.3"' in file.text
    assert 'friction="0.2"' in file.text
    assert 'effort="3.0"' in file.text
