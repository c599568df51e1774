"""Training sets as Parquet files: one row for each robot, and the card in the file's metadata.

    part  pitch  mass  height  side  x[L]  theta[L]

The windows are lists of L numbers (float32); any reader of Parquet shows them.
"""

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wipx.core.errors import InputError
from wipx.learn.training_set import PARTS, SIGNALS, TrainingSet

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA = 1
CARD = b"wipx.training_set"
LOAD = ("mass", "height", "side")
AGAIN = "remove it and run task=dataset again"


def write_training_set(training: TrainingSet, path: Path) -> None:
    """Write a training set, whole or not at all; the card gets the digest of the data.

    The same training set is the same file, byte for byte.
    """
    import pyarrow as pa
    from pyarrow import parquet

    length = training.windows.shape[1]
    columns: dict[str, Any] = {"part": pa.array([PARTS[i] for i in training.part.tolist()]), "pitch": training.pitch}
    columns |= dict(zip(LOAD, np.ascontiguousarray(training.loads.T), strict=True))
    for j, signal in enumerate(SIGNALS):
        flat = pa.array(training.windows[:, :, j].astype(np.float32).ravel())
        columns[signal] = pa.FixedSizeListArray.from_arrays(flat, length)
    card = {**training.card, "digest": digest_of(training)}
    content = {"schema": SCHEMA, "period": training.period, "card": card}
    table = pa.table(columns).replace_schema_metadata({CARD: json.dumps(content).encode()})
    stream = io.BytesIO()
    parquet.write_table(table, stream, compression="zstd")
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.part")
    draft.write_bytes(stream.getvalue())
    draft.replace(path)


def read_training_set(path: Path) -> TrainingSet:
    """The training set in a file, to the bit what was written.

    Raises:
        InputError: there is none, it cannot be read, is no training set, of another schema, or damaged.
    """
    table, content = _opened(path)
    if content.get("schema") != SCHEMA:
        raise InputError(f"{path}: training set of schema {content.get('schema')!r}, expected {SCHEMA}; {AGAIN}")
    try:
        windows = np.stack([_lists(table.column(signal)) for signal in SIGNALS], axis=-1)
        part = np.array([PARTS.index(name) for name in table.column("part").to_pylist()])
        loads = np.column_stack([table.column(name).to_numpy() for name in LOAD])
        pitch = table.column("pitch").to_numpy()
        training = TrainingSet(windows, pitch, loads, part, float(content["period"]), dict(content["card"]))
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path}: columns of a training set are missing or at fault ({error}); {AGAIN}") from error
    if training.card.get("digest") != digest_of(training):
        raise InputError(f"{path}: the data are not those that its card describes; {AGAIN}")
    return training


def digest_of(training: TrainingSet) -> str:
    """Short name of the data; the card is not part of it."""
    digest = hashlib.sha256(f"{training.windows.shape} {training.period!r}".encode())
    kinds = {"windows": np.float32, "pitch": float, "loads": float, "part": np.int64}
    for name, kind in kinds.items():
        digest.update(np.ascontiguousarray(vars(training)[name], dtype=kind).tobytes())
    return digest.hexdigest()[:12]


def _opened(path: Path) -> "tuple[pa.Table, Mapping[str, Any]]":
    """The table in a file, and what its metadata say of it."""
    import pyarrow as pa
    from pyarrow import parquet

    if not path.is_file():
        raise InputError(f"{path}: no such file, expected a training set (*.parquet); make one with task=dataset")
    try:
        table = parquet.read_table(path)
    except (pa.ArrowException, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: not a readable Parquet file ({reason}); {AGAIN}") from error
    metadata = table.schema.metadata or {}
    if CARD not in metadata:
        raise InputError(f"{path}: a table, but no training set of task=dataset; give another file")
    return table, json.loads(metadata[CARD])


def _lists(column: "pa.ChunkedArray") -> np.ndarray:
    """Lists of one length as an array, shape (N, L)."""
    lists = column.combine_chunks()
    return lists.flatten().to_numpy(zero_copy_only=False).reshape(len(lists), -1)
