"""Actuator settings for Isaac Lab."""

from pathlib import Path

import pytest
import yaml
from export.test_mjcf import OWNERS

from wipx.export.isaac import isaac_actuators
from wipx.recordings.robot_file import read_robot

pytest.importorskip("mujoco")


def test_each_joint_is_a_group_of_the_class_that_says_most(tmp_path: Path):
    (tmp_path / "arm.xml").write_text(OWNERS, encoding="utf-8")
    (tmp_path / "robot.yaml").write_text("plant: robot\nmodel: arm.xml\n", encoding="utf-8")
    effects = {
        "shoulder/stribeck": {"F_c": 0.1, "F_s": 0.15, "v_s": 0.1},
        "actuator_shoulder/speed_limit": {"F_stall": 3.0, "v_free": 6.0},
        "elbow/rotor_inertia": {"J": 0.002},
        "actuator_elbow/delay": {"tau": 0.0098},
        "actuator_elbow/gain": {"k": 0.5},
    }
    model = read_robot(tmp_path / "robot.yaml").model.with_effects(effects)
    said = yaml.safe_load(isaac_actuators(model, 0.005))
    assert said["physics_dt"] == 0.005
    assert said["actuators"]["shoulder"] == {
        "class": "DCMotorCfg",
        "joint_names_expr": ["shoulder"],
        "stiffness": 0.0,
        "damping": 0.0,
        "saturation_effort": 3.0,
        "velocity_limit": 6.0,
        "effort_limit": 3.0,
        "armature": pytest.approx(0.008),
        "friction": 0.15,
        "dynamic_friction": 0.1,
        "viscous_friction": pytest.approx(0.09),
    }
    elbow = said["actuators"]["elbow"]
    assert (elbow["class"], elbow["min_delay"], elbow["max_delay"]) == ("DelayedPDActuatorCfg", 2, 2)
    assert (elbow["stiffness"], elbow["damping"], elbow["armature"]) == (6.0, 0.25, pytest.approx(0.012))
