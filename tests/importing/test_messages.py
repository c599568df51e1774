"""What the fields of messages are called, and what they hold."""

import json
from math import cos, sin
from pathlib import Path
from typing import Any

import can
import log_writers as logs
import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.importing.formats.message_fields import NameTwiceError, fields_of, stamp_of


def write_ros2(path: Path, kind: str, messages: list[tuple[int, object]]) -> Path:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9) as writer:
        connection = writer.add_connection("/topic", kind, typestore=store)
        for stamp, message in messages:
            writer.write(connection, stamp, store.serialize_cdr(message, kind))
    return path


def ros_types() -> dict[str, Any]:
    from rosbags.typesys import Stores, get_typestore

    return dict(get_typestore(Stores.ROS2_JAZZY).types)


def test_elements_carry_the_names_that_a_message_gives_them():
    point = {"positions": [0.1, 0.2], "time_from_start": {"sec": 1, "nanosec": 500_000_000}}
    state = {
        "header": {"stamp": {"sec": 3, "nanosec": 7}},
        "joint_names": ["a", "b"],
        "reference": point,
        "k": [1, 2, 3],
    }
    assert fields_of(state) == {
        "reference.positions.a": 0.1,
        "reference.positions.b": 0.2,
        "reference.time_from_start": 1.5,
        "k[0]": 1.0,
        "k[1]": 2.0,
        "k[2]": 3.0,
    }
    assert stamp_of(state) == 3_000_000_007
    with pytest.raises(NameTwiceError, match=r"k\.a"):
        fields_of({"name": ["a", "a"], "k": [1, 2]})


@pytest.mark.parametrize("angle", [-1.2, 0.0, 0.4])
def test_a_quaternion_gives_its_angles(angle: float):
    half = 0.5 * angle
    about_y = fields_of({"orientation": {"x": 0.0, "y": sin(half), "z": 0.0, "w": cos(half)}})
    assert about_y["orientation.pitch"] == pytest.approx(angle)
    about_x = fields_of({"orientation": {"x": sin(half), "y": 0.0, "z": 0.0, "w": cos(half)}})
    assert about_x["orientation.roll"] == pytest.approx(angle)


def test_an_imu_and_its_pitch_are_read(imported, tmp_path: Path):
    types = ros_types()
    time, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    imu = types["sensor_msgs/msg/Imu"]
    motion = logs.motion(np.random.default_rng(0), 200)
    pitch, none = 0.5 * motion.positions[:, 0], np.zeros(9)
    messages = []
    for k, stamp in enumerate(motion.stamps.tolist()):
        head = header(stamp=time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="")
        turned = quaternion(x=0.0, y=sin(0.5 * pitch[k]), z=0.0, w=cos(0.5 * pitch[k]))
        rates, still = vector(x=0.0, y=motion.rates[k, 0], z=0.0), vector(x=0.0, y=0.0, z=0.0)
        messages.append((stamp, imu(head, turned, none, rates, none, still, none)))
    path = write_ros2(tmp_path / "imu", "sensor_msgs/msg/Imu", messages)
    absent = {"stream": "/odom", "field": "x", "optional": True}
    columns = {
        "theta": {"stream": "/topic", "field": "orientation.pitch"},
        "theta_dot": {"stream": "/topic", "field": "angular_velocity.y"},
        "x": absent,
        "u": absent,
    }
    recording = logs.recorded(imported(path, "wheeled_robot", columns=columns))
    np.testing.assert_allclose(recording["theta"], pitch, atol=1e-12)
    np.testing.assert_allclose(recording["theta_dot"], motion.rates[:, 0])


