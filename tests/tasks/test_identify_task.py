"""`task=identify` from recordings to a model that `task=predict` accepts."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

FAST = ("task=identify", "optimizer.starts=1", "objective.horizon=0.3")
RESULTS = {"config.yaml", "fit.png", "metrics.json", "model.yaml", "report.html", "search.csv"}


@pytest.mark.slow
def test_a_pendulum_is_completed_and_its_model_predicts(program, examples: Path, tmp_path: Path):
    pendulum = examples / "pendulum"
    answer = program(*FAST, f"recordings.path={pendulum / 'visible'}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert "pitch/coulomb.F_c" in answer.out
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} >= RESULTS
    metrics = json.loads((out / "metrics.json").read_text())
    level = metrics["parameters"]["pitch/coulomb.F_c"]
    assert level["ci95"][0] <= 0.0857 <= level["ci95"][1]  # README.md of the examples
    damping = metrics["parameters"]["pitch/viscous.sigma"]
    assert damping["ci95"][0] == 0.0  # there is none
    held_out = metrics["fit"]["heldout"]
    assert held_out["completed"]["theta"] < 0.1 * held_out["nominal"]["theta"]
    model = yaml.safe_load((out / "model.yaml").read_text())
    assert model["effects"]["pitch/coulomb"]["F_c"] == level["value"]
    page = (out / "report.html").read_text()
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert (out / "fit.png").read_bytes().startswith(b"\x89PNG")
    arguments = (f"recordings.path={pendulum / 'unseen'}", "model.path=out/model.yaml", "hydra.run.dir=seen")
    assert program("task=predict", *arguments).status == 0
    seen = json.loads((tmp_path / "seen" / "metrics.json").read_text())
    assert seen["rms"]["theta"] < 0.1 * seen["rms_nominal"]["theta"]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_model(program, folder, tmp_path: Path):
    searched = ("task=identify", "objective.horizon=0.3", "optimizer.starts=2", "optimizer.sample=8")
    arguments = (*searched, f"recordings.path={folder.path}")
    for out in ("first", "second"):
        assert program(*arguments, "seed=5", f"hydra.run.dir={out}").status == 0
    models = [(tmp_path / out / "model.yaml").read_bytes() for out in ("first", "second")]
    assert models[0] == models[1]


def test_an_earlier_model_gives_its_friction(program, folder, tmp_path: Path):
    known = {"pitch/coulomb": {"F_c": 0.01}}
    (tmp_path / "earlier.yaml").write_text(yaml.safe_dump({**folder.robot, "effects": known}))
    friction = ("friction=identified", "model.path=earlier.yaml", "effects=[pitch/viscous]")
    answer = program(*FAST, *friction, f"recordings.path={folder.path}", "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    model = yaml.safe_load((tmp_path / "out" / "model.yaml").read_text())
    assert model["effects"]["pitch/coulomb"] == known["pitch/coulomb"]
    assert set(model["effects"]) == {"pitch/coulomb", "pitch/viscous"}


@pytest.mark.slow
def test_the_run_is_logged(program, folder, tmp_path: Path):
    arguments = (f"recordings.path={folder.path}", "hydra.run.dir=out", "tracking.folder=tracked")
    answer = program(*FAST, *arguments, tracking="mlflow")
    assert answer.status == 0, answer.error
    with sqlite3.connect(tmp_path / "tracked" / "mlflow.db") as database:
        parameters = dict(database.execute("select key, value from params"))
        figures = dict(database.execute("select key, value from latest_metrics"))
        (status,) = database.execute("select status from runs").fetchone()
    assert status == "FINISHED"
    assert parameters["seed"] == "0"
    assert any("least_squares" in value for value in parameters.values())
    assert {"fit/nominal/theta in rad", "fit/completed/theta in rad"} <= set(figures)
    assert "parameter/pitch/coulomb.F_c in N m" in figures
    artifacts = {path.name for path in (tmp_path / "tracked").rglob("*")}
    assert {"model.yaml", "metrics.json", "report.html", "fit.png"} <= artifacts


@pytest.mark.slow
def test_bounds_may_be_whole_numbers(program, folder, tmp_path: Path):
    arguments = ("bounds={pitch/coulomb.F_c: [0, 1]}", f"recordings.path={folder.path}", "hydra.run.dir=out")
    answer = program(*FAST, *arguments)
    assert (answer.status, answer.error) == (0, "")


def heeds_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.slow
def test_an_interrupted_search_leaves_one_line_and_no_file(folder, tmp_path: Path):
    endless = ("optimizer=pso", "optimizer.iterations=1000000", "tracking=none", "task=identify")
    command = [sys.executable, "-m", "wipx", *endless, f"recordings.path={folder.path}", "hydra.run.dir=out"]
    source = Path(__file__).resolve().parents[2]
    environment = {**os.environ, "PYTHONPATH": str(source)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # A shell's background job, and so its children, would ignore the signal.
    with subprocess.Popen(command, cwd=tmp_path, env=environment, preexec_fn=heeds_interrupts, **pipes) as run:
        time.sleep(6.0)  # in the search; a start takes one to three seconds
        assert run.poll() is None
        run.send_signal(signal.SIGINT)
        try:
            out, error = run.communicate(timeout=20.0)
        except subprocess.TimeoutExpired:
            run.kill()
            pytest.fail("the program did not end within 20 s of SIGINT")
    assert (run.returncode, out) == (130, "")
    assert error == "interrupted; the run was not finished\n"
    assert not (tmp_path / "out").exists()
