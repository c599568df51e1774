"""Faults of a log or a mapping: one line that says what, where, and what to do."""

import dataclasses
import re
import sqlite3
import sys
from pathlib import Path
from typing import Any

import log_writers as logs
import numpy as np
import pytest

from wipx.core.errors import InputError

COMMANDS = {f"u_{joint}": {"stream": "/command", "field": f"data[{k}]"} for k, joint in enumerate(logs.JOINTS)}


def motion(rows: int = 300) -> logs.Motion:
    return logs.motion(np.random.default_rng(0), rows)


def mcap(folder: Path) -> Path:
    return logs.write_mcap(folder / "run.mcap", motion())


def own_type_without_definition(folder: Path) -> Path:
    """A bag of ROS 2 Humble, which does not keep definitions, with messages of a type of one's own."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64 angle\n", "my_msgs/msg/Angle"))
    kind = store.types["my_msgs/msg/Angle"]
    with Writer(folder / "own", version=8) as writer:
        connection = writer.add_connection("/joint_states", "my_msgs/msg/Angle", typestore=store)
        for k in range(300):
            writer.write(connection, k * 10**7, store.serialize_cdr(kind(angle=0.1 * k), "my_msgs/msg/Angle"))
    database = sqlite3.connect(folder / "own" / "own.db3")
    database.execute("DROP TABLE message_definitions")
    database.close()
    (folder / "definitions" / "my_msgs" / "msg").mkdir(parents=True)
    (folder / "definitions" / "my_msgs" / "msg" / "Angle.msg").write_text("float64 angle\n")
    return folder / "own"


def joint_twice(folder: Path) -> Path:
    names = logs.JOINTS
    try:
        logs.JOINTS = ("elbow", "elbow")
        return mcap(folder)
    finally:
        logs.JOINTS = names


def empty_episode(folder: Path) -> Path:
    path = logs.write_lerobot(folder / "set", [motion(), motion(150)], 2)
    (path / "data" / "chunk-000" / "episode_000001.parquet").unlink()
    return path


def empty_group(folder: Path) -> Path:
    return logs.write_hdf5(folder / "run.h5", [motion(), logs.part(motion(), slice(0, 0))])


def other_dbc(folder: Path) -> Path:
    (folder / "other.dbc").write_text(
        'VERSION ""\nBU_: A\nBO_ 321 STATE: 8 A\n SG_ angle : 0|16@1- (0.1,0) [0|0] "deg" A\n'
    )
    return logs.write_can(folder / "run.log", motion())


def longer_dbc(folder: Path) -> Path:
    (folder / "other.dbc").write_text(
        'VERSION ""\nBU_: A\nBO_ 1 STATE: 16 A\n SG_ angle : 0|16@1- (0.1,0) [0|0] "deg" A\n'
    )
    return logs.write_can(folder / "run.log", motion())


def clock_set_back(folder: Path) -> Path:
    whole = motion()
    stamps = whole.stamps.copy()
    stamps[150:] -= 3 * 10**9
    return logs.write_mcap(folder / "run.mcap", dataclasses.replace(whole, stamps=stamps))


def two_clocks(folder: Path) -> Path:
    whole = motion()
    late = logs.EPOCH - 10**9
    since_start = logs.Motion(whole.stamps - late, whole.positions, whole.rates, whole.commands, whole.efforts)
    return logs.write_mcap(folder / "run.mcap", since_start, received_later=late)


FAULTS: dict[str, tuple[Any, str, dict[str, Any], list[str]]] = {
    "unknown topic": (
        mcap,
        "joint_state",
        {"columns": {"u": {"stream": "/cmd", "field": "data"}}},
        ["no stream /cmd", "/joint_states (sensor_msgs/msg/JointState)", "/command"],
    ),
    "unknown field": (
        mcap,
        "joint_state",
        {"columns": {"u": {"stream": "/command", "field": "value"}}},
        ["no field value in /command", "data[0], data[1]"],
    ),
    "no definition": (
        own_type_without_definition,
        "joint_state",
        {},
        ["definition of my_msgs/msg/Angle (topic /joint_states) is not in the log", "log.format.definitions"],
    ),
    "mixed clocks": (
        two_clocks,
        "joint_state",
        {"clock": "header", "columns": COMMANDS},
        ["mixed clocks", "/joint_states", "/command", "log.clock=receive"],
    ),
    "a clock that is set back": (
        clock_set_back,
        "joint_state",
        {"clock": "header", "columns": COMMANDS},
        ["mixed clocks", "/joint_states", "header stamps go back by 2.99 s at message 151"],
    ),
    "a joint twice": (joint_twice, "joint_state", {}, ["/joint_states names position.elbow twice"]),
    "a column twice": (
        mcap,
        "joint_state",
        {"rename": {"elbow": "shoulder"}},
        ["shoulder comes from /joint_states position.shoulder and from /joint_states position.elbow"],
    ),
    "a name that is not there": (
        mcap,
        "joint_state",
        {"rename": {"elbo": "e"}},
        ["log.rename: unknown name 'elbo'; did you mean elbow?"],
    ),
    "an empty episode": (
        empty_episode,
        "lerobot_so_arm",
        {},
        ["episode 1 has no rows", "leave it out with log.format.episodes"],
    ),
    "an empty group": (
        empty_group,
        "mujoco",
        {"format": {"episodes": "data/*"}},
        ["demo_1: the episode is empty", "log.format.episodes"],
    ),
    "a DBC of another bus": (
        other_dbc,
        "can_motors",
        {"format": {"dbc": "other.dbc"}},
        ["other.dbc does not match", "ids 0x141", "the log has 0x0, 0x1, 0x2"],
    ),
    "a DBC of another device": (
        longer_dbc,
        "can_motors",
        {"format": {"dbc": "other.dbc"}, "columns": {"u": {"stream": "STATE", "field": "angle"}}},
        ["other.dbc does not match", "no frame of STATE has the form that it says"],
    ),
    "other motors": (
        other_dbc,
        "can_motors",
        {"format": {"motors": {"a": {"id": 9, "master_id": 8}}}},
        ["log.format.motors does not match", "0x8, 0x9", "the log has 0x0, 0x1, 0x2"],
    ),
    "an unknown unit": (
        mcap,
        "joint_state",
        {"columns": {"u": {"stream": "/command", "field": "data[0]", "unit": "furlong"}}},
        ["unknown unit 'furlong'"],
    ),
    "another format": (
        mcap,
        "lerobot_so_arm",
        {},
        ["meta/info.json: cannot be read", "expected a data set of LeRobot"],
    ),
    "no column of the time": (
        lambda f: logs.write_table(f / "a.csv", motion()),
        "table",
        {},
        ["log.format.time: unknown column 't'", "time_ms"],
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_told_in_one_line(imported, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    monkeypatch.chdir(tmp_path)
    make, option, changes, parts = FAULTS[name]
    path = make(tmp_path)
    with pytest.raises(InputError) as caught:
        imported(path, option, **changes)
    for part in parts:
        assert part in str(caught.value)


def test_definitions_may_be_given_beside_the_log(imported, tmp_path: Path):
    path = own_type_without_definition(tmp_path)
    angle = {"*": {"stream": "/joint_states", "field": "angle", "optional": True}}
    with pytest.raises(InputError, match=re.escape("neither stream nor field has a *")):
        imported(path, "joint_state", format={"definitions": str(tmp_path / "definitions")}, columns=angle)


def test_a_missing_package_is_named(imported, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = mcap(tmp_path)
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    with pytest.raises(
        InputError, match=re.escape("needs the package mcap; install it with: pip install 'wipx[import]'")
    ):
        imported(path, "joint_state")
