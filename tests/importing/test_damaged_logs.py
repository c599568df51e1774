"""Damaged logs: what can be read is read, what is lost is said, and nothing crashes or hangs."""

import shutil
from collections.abc import Callable
from pathlib import Path

import log_writers as logs
import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.importing.formats.arrays import ArrayLog
from wipx.importing.formats.by_name import RosLog
from wipx.importing.formats.can_log import CanLog, MitMotor
from wipx.importing.formats.lerobot import LeRobotLog
from wipx.importing.formats.tables import TableLog
from wipx.importing.formats.vectornav import VectorNavLog
from wipx.importing.log_format import Chunk, LogFormat, Loss

ROWS = 120
VECTORNAV = 38  # bytes of a message
DRAWS = 4  # damages of each format in a default run
MOTORS = {joint: MitMotor(k + 1) for k, joint in enumerate(logs.JOINTS)}
# How a log is written, which file of it is damaged, and what reads it.
FORMATS: dict[str, tuple[Callable[[Path, logs.Motion], Path], str, LogFormat]] = {
    "bag": (lambda p, m: logs.write_ros1(p / "a.bag", m, chunk=2000), "a.bag", RosLog()),
    "bag bz2": (lambda p, m: logs.write_ros1(p / "a.bag", m, "BZ2", chunk=2000), "a.bag", RosLog()),
    "db3": (lambda p, m: logs.write_ros2(p / "a", m), "a/a.db3", RosLog()),
    "mcap": (lambda p, m: logs.write_mcap(p / "a.mcap", m, chunk=2000), "a.mcap", RosLog()),
    "mcap json": (lambda p, m: logs.write_json_mcap(p / "a.mcap", m), "a.mcap", RosLog()),
    "blf": (lambda p, m: logs.write_can(p / "a.blf", m), "a.blf", CanLog(motors=MOTORS)),
    "asc": (lambda p, m: logs.write_can(p / "a.asc", m), "a.asc", CanLog(motors=MOTORS)),
    "log": (lambda p, m: logs.write_can(p / "a.log", m), "a.log", CanLog(motors=MOTORS)),
    "trc": (lambda p, m: logs.write_can(p / "a.trc", m), "a.trc", CanLog(motors=MOTORS)),
    "vectornav": (lambda p, m: logs.write_vectornav(p / "a.vnb", m), "a.vnb", VectorNavLog()),
    "lerobot": (
        lambda p, m: logs.write_lerobot(p / "set", [m], 2),
        "set/data/chunk-000/episode_000000.parquet",
        LeRobotLog(),
    ),
    "info": (lambda p, m: logs.write_lerobot(p / "set", [m], 3), "set/meta/info.json", LeRobotLog()),
    "npz": (lambda p, m: logs.write_npz(p / "a.npz", m), "a.npz", ArrayLog()),
    "hdf5": (lambda p, m: logs.write_hdf5(p / "a.h5", [m, m]), "a.h5", ArrayLog(episodes="data/*")),
    "csv": (lambda p, m: logs.write_table(p / "a.csv", m), "a.csv", TableLog(time="time_ms", time_unit="ms")),
    "parquet": (
        lambda p, m: logs.write_table(p / "a.parquet", m),
        "a.parquet",
        TableLog(time="time_ms", time_unit="ms"),
    ),
}


def read(reader: LogFormat, path: Path) -> tuple[int, list[Loss] | None]:
    """Messages and losses; None where the log is refused in one line."""
    rows, losses = 0, []
    try:
        for item in reader.read(path, lambda stream: True):
            if isinstance(item, Chunk):
                assert all(len(values) == item.rows for values in item.fields.values())
                rows += item.rows
            else:
                losses.append(item)
    except InputError:
        return rows, None
    return rows, losses


@pytest.fixture
def whole(tmp_path: Path, request: pytest.FixtureRequest) -> tuple[Path, Path, LogFormat]:
    """A log, the file of it that is damaged, and its reader."""
    write, damaged, reader = FORMATS[request.param]
    folder = tmp_path / "whole"
    folder.mkdir()
    path = write(folder, logs.motion(np.random.default_rng(0), ROWS))
    return path, folder / damaged, reader


