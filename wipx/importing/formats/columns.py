"""Columns of Parquet files and arrays of data sets as named numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wipx.importing.formats.message_fields import LONGEST


def columns_of_array(name: str, values: np.ndarray, labels: Sequence[str] = ()) -> dict[str, np.ndarray]:
    """An array of numbers as columns: `name`, or one for each element of a row.

    Elements are `name.LABEL` where there is a label for each, else `name[0]`, `name[0,1]`, ... Rows of more than
    `LONGEST` elements (images) and text give nothing.

    Args:
        name: Of the array.
        values: Shape (rows, ...).
        labels: Names of the elements of a row.
    """
    if values.dtype.kind not in "biuf" or values.ndim == 0:
        return {}
    width = int(np.prod(values.shape[1:]))
    if values.ndim == 1:
        return {name: values.astype(float)}
    if width > LONGEST:
        return {}
    flat = values.reshape(len(values), width).astype(float)
    if len(labels) == width:
        return {f"{name}.{label}": flat[:, k] for k, label in enumerate(labels)}
    places = [",".join(map(str, place)) for place in np.ndindex(*values.shape[1:])]
    return {f"{name}[{place}]": flat[:, k] for k, place in enumerate(places)}


def columns_of_batch(batch: Any, labels: Mapping[str, Sequence[str]]) -> dict[str, np.ndarray]:
    """The numbers of a record batch of pyarrow; times become seconds, missing values NaN.

    Args:
        batch: A `pyarrow.RecordBatch`.
        labels: Names of the elements of columns that hold lists, by column.
    """
    columns: dict[str, np.ndarray] = {}
    for name, values in zip(batch.schema.names, batch.columns, strict=True):
        array = _array(values)
        if array is not None:
            columns |= columns_of_array(str(name), array, labels.get(str(name), ()))
    return columns


def _array(values: Any) -> np.ndarray | None:
    """A column as numbers, shape (rows,) or (rows, elements); None where it holds no numbers."""
    import pyarrow as pa

    kind = values.type
    if pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        lengths = np.unique([0 if row is None else len(row) for row in values])
        inner = _array(values.flatten())
        if inner is None or inner.ndim != 1 or len(lengths) != 1 or values.null_count:
            return None
        return inner.reshape(len(values), int(lengths[0]))
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        whole = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[kind.unit]
        ticks = values.cast(pa.int64() if kind.bit_width == 64 else pa.int32())
        return _with_gaps(ticks) * whole
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return _with_gaps(values)
    return None


def _with_gaps(values: Any) -> np.ndarray:
    import pyarrow as pa

    return np.array(values.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=float)
