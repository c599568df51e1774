"""A motion that was written in a format comes back up to the resolution of the format."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import log_writers as logs
import numpy as np
import pytest

TORQUE = 24.0 / 4095.0  # steps of the MIT protocol
RATE = 152.0 / 4095.0
ANGLE = 25.0 / 65535.0
COMMANDS = {
    f"u_{joint}": {"stream": "/command", "field": f"data[{k}]", "unit": "N m"} for k, joint in enumerate(logs.JOINTS)
}
NUMBERS = {"0": "shoulder", "1": "elbow"}


FORMATS: dict[str, tuple[Callable[[Path, logs.Motion], Path], str, dict[str, Any], dict[str, float]]] = {
    "ROS 1 bag": (lambda p, m: logs.write_ros1(p / "a.bag", m), "joint_state", {"columns": COMMANDS}, {}),
    "ROS 1 bag, bz2": (lambda p, m: logs.write_ros1(p / "a.bag", m, "BZ2"), "joint_state", {"columns": COMMANDS}, {}),
    "ROS 1 bag, lz4": (lambda p, m: logs.write_ros1(p / "a.bag", m, "LZ4"), "joint_state", {"columns": COMMANDS}, {}),
    "ROS 2 bag": (lambda p, m: logs.write_ros2(p / "a", m), "joint_state", {"columns": COMMANDS}, {}),
    "ROS 2 bag, MCAP": (lambda p, m: logs.write_ros2(p / "a", m, mcap=True), "joint_state", {"columns": COMMANDS}, {}),
    "MCAP": (lambda p, m: logs.write_mcap(p / "a.mcap", m), "joint_state", {"columns": COMMANDS}, {}),
    "MCAP, JSON": (
        lambda p, m: logs.write_json_mcap(p / "a.mcap", m),
        "joint_state",
        {"columns": {"u_*": {"stream": "/joint_states", "field": "command.*"}}},
        {},
    ),
    **{
        f"CAN {suffix}": (
            lambda p, m, suffix=suffix: logs.write_can(p / f"a.{suffix}", m, switched=True),
            "can_motors",
            {"format": {"motors": {joint: {"id": k + 1} for k, joint in enumerate(logs.JOINTS)}}},
            {"": ANGLE, "_dot": RATE, "u": TORQUE, "u_measured": TORQUE, "t": step},
        )
        for suffix, step in (("blf", 1e-3), ("asc", 1e-3), ("log", 2e-6), ("trc", 2e-3))
    },
    "NPZ": (lambda p, m: logs.write_npz(p / "a.npz", m), "mujoco", {"rename": NUMBERS}, {}),
    "HDF5": (
        lambda p, m: logs.write_hdf5(p / "a.h5", [m]),
        "mujoco",
        {"rename": NUMBERS, "format": {"episodes": "data/*"}},
        {},
    ),
    **{
        f"table {suffix}": (
            lambda p, m, suffix=suffix: logs.write_table(p / f"a.{suffix}", m),
            "table",
            {
                "format": {"time": "time_ms", "time_unit": "ms"},
                "columns": {"*": {"stream": "table", "field": "*_pos", "unit": "deg"}},
            },
            {},
        )
        for suffix in ("csv", "parquet")
    },
}


@pytest.mark.parametrize("name", FORMATS)
def test_a_motion_comes_back(imported, tmp_path: Path, fresh_seed: int, name: str):
    write, option, changes, steps = FORMATS[name]
    motion = logs.motion(np.random.default_rng(fresh_seed))
    log = imported(write(tmp_path, motion), option, **changes)
    assert log.preview.losses == ()
    columns, expected = logs.recorded(log), motion.columns()
    assert len(log.recordings) == 1
    assert len(columns["t"]) == len(motion.t)
    for column, values in columns.items():
        kind = column.replace("_shoulder", "").replace("_elbow", "").replace("shoulder", "").replace("elbow", "")
        step = max(0.51 * steps.get(kind, 0.0), 1e-9 if column != "t" else 1e-6)
        np.testing.assert_allclose(values, expected[column], atol=step, rtol=1e-9)


@pytest.mark.parametrize("version", [2, 3])
def test_episodes_of_a_data_set_become_recordings(imported, tmp_path: Path, fresh_seed: int, version: int):
    rng = np.random.default_rng(fresh_seed)
    episodes = [logs.motion(rng, rows) for rows in (200, 150, 250)]
    log = imported(logs.write_lerobot(tmp_path / "set", episodes, version), "lerobot_so_arm")
    assert [piece.episode for piece in log.preview.pieces] == ["0", "1", "2"]
    for number, motion in enumerate(episodes):
        columns, expected = logs.recorded(log, number), motion.columns()
        for column in ("t", "shoulder", "elbow", "u_shoulder", "u_elbow"):
            np.testing.assert_allclose(columns[column], expected[column], atol=1e-8)


@pytest.mark.parametrize("names", [["main_shoulder", "main_elbow"], {"motors": ["shoulder", "elbow"]}])
def test_names_of_older_data_sets_are_known(imported, tmp_path: Path, fresh_seed: int, names: object):
    motion = logs.motion(np.random.default_rng(fresh_seed))
    log = imported(logs.write_lerobot(tmp_path / "set", [motion], 2, names), "lerobot_so_arm")
    assert {column.name for column in log.preview.columns} == {"shoulder", "elbow", "u_shoulder", "u_elbow"}


def test_groups_of_a_file_become_recordings(imported, tmp_path: Path, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    episodes = [logs.motion(rng, 150) for _ in range(11)]
    path = logs.write_hdf5(tmp_path / "a.h5", episodes)
    log = imported(path, "mujoco", rename=NUMBERS, format={"episodes": "data/*"})
    for number, motion in enumerate(episodes):
        np.testing.assert_allclose(logs.recorded(log, number)["elbow"], motion.positions[:, 1])


def test_messages_of_an_imu_come_back(imported, tmp_path: Path, fresh_seed: int):
    motion = logs.motion(np.random.default_rng(fresh_seed))
    log = imported(logs.write_vectornav(tmp_path / "a.vnb", motion), "vectornav")
    columns = logs.recorded(log)
    np.testing.assert_allclose(columns["t"], motion.t, atol=1e-9)
    np.testing.assert_allclose(columns["theta"], motion.positions[:, 0], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(columns["theta_dot"], motion.rates[:, 0], rtol=1e-6, atol=1e-6)
