"""ROS 2 bags: a folder of SQLite or MCAP files, or one such SQLite file.

`metadata.yaml` is not needed: it is missing where the recorder was killed. Source: rosbag2, `rosbag2_storage_sqlite3`.
"""

import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.importing.formats.mcap_log import read_mcap
from wipx.importing.formats.ros_messages import Decoder, Definition
from wipx.importing.log_format import Chunk, LogFormat, Loss, Wanted

ROWS = 1000  # messages fetched at once
SQLITE_MAGIC = b"SQLite format 3\x00"


@dataclass(frozen=True)
class Ros2Bag(LogFormat):
    """A folder of .db3 or .mcap files, or a .db3 file.

    Attributes:
        definitions: Folder of .msg files of types that the bag does not define.
    """

    definitions: str | None = None

    def reads(self, path: Path) -> bool:
        """Whether it is or holds a .db3 file, or is a folder of .mcap files."""
        return path.suffix == ".db3" or (path.is_dir() and bool(_storage_files(path)))

    def read(self, path: Path, wanted: Wanted) -> Iterator[Chunk | Loss]:
        """See `LogFormat`."""
        files = _storage_files(path) if path.is_dir() else [path]
        if not files:
            raise InputError(f"{path}: no .db3 or .mcap file in the folder; expected a bag of ROS 2")
        decoder = Decoder(path, wanted, self.definitions)
        for file in files:
            yield from read_mcap(file, decoder) if file.suffix == ".mcap" else _read_sqlite(file, decoder)
        yield from decoder.rest()


def _storage_files(folder: Path) -> list[Path]:
    """Files of a bag in the order of recording: NAME_0, NAME_1, ..., NAME_10."""
    found = [path for path in folder.iterdir() if path.suffix in (".db3", ".mcap")]
    return sorted(found, key=lambda path: (len(path.name), path.name))


def _read_sqlite(path: Path, decoder: Decoder) -> Iterator[Chunk | Loss]:
    try:
        with path.open("rb") as file:
            magic = file.read(len(SQLITE_MAGIC))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path and its permissions") from error
    if magic != SQLITE_MAGIC:
        raise InputError(f"{path}: not an SQLite file, expected a bag of ROS 2; check the file")
    database = sqlite3.connect(f"file:{path.resolve()}?mode=ro&immutable=1", uri=True)
    try:
        topics = _topics(database, path)
        yield from _messages(database, topics, path, decoder)
    finally:
        database.close()


def _topics(database: sqlite3.Connection, path: Path) -> dict[int, tuple[str, Definition]]:
    try:
        rows = database.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
        tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        said = {}
        if "message_definitions" in tables:
            query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            said = {kind: (encoding, text) for kind, encoding, text in database.execute(query)}
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path}: the bag's topics cannot be read ({error}); nothing of it can be had") from error
    definitions = {}
    for number, name, kind, encoding in rows:
        language, text = said.get(kind, ("ros2msg", ""))
        definitions[number] = name, Definition(kind, encoding, text, "idl" if language == "ros2idl" else "msg")
    return definitions


def _messages(
    database: sqlite3.Connection, topics: dict[int, tuple[str, Definition]], path: Path, decoder: Decoder
) -> Iterator[Chunk | Loss]:
    read, last = 0, _last_row(database)
    unknown = 0
    try:
        cursor = database.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id")
        while batch := cursor.fetchmany(ROWS):
            for number, topic_id, stamp, data in batch:
                read += 1
                if topic_id not in topics or not isinstance(stamp, int) or not isinstance(data, bytes):
                    unknown += 1
                    continue
                decoder.rows.done = number / last if last else 0.0
                name, definition = topics[topic_id]
                yield from decoder.message(name, definition, stamp, data)
    except (sqlite3.Error, UnicodeDecodeError) as error:
        yield Loss(str(path), f"the file is damaged after {read} messages ({error}); the rest is not read")
    if unknown:
        yield Loss(str(path), "messages without a topic or a stamp are left out", unknown)


def _last_row(database: sqlite3.Connection) -> int:
    try:
        (last,) = database.execute("SELECT max(id) FROM messages").fetchone()
        return int(last or 0)
    except sqlite3.Error:
        return 0
