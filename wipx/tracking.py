"""Logging of finished runs to a local MLflow database; the only module that imports mlflow."""

import fcntl
import logging
import os
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wipx.core.errors import InputError

if TYPE_CHECKING:
    from mlflow import MlflowClient

# What the MLflow REST interface takes.
LONGEST_NAME = 250  # characters of a key
LONGEST_PARAMETER = 6000  # characters of a parameter's value
LONGEST_TAG = 5000  # characters of a tag's value
METRICS_IN_BATCH = 1000
PARAMETERS_IN_BATCH = 100
PARENT = ".mlflow_run"  # in a sweep's folder: the id of its own run


@dataclass(frozen=True)
class NoTracking:
    """Logs nothing."""

    def log(
        self,
        run_name: str,
        parameters: Mapping[str, object],
        metrics: Mapping[str, float],
        histories: Mapping[str, np.ndarray],
        artifacts: Sequence[Path],
        tags: Mapping[str, str],
        sweep: Path | None = None,
    ) -> None:
        """Do nothing; the arguments are those of `MlflowTracking.log`."""

    def log_sweep(self, sweep: Path, metrics: Mapping[str, float], artifacts: Sequence[Path]) -> None:
        """Do nothing; the arguments are those of `MlflowTracking.log_sweep`."""


@dataclass(frozen=True)
class MlflowTracking:
    """Logs to FOLDER/mlflow.db, files to FOLDER/mlartifacts; no server and no network.

    Attributes:
        folder: Holds the database and the files; made when it does not exist.
        experiment: Name under which MLflow lists the runs.
    """

    folder: str = "runs"
    experiment: str = "wipx"

    def log(
        self,
        run_name: str,
        parameters: Mapping[str, object],
        metrics: Mapping[str, float],
        histories: Mapping[str, np.ndarray],
        artifacts: Sequence[Path],
        tags: Mapping[str, str],
        sweep: Path | None = None,
    ) -> None:
        """Log one finished run.

        Characters that MLflow forbids in names become "_", and texts longer than it takes are cut.

        Args:
            run_name: Shown in the list of runs.
            parameters: Settings by name.
            metrics: Final numbers by name.
            histories: Course of numbers by name, arrays of shape (n, 2): step, value. A metric of
                the same name stays the last value.
            artifacts: Files to copy.
            tags: Texts by name.
            sweep: Folder of the sweep that the run is a job of: MLflow shows it under the sweep's own run, which the
                first job to finish makes. None for a single run.

        Raises:
            InputError: the folder cannot be written.
        """
        folder = Path(self.folder).resolve()
        client, experiment_id = self._opened(folder)
        texts = _texts(tags, LONGEST_TAG)
        if sweep is not None:
            texts |= {"mlflow.parentRunId": self._parent(client, experiment_id, folder, sweep)}
        run = client.create_run(experiment_id, run_name=run_name, tags=texts)
        status = "FAILED"
        try:
            _log_parameters(client, run.info.run_id, _texts(parameters, LONGEST_PARAMETER))
            _log_metrics(client, run.info.run_id, metrics, histories)
            for path in artifacts:
                client.log_artifact(run.info.run_id, str(path))
            status = "FINISHED"
        finally:
            client.set_terminated(run.info.run_id, status)

    def log_sweep(self, sweep: Path, metrics: Mapping[str, float], artifacts: Sequence[Path]) -> None:
        """Log what was made of all jobs of a sweep to the sweep's own run.

        Args:
            sweep: Its folder.
            metrics: Final numbers by name.
            artifacts: Files to copy; they replace those of the same name.

        Raises:
            InputError: the folder cannot be written.
        """
        folder = Path(self.folder).resolve()
        client, experiment_id = self._opened(folder)
        run_id = self._parent(client, experiment_id, folder, sweep)
        _log_metrics(client, run_id, metrics, {})
        for path in artifacts:
            client.log_artifact(run_id, str(path))

    def _parent(self, client: "MlflowClient", experiment_id: str, folder: Path, sweep: Path) -> str:
        """The id of a sweep's own run; parallel jobs get the same."""
        note = sweep / PARENT
        with _locked(folder):
            if note.is_file() and _exists(client, run_id := note.read_text(encoding="utf-8").strip()):
                return run_id
            run = client.create_run(experiment_id, run_name=f"{sweep.parent.name}/{sweep.name}")
            client.set_terminated(run.info.run_id)
            note.write_text(run.info.run_id, encoding="utf-8")
            return run.info.run_id

    def _opened(self, folder: Path) -> tuple["MlflowClient", str]:
        """A client of the database and the experiment's id, both created where they do not exist."""
        client_type = _quiet_client_type()
        with _locked(folder):
            client = client_type(tracking_uri=f"sqlite:///{folder / 'mlflow.db'}")
            experiment = client.get_experiment_by_name(self.experiment)
            if experiment is not None:
                return client, experiment.experiment_id
            place = (folder / "mlartifacts").as_uri()
            return client, client.create_experiment(self.experiment, artifact_location=place)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock: processes that create one database at once break its migrations."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".mlflow.lock").open("w")
    except OSError as error:
        raise InputError(
            f"tracking.folder {folder}: {error.strerror}; choose another with tracking.folder=FOLDER or tracking=none"
        ) from error
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # released when the file is closed
        yield


def _quiet_client_type() -> type["MlflowClient"]:
    """MLflow's client, with its chatter, telemetry and look at git switched off."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_LOGGING_LEVEL", "WARNING")
    os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
    logging.getLogger("alembic").setLevel(logging.WARNING)
    from mlflow import MlflowClient  # takes seconds

    return MlflowClient


def _exists(client: "MlflowClient", run_id: str) -> bool:
    from mlflow.exceptions import MlflowException

    try:
        client.get_run(run_id)
    except MlflowException:
        return False
    return True


def _log_parameters(client: "MlflowClient", run_id: str, parameters: Mapping[str, str]) -> None:
    from mlflow.entities import Param

    rows = [Param(name, value) for name, value in parameters.items()]
    for first in range(0, len(rows), PARAMETERS_IN_BATCH):
        client.log_batch(run_id, params=rows[first : first + PARAMETERS_IN_BATCH])


def _log_metrics(
    client: "MlflowClient", run_id: str, metrics: Mapping[str, float], histories: Mapping[str, np.ndarray]
) -> None:
    from mlflow.entities import Metric

    now = int(1000 * time.time())  # [ms]
    rows = [
        Metric(valid_name(name), float(value), now, int(step))
        for name, history in histories.items()
        for step, value in history
    ]
    last_step = max((row.step for row in rows), default=0)
    rows += [Metric(valid_name(name), float(value), now, last_step) for name, value in metrics.items()]
    for first in range(0, len(rows), METRICS_IN_BATCH):
        client.log_batch(run_id, metrics=rows[first : first + METRICS_IN_BATCH])


def valid_name(name: str) -> str:
    """`name` as MLflow takes it: letters, digits and "_-. /" only, and no path that climbs."""
    allowed = re.sub(r"[^\w\-. /]", "_", name)
    return "/".join(part for part in allowed.split("/") if part.strip("."))[:LONGEST_NAME] or "_"


def _texts(values: Mapping[str, object], longest: int) -> dict[str, str]:
    return {valid_name(name): str(value)[:longest] for name, value in values.items()}
