"""Runs reach MLflow from their folders, each once: also where several processes start on a fresh database."""

import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import onnx
import pytest
from mlflow import MlflowClient
from mlflow.models import get_model_info

from wipx.core.errors import InputError
from wipx.tracking.mlflow_store import LONGEST_PARAMETER, MlflowTracking, NoTracking, valid_name
from wipx.tracking.run_note import LOGGED, DataNote, RunNote, write_run_note

LOG_ONE_RUN = """
import sys
from pathlib import Path
from wipx.tracking.mlflow_store import MlflowTracking
MlflowTracking(sys.argv[1]).log(Path(sys.argv[2]))
"""


def noted(folder: Path, name: str = "r", **content) -> Path:
    """A folder with the note of a run."""
    folder.mkdir(parents=True, exist_ok=True)
    given = {
        "started": 10.0,
        "ended": 75.0,
        "in_sweep": False,
        "parameters": {},
        "metrics": {},
        "experiment": "study",
        **content,
    }
    write_run_note(folder, RunNote(name, **given))
    return folder


def rows(folder: Path, query: str) -> list[tuple]:
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
    out = noted(
        tmp_path / "out",
        "first",
        parameters={"long": "y" * 9000, "none": None, **{f"p{i}": i for i in range(120)}},
        metrics={"rms/theta (rad)": 0.1, "undefined": float("nan"), "loss": 1.0},
        histories={"loss": [[i, 3.0 - i / 749.5] for i in range(1500)]},
        artifacts=["report.html"],
        tags={"task": "identify"},
    )
    (out / "report.html").write_text("<p>")
    MlflowTracking(str(folder)).log(out)

    assert rows(folder, "select name, status, end_time - start_time from runs") == [("first", "FINISHED", 65_000)]
    assert rows(folder, "select name from experiments where name = 'study'") == [("study",)]
    assert rows(folder, "select count(*) from params") == [(122,)]
    assert rows(folder, "select length(value) from params where key = 'long'") == [(LONGEST_PARAMETER,)]
    assert rows(folder, "select count(*) from metrics where key = 'loss'") == [
        (1500,)
    ]  # the last point of the history is the final value
    assert rows(folder, "select value, step from latest_metrics where key = 'loss'") == [(1.0, 1499)]
    assert rows(folder, "select value from latest_metrics where key = 'rms/theta _rad_'") == [(0.1,)]
    assert rows(folder, "select is_nan from latest_metrics where key = 'undefined'") == [(1,)]
    assert [path.name for path in (folder / "mlartifacts").rglob("*.html")] == ["report.html"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "runs with blanks"]


def test_a_run_is_logged_once_even_where_it_was_interrupted(tmp_path: Path):
    out = noted(tmp_path / "out", metrics={"loss": 1.0}, histories={"loss": [[0, 2.0], [1, 1.0]]})
    tracking = MlflowTracking(str(tmp_path / "runs"))
    tracking.log(out)
    tracking.log(out)
    (out / LOGGED).unlink()  # as after a kill between the logging and the note of it
    tracking.log(out)
    assert rows(tmp_path / "runs", "select count(*) from runs") == [(1,)]
    assert rows(tmp_path / "runs", "select count(*) from metrics") == [(2,)]


def test_another_run_in_the_same_folder_is_another_run_of_mlflow(tmp_path: Path):
    tracking = MlflowTracking(str(tmp_path / "runs"))
    for name in ("before", "after"):
        tracking.log(noted(tmp_path / "out", name))
    assert rows(tmp_path / "runs", "select name from runs order by name") == [("after",), ("before",)]


def test_jobs_of_a_sweep_stand_under_one_run_that_takes_what_was_made_of_them(tmp_path: Path):
    sweep = tmp_path / "ablation" / "quick"
    table = tmp_path / "table.md"
    table.write_text("| a |")
    tracking = MlflowTracking(str(tmp_path / "runs"))
    for name in ("a", "b"):
        tracking.log(noted(sweep / name, name, in_sweep=True))
    tracking.log_sweep(sweep, {"best": 0.5}, [table])

    parents = rows(tmp_path / "runs", "select run_uuid from runs where name = 'all of quick'")
    assert len(parents) == 1
    assert rows(tmp_path / "runs", "select start_time, end_time from runs where name = 'all of quick'") == [
        (10_000, 75_000)
    ]
    children = rows(tmp_path / "runs", "select value from tags where key = 'mlflow.parentRunId'")
    assert children == parents * 2
    assert rows(tmp_path / "runs", "select value from metrics where key = 'best'") == [(0.5,)]
    assert [path.name for path in (tmp_path / "runs" / "mlartifacts").rglob("*.md")] == ["table.md"]


