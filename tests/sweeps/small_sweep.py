"""A sweep of small jobs with real results, and what it leaves: for comparisons of a sweep with another."""

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

NAME = "small"
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}


def command(seeds: int, *arguments: str) -> list[str]:
    """The sweep: two methods without a search, on one trial of each load."""
    return [
        *(sys.executable, "-m", "wipx", "+experiment=reality_gap", "-m", f"name={NAME}"),
        *("method=pure_sim,sim_param_dr", f"seed=range(0,{seeds})", "task.per_load=1", "task.draws=3"),
        *arguments,
    ]


def environment(**more: str) -> dict[str, str]:
    return {**os.environ, **ONE_THREAD, **more}


def run(folder: Path, seeds: int, *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    """Run the sweep to its end."""
    folder.mkdir(parents=True, exist_ok=True)
    asked = command(seeds, *arguments)
    return subprocess.run(asked, cwd=folder, env=environment(**more), capture_output=True, text=True, check=False)


def results(folder: Path) -> dict[str, Any]:
    """What the jobs found, by label."""
    found = {}
    for path in sorted((folder / "runs" / NAME).glob("*/result.json")):
        found[path.parent.name] = json.loads(path.read_text())["result"]
    return found


def logged(folder: Path) -> list[tuple[str, str, tuple]]:
    """What MLflow has of the jobs: name, state and metrics of every run, sorted; the sweep's own run first."""
    with closing(sqlite3.connect(folder / "runs" / "mlflow.db")) as database:
        runs = database.execute("select run_uuid, name, status from runs").fetchall()
        metrics = "select key, value from metrics where run_uuid = ? order by key, step, value"
        return sorted((name, state, tuple(database.execute(metrics, (key,)).fetchall())) for key, name, state in runs)
