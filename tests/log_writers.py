"""Writers of logs in every format, from one motion of a robot; that motion, and what an import makes of it."""

import binascii
import json
import struct
from dataclasses import dataclass, replace
from pathlib import Path

import can
import numpy as np

from wipx.hardware.mit_protocol import ENTER, EXIT, MitProtocol, Ranges
from wipx.importing.pipeline import ImportedLog

EPOCH = 1_700_000_000_000_000_000  # [ns]
JOINTS = ("shoulder", "elbow")
DEFINITIONS = {
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    ),
    "std_msgs/msg/Float64MultiArray": (
        "MultiArrayLayout layout\nfloat64[] data\n"
        f"{'=' * 80}\nMSG: std_msgs/MultiArrayLayout\nMultiArrayDimension[] dim\nuint32 data_offset\n"
        f"{'=' * 80}\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n"
    ),
}
HEADER = f"{'=' * 80}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"


@dataclass(frozen=True)
class Motion:
    """What was recorded: rows of two joints.

    Attributes:
        stamps: [ns].
        positions: Shape (rows, 2) [rad].
        rates: Shape (rows, 2) [rad/s].
        commands: Shape (rows, 2) [N m].
        efforts: Shape (rows, 2) [N m].
    """

    stamps: np.ndarray
    positions: np.ndarray
    rates: np.ndarray
    commands: np.ndarray
    efforts: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Time since the first row [s]."""
        return (self.stamps - self.stamps[:1]) / 1e9

    def columns(self) -> dict[str, np.ndarray]:
        """As a recording has them."""
        columns = {"t": self.t}
        for k, joint in enumerate(JOINTS):
            columns[joint] = self.positions[:, k]
            columns[f"{joint}_dot"] = self.rates[:, k]
            columns[f"u_{joint}"] = self.commands[:, k]
            columns[f"u_{joint}_measured"] = self.efforts[:, k]
        return columns


def motion(rng: np.random.Generator, rows: int = 300, period: float = 0.01) -> Motion:
    """A motion that never rests, with jitter of the stamps."""
    steps = np.rint(1e9 * period * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, rows))).astype(np.int64)
    steps -= steps % 1000  # whole microseconds, as all formats can have them
    stamps = EPOCH + np.concatenate([[0], np.cumsum(steps[1:])])
    t = (stamps - stamps[0])[:, None] / 1e9
    frequency, phase = rng.uniform(0.5, 1.5, (1, 2)), rng.uniform(0.0, 6.0, (1, 2))
    angle = 2.0 * np.pi * frequency * t + phase
    commands = np.repeat(rng.normal(size=(rows // 10 + 1, 2)), 10, axis=0)[:rows]
    return Motion(stamps, 2.0 * np.sin(angle), 4.0 * np.pi * frequency * np.cos(angle), commands, 0.9 * commands)


def part(whole: Motion, rows: slice | np.ndarray) -> Motion:
    """Some rows of a motion."""
    return replace(whole, **{name: value[rows] for name, value in vars(whole).items()})


def ros_messages(whole: Motion, delay: int = 2_000_000):
    """Topic, type, receive stamp and message of a robot's joint states and commands, by receive stamp.

    Joint states have header stamps and are received `delay` [ns] later; commands have no header.
    """
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_JAZZY).types
    time, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    state, array = types["sensor_msgs/msg/JointState"], types["std_msgs/msg/Float64MultiArray"]
    layout = types["std_msgs/msg/MultiArrayLayout"]
    for k, stamp in enumerate(whole.stamps.tolist()):
        head = header(stamp=time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="")
        rows = (whole.positions[k], whole.rates[k], whole.efforts[k])
        command = array(layout=layout(dim=[], data_offset=0), data=np.array(whole.commands[k]))
        yield "/command", "std_msgs/msg/Float64MultiArray", stamp, command
        yield "/joint_states", "sensor_msgs/msg/JointState", stamp + delay, state(head, list(JOINTS), *rows)


def write_ros2(path: Path, whole: Motion, *, mcap: bool = False) -> Path:
    """A ROS 2 bag: a folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    plugin = StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connections = {}
        for topic, kind, stamp, message in ros_messages(whole):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp, store.serialize_cdr(message, kind))
    return path


