"""MLflow's pages on a local database: views are prepared, then MLflow's own server shows them."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from wipx.core.errors import InputError
from wipx.tracking.reach import SQLITE, check_reachable
from wipx.tracking.views import CHARTS, PARENT, TABLE, TAG, VIEWS, compared_by, view_states

if TYPE_CHECKING:
    from mlflow import MlflowClient

SAMPLED = 200  # runs of an experiment, the latest, by which its views are chosen
STARTS_WITHIN = 600.0  # [s] on a busy machine
HOST = "127.0.0.1"


def prepare(folder: Path) -> Mapping[str, str]:
    """Give every experiment of a local database its columns, its charts and a description that leads to them.

    Returns:
        Addresses of the experiments' runs below the server's, by name, the experiment of the latest run first.

    Raises:
        InputError: there is no database, or it cannot be used.
    """
    store = f"{SQLITE}{folder.resolve() / 'mlflow.db'}"
    if not (folder / "mlflow.db").is_file():
        raise InputError(f"{folder / 'mlflow.db'}: there are no runs yet; run a task first, e.g. make demo")
    check_reachable(store)
    from wipx.tracking.mlflow_store import quiet_client_type

    client = quiet_client_type()(tracking_uri=store)
    found = []
    for experiment in client.search_experiments():
        runs = client.search_runs([experiment.experiment_id], max_results=SAMPLED)
        if runs:
            _describe(client, experiment.experiment_id, runs)
            latest = max(run.info.start_time for run in runs)
            found.append((latest, experiment.name, _address(experiment.experiment_id, TABLE)))
    return {name: address for _, name, address in sorted(found, reverse=True)}


@contextmanager
def served(folder: Path, port: int) -> Iterator[str]:
    """Serve the database of a folder while the block runs; gives the server's address.

    Raises:
        InputError: the port is taken, or the server does not start.
    """
    address = f"http://{HOST}:{port}"
    if _answers(address):
        raise InputError(f"task.port={port}: something answers there already; end it, or give another task.port=N")
    database = f"{SQLITE}{folder.resolve() / 'mlflow.db'}"
    files = (folder.resolve() / "mlartifacts").as_uri()
    command = [sys.executable, "-m", "mlflow", "server", "--host", HOST, "--port", str(port), "--workers", "1"]
    command += ["--backend-store-uri", database, "--default-artifact-root", files]
    environment = {**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true", "MLFLOW_LOGGING_LEVEL": "WARNING"}
    with (folder / "mlflow_server.log").open("w", encoding="utf-8") as log:
        server = subprocess.Popen(
            command, stdout=log, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
    try:
        _wait(server, address, folder / "mlflow_server.log")
        yield address
    finally:
        os.killpg(server.pid, signal.SIGTERM)  # the server's own helpers too
        server.wait()


def _describe(client: "MlflowClient", experiment: str, runs: list) -> None:
    """Tags of an experiment: its kind, its shared views, its description."""
    tasks = [run.data.params.get("task", "") for run in runs]
    known = [task for task in tasks if task in VIEWS]
    client.set_experiment_tag(experiment, "mlflow.experimentKind", "custom_model_development")
    if not known:
        return
    view = VIEWS[max(set(known), key=known.count)]
    values = {name: [run.data.params[name] for run in runs if name in run.data.params] for name in view.options}
    metrics = {name for run in runs for name in run.data.metrics}
    compared = compared_by(view, values)
    in_sweep = any(PARENT in run.data.tags for run in runs)
    for name, state in view_states(view, metrics, compared, in_sweep).items():
        client.set_experiment_tag(experiment, f"{TAG}{name}", json.dumps(state))
    by = f", by {compared}" if compared else ""
    note = f"[Runs](#{_address(experiment, TABLE)}) · [charts{by}](#{_address(experiment, CHARTS)})"
    client.set_experiment_tag(experiment, "mlflow.note.content", note)


def _address(experiment: str, view: str) -> str:
    mode = "&compareRunsMode=CHART" if view == CHARTS else ""
    return f"/experiments/{experiment}/runs?workflowType=machine_learning&viewStateShareKey={view}{mode}"


def _wait(server: subprocess.Popen, address: str, log: Path) -> None:
    until = time.monotonic() + STARTS_WITHIN
    while time.monotonic() < until:
        if server.poll() is not None:
            lines = log.read_text(encoding="utf-8").strip().splitlines() or ["no message"]
            raise InputError(f"MLflow's server ended: {lines[-1]}; see {log}")
        if _answers(address):
            return
        time.sleep(0.2)
    raise InputError(f"MLflow's server did not answer within {STARTS_WITHIN:g} s; see {log}")


def _answers(address: str) -> bool:
    try:
        with urllib.request.urlopen(f"{address}/health", timeout=2.0):
            return True
    except OSError:
        return False
