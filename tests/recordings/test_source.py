"""Folders of recordings: what is loaded, which part is kept, and what is held out."""

import pickle
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.recordings.source import RecordingSource

Columns = dict[str, np.ndarray]
Swing = Callable[[int], Columns]
WriteCsv = Callable[[Path, Columns], Path]


def test_jitter_and_missing_rows_stay_as_logged(folder: Path, write_csv: WriteCsv, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.cumsum(rng.uniform(0.001, 0.02, size=300))[rng.random(300) < 0.8]
    columns = {"t": t, "theta": rng.normal(size=len(t)), "u": rng.normal(size=len(t))}
    write_csv(folder / "r1.csv", columns)
    (recording,) = RecordingSource(path=str(folder)).load()
    assert recording.name == "r1.csv"
    assert set(recording.columns) == set(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(recording[name], values)


def test_csv_and_parquet_hold_the_same_recording(folder: Path, swing: Swing, write_csv: WriteCsv):
    write_csv(folder / "a.csv", swing(50))
    parquet.write_table(pa.table(swing(50)), folder / "b.parquet")
    first, second = RecordingSource(path=str(folder)).load()
    assert (first.name, second.name) == ("a.csv", "b.parquet")
    np.testing.assert_array_equal(first.stack(("t", "theta", "u")), second.stack(("t", "theta", "u")))


def test_optional_columns_come_along_and_foreign_ones_stay_out(folder: Path, swing: Swing, write_csv: WriteCsv):
    write_csv(folder / "a.csv", {**swing(10), "theta_dot": np.ones(10), "u_measured": np.ones(10), "x": np.ones(10)})
    (recording,) = RecordingSource(path=str(folder)).load()
    assert set(recording.columns) == {"t", "theta", "u", "theta_dot", "u_measured"}


def test_signals_of_the_robot_name_columns_units_and_signs(folder: Path, write_csv: WriteCsv):
    with (folder / "robot.yaml").open("a") as stream:
        stream.write("signals: {t: {column: time, unit: ms}, theta: {column: pitch, unit: deg, scale: -1}}\n")
    write_csv(folder / "a.csv", {"time": np.arange(4.0), "pitch": np.full(4, 90.0), "u": np.zeros(4)})
    (recording,) = RecordingSource(path=str(folder)).load()
    np.testing.assert_allclose(recording.t, [0.0, 0.001, 0.002, 0.003])
    np.testing.assert_allclose(recording["theta"], -np.pi / 2)


def test_description_in_the_configuration_needs_no_robot_file(tmp_path: Path, swing: Swing, write_csv: WriteCsv):
    write_csv(tmp_path / "a.csv", swing(10))
    robot = {"plant": "pendulum", "parameters": {"body_mass": 1, "com_height": 0.4, "body_inertia": 0.1}}
    source = RecordingSource(path=str(tmp_path), robot=robot)
    assert len(source.load()) == 1
    assert source.name == tmp_path.name


def test_span_keeps_its_part_and_what_lies_outside_is_not_judged(folder: Path, swing: Swing, write_csv: WriteCsv):
    columns = swing(100)
    columns["u"][:20] = np.nan  # before the controller was switched on
    write_csv(folder / "a.csv", columns)
    write_csv(folder / "b.csv", swing(100))
    with pytest.raises(InputError, match=r"a\.csv line 2: u is 'nan'"):
        RecordingSource(path=str(folder)).load()
    a, b = RecordingSource(path=str(folder), spans={"a*": [0.2, None]}).load()
    np.testing.assert_array_equal(a.t, columns["t"][20:])
    assert len(b) == 100


def test_where_keeps_the_leading_rows_only(folder: Path, swing: Swing, write_csv: WriteCsv):
    enabled = np.array([1.0] * 6 + [0.0] * 2 + [1.0] * 2)
    write_csv(folder / "a.csv", {**swing(10), "torque_enable": enabled})
    (recording,) = RecordingSource(path=str(folder), where={"torque_enable": 1}).load()
    assert len(recording) == 6


def test_automatic_split_holds_out_every_third_of_many(folder: Path, swing: Swing, write_csv: WriteCsv):
    for number in range(1, 8):
        write_csv(folder / f"r{number}.csv", swing(20))
    source = RecordingSource(path=str(folder))
    split = source.split(source.load())
    assert [recording.name for recording in split.held_out] == ["r3.csv", "r6.csv"]
    assert len(split.fit) == 5
    assert "r3.csv, r6.csv" in split.rule


def test_automatic_split_holds_out_the_end_of_few(folder: Path, swing: Swing, write_csv: WriteCsv):
    write_csv(folder / "r1.csv", swing(101))
    source = RecordingSource(path=str(folder))
    split = source.split(source.load())
    assert split.fit[0].t[-1] < split.held_out[0].t[0]
    assert len(split.fit[0]) + len(split.held_out[0]) == 101
    assert split.held_out[0].duration == pytest.approx(0.3, abs=0.011)  # one row of 0.01 s
    assert "30%" in split.rule


def test_named_recordings_are_held_out(folder: Path, swing: Swing, write_csv: WriteCsv):
    for name in ("low_1", "low_2", "high_1"):
        write_csv(folder / f"{name}.csv", swing(20))
    source = RecordingSource(path=str(folder), held_out=["low_*"])
    split = source.split(source.load())
    assert [recording.name for recording in split.fit] == ["high_1.csv"]


def test_source_pickles(folder: Path):
    source = RecordingSource(path=str(folder), spans={"a": [0, None]})
    assert pickle.loads(pickle.dumps(source)) == source


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"path": None}, "recordings.path is needed: the folder with robot.yaml and the recordings"),
        ({"path": "/nowhere/at/all"}, "recordings.path /nowhere/at/all does not exist"),
        ({"path": "/nowhere/at/all", "origin": "the moon"}, "come from the moon"),
        ({"files": ["q*.csv"]}, "no file matches q*.csv"),
        ({"files": ["/abs*.csv"]}, "'/abs*.csv' is no pattern of file names"),
        ({"files": ["*.parquet"]}, "no recordings, expected files *.parquet"),
        ({"spans": {"q*": [0, 1]}}, "recordings.spans: q* matches none of a.csv"),
        ({"spans": {"a*": [1, 0]}}, "expected [from, to] in s"),
        ({"spans": {"a*": [5, None]}}, "a.csv: 0 rows that recordings.spans and recordings.where keep"),
        ({"where": {"torque_enable": 1}}, "unknown column 'torque_enable'"),
        ({"where": {"u": 99}}, "a.csv: 0 rows"),
        ({"held_out": ["q*"]}, "recordings.held_out: q* matches none of a.csv"),
        ({"held_out": ["*"]}, "none left to fit"),
        ({"held_out": 1.5}, "recordings.held_out is 1.5"),
        ({"held_out": "some"}, "recordings.held_out is 'some'"),
        ({"held_out": 0.01}, "rows on one side of the cut"),
    ],
)
def test_setting_at_fault_is_named(folder: Path, swing: Swing, write_csv: WriteCsv, settings: dict, said: str):
    write_csv(folder / "a.csv", swing(100))
    source = RecordingSource(**{"path": str(folder), **settings})
    with pytest.raises(InputError) as error:
        source.split(source.load())
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_folder_without_description_or_recordings_says_what_belongs_there(folder: Path):
    with pytest.raises(InputError, match=r"no recordings, expected files \*\.csv or \*\.parquet"):
        RecordingSource(path=str(folder)).load()
    (folder / "robot.yaml").unlink()
    with pytest.raises(InputError, match=r"robot\.yaml is missing; describe the robot there"):
        RecordingSource(path=str(folder)).load()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,angle,u\n0,0,0\n", "a.csv: column theta [rad] is missing; rename one of t, angle, u, or name its column"),
        ("t,theta,u\n0,0,0\n0.1,0,0\n", "a.csv: 2 rows, expected 3 or more"),
        ("t,theta,u\n0,0,0\n0.2,0,0\n0.1,0,0\n", "a.csv line 4: t decreases (0.1 after 0.2 s)"),
        ("t,theta,u\n0,0,0\n0.2,0,0\n0.2,0,0\n", "a.csv line 4: t repeats 0.2 s"),
        ("t,theta,u\n0,0,0\n0.2,NaN,0\n0.3,0,0\n", "a.csv line 3: theta is 'NaN'"),
        ("t,theta,u\n0,0,0\n0.2,0,off\n0.3,0,0\n", "a.csv line 3: u is 'off'"),
        ("", "a.csv: the file is empty"),
    ],
)
def test_recording_at_fault_is_named_by_file_and_row(folder: Path, text: str, said: str):
    (folder / "a.csv").write_text(text)
    with pytest.raises(InputError) as error:
        RecordingSource(path=str(folder)).load()
    assert said in str(error.value)