def estimator(path: Path) -> str:
    """An ONNX graph from windows of 30 samples to pitches; returns the file's name."""
    windows = onnx.helper.make_tensor_value_info("windows", onnx.TensorProto.FLOAT, ["robots", 30, 2])
    pitch = onnx.helper.make_tensor_value_info("pitch", onnx.TensorProto.FLOAT, ["robots"])
    node = onnx.helper.make_node("ReduceMean", ["windows"], ["pitch"], axes=[1, 2], keepdims=0)
    graph = onnx.helper.make_graph([node], "mean", [windows], [pitch])
    onnx.save(onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 13)], ir_version=8), path)
    return path.name


def test_data_are_inputs_of_a_run_and_its_estimator_is_registered_with_its_signature(tmp_path: Path):
    data = DataNote("trials", "runs/trials/1a2b", "1a2b", "training")
    out = noted(tmp_path / "out", data=[data], models={"pitch-cnn1d-30": "estimator.onnx"})
    estimator(out / "estimator.onnx")
    tracking = MlflowTracking(str(tmp_path / "runs"))
    tracking.log(out)
    (out / LOGGED).unlink()
    tracking.log(out)  # as after a kill: nothing twice

    assert rows(tmp_path / "runs", "select name, digest from datasets") == [("trials", "1a2b")]
    assert rows(tmp_path / "runs", "select count(*) from inputs") == [(1,)]
    assert rows(tmp_path / "runs", "select name, version from model_versions") == [("pitch-cnn1d-30", 1)]
    client = MlflowClient(f"sqlite:///{tmp_path / 'runs' / 'mlflow.db'}")
    place = client.get_model_version_download_uri("pitch-cnn1d-30", "1")
    signature = get_model_info(place.removeprefix("file://")).signature
    assert signature.inputs.to_dict()[0]["tensor-spec"]["shape"] == (-1, 30, 2)
    assert signature.outputs.input_names() == ["pitch"]


def test_a_sweep_whose_database_was_removed_gets_a_new_run(tmp_path: Path):
    out = noted(tmp_path / "sweep" / "a", in_sweep=True)
    MlflowTracking(str(tmp_path / "before")).log(out)
    MlflowTracking(str(tmp_path / "after")).log(out)
    assert len(rows(tmp_path / "after", "select name from runs")) == 2


@pytest.mark.slow
def test_processes_that_start_together_on_a_fresh_database_all_log_and_stay_quiet(tmp_path: Path):
    outs = [noted(tmp_path / "sweep" / str(i), in_sweep=True) for i in range(3)]
    commands = [[sys.executable, "-c", LOG_ONE_RUN, str(tmp_path), str(out)] for out in outs]
    together = [
        subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for command in commands
    ]
    assert [process.communicate() for process in together] == [("", "")] * 3
    assert [process.returncode for process in together] == [0] * 3
    assert rows(tmp_path, "select count(*) from runs where status = 'FINISHED'") == [(4,)]


def test_a_run_that_cannot_be_logged_stays_and_says_so_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (tmp_path / "file").write_text("")
    out = noted(tmp_path / "out")
    MlflowTracking(str(tmp_path / "file" / "runs")).log(out)
    said = capsys.readouterr().err
    assert "not logged; log it later with task=log_runs" in said
    assert said.count("\n") == 1
    MlflowTracking(str(tmp_path / "runs")).send(out)
    assert rows(tmp_path / "runs", "select count(*) from runs") == [(1,)]


def test_no_tracking_writes_nothing(tmp_path: Path):
    out = noted(tmp_path / "out")
    NoTracking().log(out)
    assert [path.name for path in out.iterdir()] == ["run.json"]
    with pytest.raises(InputError, match="tracking=none logs nothing"):
        NoTracking().send(out)
