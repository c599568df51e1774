"""CSV and Parquet files as numbers, and every way in which they can be at fault."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from wipx.core.errors import InputError
from wipx.recordings.tables import check_increasing, open_table


def csv_file(folder: Path, text: str | bytes) -> Path:
    path = folder / "r3.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def parquet_file(folder: Path, columns: dict[str, object]) -> Path:
    path = folder / "r3.parquet"
    parquet.write_table(pa.table(columns), path)
    return path


def test_numbers_come_back_with_all_digits_from_both_formats(tmp_path: Path, fresh_seed: int):
    values = np.random.default_rng(fresh_seed).normal(size=50) * 10.0 ** np.arange(-25, 25)
    rows = "\n".join(repr(float(value)) for value in values)
    for path in (csv_file(tmp_path, f"a\n{rows}\n"), parquet_file(tmp_path, {"a": values})):
        np.testing.assert_array_equal(open_table(path).column("a"), values)


@pytest.mark.parametrize(
    "text",
    [
        "t,x\n0,1\n2,3\n",
        "t,x\r\n0,1\r\n2,3\r\n",
        "\ufefft,x\n0,1\n2,3",
        " t , x \n0, 1\n2,3 \n",
        "t,x\n\n0,1\n2,3\n\n",
        '"t","x"\n0,"1"\n2,3\n',
    ],
    ids=["plain", "CRLF", "byte-order mark", "spaces", "blank lines", "quotes"],
)
def test_ways_of_writing_the_same_table_are_read_alike(tmp_path: Path, text: str):
    table = open_table(csv_file(tmp_path, text))
    assert table.names == ("t", "x")
    np.testing.assert_array_equal(table.column("x"), [1.0, 3.0])


def test_text_in_a_column_that_is_not_needed_is_tolerated(tmp_path: Path):
    table = open_table(csv_file(tmp_path, "t,note\n0,start\n1,\n"))
    np.testing.assert_array_equal(table.column("t"), [0.0, 1.0])


@pytest.mark.parametrize("cell", ["abc", "", " ", "nan", "inf", "-inf", "1.0.0"])
def test_cell_without_a_finite_number_is_named_by_line_and_column(tmp_path: Path, cell: str):
    table = open_table(csv_file(tmp_path, f"x,t\n0,0\n\n0,{cell}\n"))
    with pytest.raises(InputError, match=r"r3\.csv line 4: t is .*, expected a finite number"):
        table.column("t")


@pytest.mark.parametrize("cell", [None, float("nan"), float("inf")])
def test_parquet_row_without_a_finite_number_is_named(tmp_path: Path, cell: float | None):
    table = open_table(parquet_file(tmp_path, {"t": [0.0, cell, 1.0]}))
    with pytest.raises(InputError, match=r"r3\.parquet row 2: t is "):
        table.column("t")


def test_whole_numbers_and_truth_values_of_parquet_are_numbers(tmp_path: Path):
    table = open_table(parquet_file(tmp_path, {"n": [1, 2], "on": [True, False]}))
    np.testing.assert_array_equal(table.column("n"), [1.0, 2.0])
    np.testing.assert_array_equal(table.column("on"), [1.0, 0.0])


def test_time_stamps_of_parquet_are_refused_as_no_seconds(tmp_path: Path):
    stamps = pa.array([0, 1], type=pa.timestamp("ns"))
    with pytest.raises(InputError, match=r"t is of type timestamp\[ns\], expected numbers"):
        open_table(parquet_file(tmp_path, {"t": stamps})).column("t")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("\n\n", "the file is empty"),
        ("t,x\n", "no row"),
        ("t;x\n0;1\n", "separate the cells by commas"),
        ("t,x\n0,1\n1\n", "line 3: 1 cells, the header has 2"),
        ("t,x\n0,1\n1,2,5\n", "line 3: 3 cells, the header has 2"),
        (b"t,x\n0,\xff\n", "not UTF-8 text"),
    ],
)
def test_file_that_is_no_table_is_refused(tmp_path: Path, text: str | bytes, said: str):
    with pytest.raises(InputError, match=said):
        open_table(csv_file(tmp_path, text))


def test_unreadable_parquet_is_refused_in_one_line(tmp_path: Path):
    path = tmp_path / "r3.parquet"
    path.write_bytes(b"PAR1 not really")
    with pytest.raises(InputError, match="not a readable Parquet file") as error:
        open_table(path)
    assert "\n" not in str(error.value)


def test_parquet_without_rows_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="no row"):
        open_table(parquet_file(tmp_path, {"t": pa.array([], type=pa.float64())}))


def test_missing_column_lists_those_that_are_there(tmp_path: Path):
    with pytest.raises(InputError, match=r"r3\.csv: unknown column 'theta'.*pitch, t"):
        open_table(csv_file(tmp_path, "t,pitch\n0,1\n")).column("theta")


def test_column_that_is_there_twice_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="two columns are named x"):
        open_table(csv_file(tmp_path, "x,x\n0,1\n")).column("x")


def test_time_that_decreases_or_repeats_is_named_by_its_line(tmp_path: Path):
    table = open_table(csv_file(tmp_path, "t\n4.05\n4.06\n\n4.052\n"))
    with pytest.raises(InputError, match=r"r3\.csv line 5: t decreases \(4\.052 after 4\.06 s\); sort or drop the row"):
        check_increasing(table.column("t"), table)
    table = open_table(csv_file(tmp_path, "t\n0\n1\n1\n"))
    with pytest.raises(InputError, match=r"r3\.csv line 4: t repeats 1 s; drop the row"):
        check_increasing(table.column("t"), table)