def write_ros1(path: Path, whole: Motion, compression: str | None = None, chunk: int = 20_000) -> Path:
    """A ROS 1 bag."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer(path)
    writer.chunk_threshold = chunk
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression])
    header = store.types["std_msgs/msg/Header"]
    with writer:
        connections = {}
        for topic, kind, stamp, message in ros_messages(whole):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            if topic == "/joint_states":
                vars(message)["header"] = header(seq=0, stamp=vars(message)["header"].stamp, frame_id="")
            writer.write(connections[topic], stamp, store.serialize_ros1(message, kind))
    return path


def write_mcap(path: Path, whole: Motion, chunk: int = 20_000, *, received_later: int = 0) -> Path:
    """An MCAP file with ROS 2 messages; all are received `received_later` [ns]."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk)
        writer.start("ros2")
        channels = {}
        for topic, kind, stamp, message in ros_messages(whole):
            if topic not in channels:
                text = (DEFINITIONS[kind] + (HEADER if "JointState" in kind else "")).encode()
                schema = writer.register_schema(kind, "ros2msg", text)
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            received = stamp + received_later
            writer.add_message(channels[topic], received, bytes(store.serialize_cdr(message, kind)), received)
        writer.finish()
    return path


def write_json_mcap(path: Path, whole: Motion) -> Path:
    """An MCAP file with JSON messages of the same fields."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("JointState", "jsonschema", b"{}")
        channel = writer.register_channel("/joint_states", "json", schema)
        for k, stamp in enumerate(whole.stamps.tolist()):
            head = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
            values = {"position": whole.positions, "velocity": whole.rates, "effort": whole.efforts}
            rows = {name: value[k].tolist() for name, value in values.items()}
            message = {"header": head, "name": list(JOINTS), **rows, "command": whole.commands[k].tolist()}
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return path


def write_lerobot(path: Path, episodes: list[Motion], version: int, names: object = None) -> Path:
    """A LeRobot data set of version 2 or 3: degrees, commands as targets."""
    import pyarrow as pa
    from pyarrow import parquet

    tables, total = [], 0
    for number, whole in enumerate(episodes):
        rows = len(whole.stamps)
        tables.append(
            pa.table(
                {
                    "observation.state": pa.array(np.degrees(whole.positions).tolist(), pa.list_(pa.float64())),
                    "action": pa.array(np.degrees(whole.commands).tolist(), pa.list_(pa.float64())),
                    "timestamp": whole.t,
                    "frame_index": np.arange(rows),
                    "episode_index": np.full(rows, number),
                    "index": total + np.arange(rows),
                    "task_index": np.zeros(rows, dtype=int),
                }
            )
        )
        total += rows
    folder = path / "data" / "chunk-000"
    folder.mkdir(parents=True)
    if version == 2:
        for number, table in enumerate(tables):
            parquet.write_table(table, folder / f"episode_{number:06d}.parquet")
    else:
        parquet.write_table(pa.concat_tables(tables), folder / "file-000.parquet")
    named = [f"{joint}.pos" for joint in JOINTS] if names is None else names
    features = {name: {"dtype": "float32", "shape": [2], "names": named} for name in ("observation.state", "action")}
    info = {"codebase_version": f"v{version}.0", "total_episodes": len(episodes), "total_frames": total, "fps": 100}
    (path / "meta").mkdir()
    (path / "meta" / "info.json").write_text(json.dumps({**info, "features": features}))
    return path


def write_can(path: Path, whole: Motion, *, switched: bool = False) -> Path:
    """A log of two motors of the MIT protocol; with `switched` they are switched on first and off last."""
    protocols = [MitProtocol(Ranges(), k + 1, 0) for k in range(2)]
    with can.Logger(str(path)) as writer:
        for k, stamp in enumerate(whole.stamps.tolist()):
            for joint, protocol in enumerate(protocols):
                frames = [
                    (joint + 1, protocol.command(torque=whole.commands[k, joint])),
                    (0, _reply(joint + 1, whole.positions[k, joint], whole.rates[k, joint], whole.efforts[k, joint])),
                ]
                if switched and k == 0:
                    frames.insert(0, (joint + 1, ENTER))
                if switched and k == len(whole.stamps) - 1:
                    frames.append((joint + 1, EXIT))
                for identifier, data in frames:
                    writer(
                        can.Message(
                            timestamp=stamp / 1e9, arbitration_id=identifier, data=data, is_extended_id=False, channel=0
                        )
                    )
    return path


def _reply(number: int, position: float, rate: float, torque: float) -> bytes:
    ends = Ranges()
    p = round((position + ends.position) / (2.0 * ends.position) * 65535) % 65536
    v = min(max(round((rate + ends.velocity) / (2.0 * ends.velocity) * 4095), 0), 4095)
    t = min(max(round((torque + ends.torque) / (2.0 * ends.torque) * 4095), 0), 4095)
    return struct.pack(">BHBBBBB", number, p, v >> 4, (v & 15) << 4 | t >> 8, t & 255, 30, 0)


def write_vectornav(path: Path, whole: Motion) -> Path:
    """Binary messages with the time of start-up, yaw, pitch, roll and rates; the first joint is the pitch."""
    messages = []
    for k, stamp in enumerate(whole.stamps.tolist()):
        angles = (0.0, float(np.degrees(whole.positions[k, 0])), 0.0)
        body = struct.pack("<Q6f", stamp - EPOCH, *angles, 0.0, float(whole.rates[k, 0]), 0.0)
        content = b"\x01" + struct.pack("<H", 1 << 0 | 1 << 3 | 1 << 5) + body
        messages.append(b"\xfa" + content + struct.pack(">H", binascii.crc_hqx(content, 0)))
    path.write_bytes(b"".join(messages))
    return path


def arrays(whole: Motion) -> dict[str, np.ndarray]:
    """As MuJoCo names them."""
    return {"time": whole.t, "qpos": whole.positions, "qvel": whole.rates, "ctrl": whole.commands}


def write_npz(path: Path, whole: Motion) -> Path:
    """Arrays of a trajectory."""
    columns = arrays(whole)
    np.savez_compressed(path, time=columns["time"], qpos=columns["qpos"], qvel=columns["qvel"], ctrl=columns["ctrl"])
    return path


def write_hdf5(path: Path, episodes: list[Motion]) -> Path:
    """One group for each episode."""
    import h5py

    with h5py.File(path, "w") as file:
        for number, whole in enumerate(episodes):
            for name, values in arrays(whole).items():
                file[f"data/demo_{number}/{name}"] = values
    return path


def write_table(path: Path, whole: Motion) -> Path:
    """Other names and units: milliseconds and degrees."""
    table = {"time_ms": 1e3 * whole.t}
    for k, joint in enumerate(JOINTS):
        table[f"{joint}_pos"] = np.degrees(whole.positions[:, k])
        table[f"{joint}_cmd"] = whole.commands[:, k]
    if path.suffix == ".parquet":
        import pyarrow as pa
        from pyarrow import parquet

        parquet.write_table(pa.table(table), path)
    else:
        rows = "\n".join(";".join(f"{value:.12g}" for value in row) for row in np.column_stack(list(table.values())))
        path.write_text(";".join(table) + "\n" + rows + "\n")
    return path


def recorded(log: ImportedLog, number: int = 0) -> dict[str, np.ndarray]:
    """The columns of a recording that an import gives."""
    one = log.recordings[number]
    t = one.merged.t[one.first : one.last]
    return {"t": t - t[0], **{name: one.merged.column(name, one.first, one.last) for name in one.merged.names}}
