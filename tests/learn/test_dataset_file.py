"""A training set comes back from its file as it was; other files are refused in one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from wipx.core.errors import InputError
from wipx.learn.dataset_file import CARD, digest_of, read_training_set, write_training_set
from wipx.learn.training_set import TrainingSet


@pytest.fixture
def training() -> TrainingSet:
    """Numbers without meaning."""
    rng = np.random.default_rng(0)
    windows = rng.normal(size=(30, 8, 2)).astype(np.float32)
    found = TrainingSet(windows, rng.normal(size=30), rng.normal(size=(30, 3)), np.arange(30) % 3, 0.015, {"seed": 7})
    return replace(found, card={"seed": 7, "model": {"effects": {}}, "digest": digest_of(found)})


def test_a_training_set_comes_back_to_the_bit(training: TrainingSet, tmp_path: Path):
    write_training_set(training, tmp_path / "a.parquet")
    back = read_training_set(tmp_path / "a.parquet")
    for name in ("windows", "pitch", "loads", "part"):
        assert np.array_equal(vars(back)[name], vars(training)[name]), name
    assert back.windows.dtype == np.float32
    assert back.period == training.period
    assert back.card == training.card


def test_the_same_training_set_is_the_same_file(training: TrainingSet, tmp_path: Path):
    for name in ("a.parquet", "b.parquet"):
        write_training_set(training, tmp_path / name)
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.parquet", "b.parquet"]


def test_any_reader_of_parquet_shows_it(training: TrainingSet, tmp_path: Path):
    write_training_set(training, tmp_path / "a.parquet")
    table = parquet.read_table(tmp_path / "a.parquet")
    assert table.column_names == ["part", "pitch", "mass", "height", "side", "x", "theta"]
    first = table.to_pylist()[0]
    assert first["part"] == "train"
    assert len(first["theta"]) == 8


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as error:
        read_training_set(path)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_other_files_are_refused(training: TrainingSet, tmp_path: Path):
    path = tmp_path / "a.parquet"
    assert "no such file" in refusal(path)
    path.write_text("no table")
    assert "not a readable Parquet file" in refusal(path)
    parquet.write_table(pa.table({"t": [0.0]}), path)
    assert "no training set" in refusal(path)


def test_a_damaged_file_or_another_schema_is_refused(training: TrainingSet, tmp_path: Path):
    path = tmp_path / "a.parquet"
    write_training_set(training, path)
    table = parquet.read_table(path)
    card = table.schema.metadata[CARD]
    parquet.write_table(table.replace_schema_metadata({CARD: card.replace(b'"schema": 1', b'"schema": 2')}), path)
    assert "of schema 2, expected 1" in refusal(path)
    parquet.write_table(table.drop_columns(["pitch"]), path)
    assert "columns of a training set are missing" in refusal(path)
    wrong = table.set_column(1, "pitch", pa.array(training.pitch + 1e-9))
    parquet.write_table(wrong, path)
    assert "not those that its card describes" in refusal(path)