def test_points_of_a_trajectory_count_from_their_own_time_until_the_next_trajectory(imported, tmp_path: Path):
    types = ros_types()
    time, duration = types["builtin_interfaces/msg/Time"], types["builtin_interfaces/msg/Duration"]
    header, trajectory = types["std_msgs/msg/Header"], types["trajectory_msgs/msg/JointTrajectory"]
    point, none = types["trajectory_msgs/msg/JointTrajectoryPoint"], np.zeros(0)

    def message(second: int, targets: list[float]) -> tuple[int, object]:
        stamp = logs.EPOCH + second * 10**9
        points = [point(np.array([q]), none, none, none, duration(sec=k, nanosec=0)) for k, q in enumerate(targets)]
        return stamp, trajectory(header(time(sec=stamp // 10**9, nanosec=0), ""), ["elbow"], points)

    path = write_ros2(
        tmp_path / "bag",
        "trajectory_msgs/msg/JointTrajectory",
        [message(0, [0.0, 1.0, 2.0, 3.0]), message(2, [5.0, 6.0, 7.0])],
    )
    columns = {"*": {"stream": "/topic", "field": "positions.*", "unit": "rad"}}
    log = imported(path, "joint_state", columns=columns, longest_gap=2.0)
    recording = logs.recorded(log)
    np.testing.assert_allclose(recording["t"], [0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(recording["elbow"], [0.0, 1.0, 5.0, 6.0, 7.0])


def test_shares_of_a_range_become_degrees(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 200)
    path = logs.write_lerobot(tmp_path / "set", [motion], 3)
    ranges = {"shoulder": (1000, 3000), "elbow": (500, 3500)}
    motors = {joint: {"id": 1, "range_min": low, "range_max": high} for joint, (low, high) in ranges.items()}
    (tmp_path / "arm.json").write_text(json.dumps(motors))
    log = imported(path, "lerobot_so_arm", format={"calibration": str(tmp_path / "arm.json")})
    for k, joint in enumerate(logs.JOINTS):
        low, high = ranges[joint]
        turns = (high - low) / 200.0 / 4095.0  # of a servo, for each of the 200 parts of its range
        expected = np.degrees(motion.positions[:, k]) * turns * 2.0 * np.pi
        np.testing.assert_allclose(logs.recorded(log)[joint], expected, atol=1e-9)


def test_units_come_from_the_dbc(imported, tmp_path: Path):
    (tmp_path / "motor.dbc").write_text(
        'VERSION ""\nBU_: A\nBO_ 291 STATE: 8 A\n SG_ angle : 0|16@1- (0.1,0) [0|0] "deg" A\n'
        ' SG_ torque : 16|16@1- (0.01,0) [0|0] "Nm" A\n SG_ current : 32|16@1- (0.01,0) [0|0] "A" A\n'
    )
    t = np.arange(300) * 0.01
    degrees = np.round(900.0 * np.sin(5.0 * t))
    with can.Logger(str(tmp_path / "run.log")) as writer:
        for now, angle in zip(t, degrees, strict=True):
            data = int(angle).to_bytes(2, "little", signed=True) + (250).to_bytes(2, "little") + bytes(4)
            writer(can.Message(timestamp=1e9 + now, arbitration_id=291, data=data, is_extended_id=False, channel=0))
    nothing = {"stream": "*/reply", "field": "none", "optional": True}
    columns = {
        "*": nothing,
        "*_dot": nothing,
        "u_*": nothing,
        "u_*_measured": nothing,
        "theta": {"stream": "STATE", "field": "angle"},
        "u": {"stream": "STATE", "field": "torque"},
    }
    settings = {"format": {"dbc": str(tmp_path / "motor.dbc")}, "columns": columns}
    log = imported(tmp_path / "run.log", "can_motors", **settings)
    np.testing.assert_allclose(logs.recorded(log)["theta"], np.radians(0.1 * degrees))
    np.testing.assert_allclose(logs.recorded(log)["u"], 2.5)
    assert [column.unit for column in log.preview.columns] == ["rad", "N m"]
    columns["u"] = {"stream": "STATE", "field": "current"}
    with pytest.raises(InputError, match="the log has STATE current in A, which is not known; give unit and scale"):
        imported(tmp_path / "run.log", "can_motors", **settings)
