"""Recordings of an imported log as files of contract section 1."""

import shutil
from pathlib import Path

import numpy as np
import yaml

from wipx.core.errors import InputError
from wipx.importing.pipeline import ImportedRecording
from wipx.recordings.robot_file import read_robot
from wipx.recordings.signals import required_columns
from wipx.recordings.strict_yaml import load_mapping

BLOCK = 65_536  # rows that are written at once
ROBOT_FILE = "robot.yaml"


def write_recording(recording: ImportedRecording, path: Path) -> None:
    """Write one recording; its time begins at 0.

    Args:
        recording: The recording.
        path: File that ends in .csv or .parquet.
    """
    if path.suffix == ".parquet":
        _write_parquet(recording, path)
        return
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(_cell(name) for name in ("t", *recording.merged.names)) + "\n")
        for begin in range(recording.first, recording.last, BLOCK):
            table = np.column_stack(list(_block(recording, begin).values()))
            np.savetxt(file, table, fmt=["%.9f", *["%.9g"] * (table.shape[1] - 1)], delimiter=",")


def check_robot(path: Path, columns: tuple[str, ...]) -> None:
    """Refuse a robot whose recordings need a column that is not there.

    Args:
        path: Its robot.yaml.
        columns: Of the recordings.

    Raises:
        InputError: see above, or the file is at fault.
    """
    robot = read_robot(path)
    for name in required_columns(robot.model.plant):
        needs = robot.signals[name].needs if name in robot.signals else (name,)
        for needed in needs:
            if needed != "t" and needed not in columns:
                raise InputError(
                    f"{path}: recordings of this robot need the column {needed}, the log gives {', '.join(columns)}; "
                    "map it under log.columns, or rename with log.rename"
                )


def copy_robot(path: Path, folder: Path) -> None:
    """Put a robot.yaml beside the recordings, with the model file that it names.

    Raises:
        InputError: the model file is not there.
    """
    data = load_mapping(path)
    model = data.get("model")
    if isinstance(model, str):
        source = path.parent / model
        if not source.is_file():
            raise InputError(f"{path}: the model file {source} does not exist; correct model")
        shutil.copyfile(source, folder / source.name)
        if source.name != model:
            (folder / ROBOT_FILE).write_text(yaml.safe_dump({**data, "model": source.name}, sort_keys=False))
            return
    shutil.copyfile(path, folder / ROBOT_FILE)


def _block(recording: ImportedRecording, begin: int) -> dict[str, np.ndarray]:
    merged = recording.merged
    end = min(begin + BLOCK, recording.last)
    t = merged.t[begin:end] - merged.t[recording.first]
    return {"t": t, **{name: merged.column(name, begin, end) for name in merged.names}}


def _write_parquet(recording: ImportedRecording, path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    schema = pa.schema([(name, pa.float64()) for name in ("t", *recording.merged.names)])
    with parquet.ParquetWriter(path, schema) as writer:
        for begin in range(recording.first, recording.last, BLOCK):
            writer.write_table(pa.table(_block(recording, begin), schema=schema))


def _cell(name: str) -> str:
    """A name as a cell of a CSV file."""
    return '"' + name.replace('"', '""') + '"' if any(mark in name for mark in ',"\n') else name