@pytest.mark.parametrize("whole", FORMATS, indirect=True)
def test_a_truncated_log_gives_its_beginning_and_says_that_it_is_short(whole, fresh_seed: int):
    path, file, reader = whole
    complete, losses = read(reader, path)
    assert losses == []
    content = file.read_bytes()
    for length in np.random.default_rng(fresh_seed).integers(1, len(content), DRAWS):
        file.write_bytes(content[:length])
        rows, losses = read(reader, path)
        assert rows <= complete
        # Where text ends at the end of a line or in its last number, or messages without any frame after one of them,
        # nobody can know that something is missing.
        known = file.suffix not in (".csv", ".asc", ".log", ".trc") and (file.suffix != ".vnb" or length % VECTORNAV)
        assert losses is None or losses or rows >= complete or not known


def damage(content: bytes, rng: np.random.Generator) -> bytes:
    """A file after one of the things that happen to files."""
    kind, place = rng.integers(5), int(rng.integers(len(content)))
    length = int(min(rng.geometric(0.02), len(content) - place))
    noise = rng.bytes(length)
    if kind == 0:
        return content[:place] + noise + content[place + length :]
    if kind == 1:
        return content[:place] + content[place + length :]
    if kind == 2:
        return content[:place] + noise + content[place:]
    if kind == 3:
        return content[:place] + bytes(length) + content[place + length :]
    flipped = bytearray(content)
    for k in rng.integers(len(content), size=20):
        flipped[k] ^= 1 << int(rng.integers(8))
    return bytes(flipped)


@pytest.mark.parametrize("whole", FORMATS, indirect=True)
def test_a_damaged_log_is_read_or_refused(whole, fresh_seed: int):
    path, file, reader = whole
    content, rng = file.read_bytes(), np.random.default_rng(fresh_seed)
    for _ in range(DRAWS):
        file.write_bytes(damage(content, rng))
        read(reader, path)


@pytest.mark.slow
@pytest.mark.parametrize("whole", FORMATS, indirect=True)
def test_many_damaged_logs_are_read_or_refused(whole, fresh_seed: int):
    path, file, reader = whole
    content, rng = file.read_bytes(), np.random.default_rng(fresh_seed)
    for _ in range(1000):
        file.write_bytes(damage(content, rng))
        read(reader, path)


@pytest.mark.parametrize("whole", FORMATS, indirect=True)
def test_random_bytes_are_refused(whole, fresh_seed: int):
    path, file, reader = whole
    rng = np.random.default_rng(fresh_seed)
    for length in (0, 1, 30, 3000):
        file.write_bytes(rng.bytes(length))
        rows, losses = read(reader, path)
        assert rows == 0
        assert losses is None or losses


def test_frames_around_a_damaged_container_are_kept(tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 5000)
    path = logs.write_can(tmp_path / "a.blf", motion)
    complete, _ = read(CanLog(motors=MOTORS), path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2 : len(content) // 2 + 50] = bytes(50)
    path.write_bytes(bytes(content))
    rows, losses = read(CanLog(motors=MOTORS), path)
    assert losses
    assert 0.5 * complete < rows < complete


@pytest.mark.parametrize("suffix", ["bag", "mcap"])
def test_messages_around_a_damaged_chunk_are_kept(tmp_path: Path, suffix: str):
    motion = logs.motion(np.random.default_rng(0), 400)
    path = tmp_path / f"a.{suffix}"
    if suffix == "bag":
        logs.write_ros1(path, motion, "BZ2", chunk=2000)
    else:
        logs.write_mcap(path, motion, chunk=2000)
    complete, _ = read(RosLog(), path)
    content = bytearray(path.read_bytes())
    middle = content.index(b"BZh9" if suffix == "bag" else b"zstd", len(content) // 3) + 40
    content[middle : middle + 10] = bytes(10)
    path.write_bytes(bytes(content))
    rows, losses = read(RosLog(), path)
    assert losses
    assert 0.9 * complete < rows < complete


def test_lines_around_damaged_ones_are_kept(tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 100)
    for suffix in ("asc", "log", "trc"):
        path = logs.write_can(tmp_path / f"a.{suffix}", motion)
        complete, _ = read(CanLog(motors=MOTORS), path)
        lines = path.read_text().splitlines()
        for k in (60, 61, 200):
            lines[k] = lines[k][: len(lines[k]) // 2] + "zz zz"
        path.write_text("\n".join(lines) + "\n")
        rows, losses = read(CanLog(motors=MOTORS), path)
        assert complete - 3 <= rows < complete
        assert losses
        assert sum(loss.count for loss in losses) == complete - rows


def test_a_bag_whose_recorder_was_killed_is_read(tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), ROWS)
    path = logs.write_ros2(tmp_path / "a", motion)
    (path / "metadata.yaml").unlink()
    rows, losses = read(RosLog(), path)
    assert (rows, losses) == (2 * ROWS, [])
    shutil.rmtree(path)
