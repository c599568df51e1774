"""Runs reach a local MLflow database, also when several processes start on a fresh one."""

import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.tracking import LONGEST_PARAMETER, MlflowTracking, NoTracking, valid_name

LOG_ONE_RUN = """
import sys
from wipx.tracking import MlflowTracking
MlflowTracking(sys.argv[1]).log("r", {"a": 1}, {"loss": 0.5}, {}, [], {})
"""


def _rows(folder: Path, query: str) -> list[tuple]:
    with closing(sqlite3.connect(folder / "mlflow.db")) as database:
        return database.execute(query).fetchall()


@pytest.mark.parametrize(
    ("name", "valid"),
    [
        ("fit/rms theta", "fit/rms theta"),
        ("F_c [N]", "F_c _N_"),
        ("../a//b", "a/b"),
        ("/", "_"),
        ("a" * 300, "a" * 250),
    ],
)
def test_names_are_made_such_that_mlflow_takes_them(name: str, valid: str):
    assert valid_name(name) == valid


def test_a_run_is_logged_with_all_it_has(tmp_path: Path):
    folder = tmp_path / "runs with blanks"
    report = tmp_path / "report.html"
    report.write_text("<p>")
    history = np.column_stack([np.arange(1500), np.linspace(3.0, 1.0, 1500)])
    parameters = {"long": "y" * 9000, "none": None, **{f"p{i}": i for i in range(120)}}
    metrics = {"rms/theta (rad)": 0.1, "undefined": float("nan"), "loss": 1.0}
    MlflowTracking(str(folder), "study").log(
        "first", parameters, metrics, {"loss": history}, [report], {"task": "identify"}
    )

    assert _rows(folder, "select name, status from runs") == [("first", "FINISHED")]
    assert _rows(folder, "select name from experiments where name = 'study'") == [("study",)]
    assert _rows(folder, "select count(*) from params") == [(122,)]
    assert _rows(folder, "select length(value) from params where key = 'long'") == [(LONGEST_PARAMETER,)]
    assert _rows(folder, "select count(*) from metrics where key = 'loss'") == [
        (1500,)
    ]  # the last point of the history is the final value
    assert _rows(folder, "select value, step from latest_metrics where key = 'loss'") == [(1.0, 1499)]
    assert _rows(folder, "select value from latest_metrics where key = 'rms/theta _rad_'") == [(0.1,)]
    assert _rows(folder, "select is_nan from latest_metrics where key = 'undefined'") == [(1,)]
    assert [path.name for path in (folder / "mlartifacts").rglob("*.html")] == ["report.html"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "runs with blanks"]


def test_jobs_of_a_sweep_stand_under_one_run_that_takes_what_was_made_of_them(tmp_path: Path):
    sweep = tmp_path / "ablation" / "quick"
    sweep.mkdir(parents=True)
    table = tmp_path / "table.md"
    table.write_text("| a |")
    tracking = MlflowTracking(str(tmp_path / "runs"))
    for name in ("a", "b"):
        tracking.log(name, {}, {"loss": 1.0}, {}, [], {}, sweep=sweep)
    tracking.log_sweep(sweep, {"best": 0.5}, [table])

    parents = _rows(tmp_path / "runs", "select run_uuid from runs where name = 'ablation/quick'")
    assert len(parents) == 1
    children = _rows(tmp_path / "runs", "select value from tags where key = 'mlflow.parentRunId'")
    assert children == parents * 2
    assert _rows(tmp_path / "runs", "select value from metrics where key = 'best'") == [(0.5,)]
    assert [path.name for path in (tmp_path / "runs" / "mlartifacts").rglob("*.md")] == ["table.md"]


def test_a_sweep_whose_database_was_removed_gets_a_new_run(tmp_path: Path):
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    MlflowTracking(str(tmp_path / "before")).log("a", {}, {}, {}, [], {}, sweep=sweep)
    MlflowTracking(str(tmp_path / "after")).log("a", {}, {}, {}, [], {}, sweep=sweep)
    assert len(_rows(tmp_path / "after", "select name from runs")) == 2


@pytest.mark.slow
def test_processes_that_start_together_on_a_fresh_database_all_log_and_stay_quiet(tmp_path: Path):
    command = [sys.executable, "-c", LOG_ONE_RUN, str(tmp_path)]
    together = [subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    assert [process.communicate() for process in together] == [("", "")] * 3
    assert [process.returncode for process in together] == [0] * 3
    assert _rows(tmp_path, "select count(*) from runs where status = 'FINISHED'") == [(3,)]


def test_a_folder_that_cannot_be_made_is_the_users_to_mend(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"tracking\.folder .*file/runs: Not a directory"):
        MlflowTracking(str(tmp_path / "file" / "runs")).log("r", {}, {}, {}, [], {})


def test_no_tracking_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    NoTracking().log("r", {"a": 1}, {"b": 2.0}, {}, [], {})
    assert not list(tmp_path.iterdir())