def test_column_that_signals_name_must_be_in_the_log(folder: Path, swing: Swing, write_csv: WriteCsv):
    with (folder / "robot.yaml").open("a") as stream:
        stream.write("signals: {theta: {column: pitch}}\n")
    write_csv(folder / "a.csv", swing(10))
    with pytest.raises(InputError, match=r"column pitch of signals\.theta is missing; the file has t, theta, u"):
        RecordingSource(path=str(folder)).load()


LOADED = """
plant: cartpole
parameters: {body_mass: 0.8, wheel_mass: 1.0, com_height: 0.4, body_inertia: 0.03}
loads:
  heavy: {mass: 1.6, height: 0.45, side: -0.18, recordings: "heavy_*"}
"""


@pytest.fixture
def loaded(tmp_path: Path, swing, write_csv) -> Path:
    """Two recordings of a cartpole, with and without a load."""
    (tmp_path / "robot.yaml").write_text(LOADED)
    for name in ("bare_1.csv", "heavy_1.csv"):
        write_csv(tmp_path / name, {**swing(20), "x": np.linspace(0.0, 0.1, 20)})
    return tmp_path


def test_the_load_of_every_recording_is_known(loaded: Path):
    source = RecordingSource(path=str(loaded))
    recordings = source.load_all()
    assert [r.name for r in recordings] == ["bare_1.csv", "heavy_1.csv"]
    assert source.loads(recordings) == (None, Load(1.6, 0.45, -0.18))


def test_recordings_with_loads_are_not_taken_for_those_of_one_robot(loaded: Path):
    expected = rf"^{re.escape(str(loaded / 'robot.yaml'))} names loads, [^\n]*use task=adapt, or choose [^\n]*$"
    with pytest.raises(InputError, match=expected):
        RecordingSource(path=str(loaded)).load()
    (bare,) = RecordingSource(path=str(loaded), files=["bare_*.csv"]).load()
    assert bare.name == "bare_1.csv"


def test_a_load_without_any_recording_is_named(loaded: Path):
    (loaded / "heavy_1.csv").unlink()
    with pytest.raises(
        InputError, match=r"loads: heavy: heavy_\* matches none of the recordings; correct the pattern$"
    ):
        RecordingSource(path=str(loaded)).load()
