"""Logging of finished runs to MLflow."""

import logging
import os
import re
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from wipx.core.errors import InputError
from wipx.core.locked import locked
from wipx.tracking.inputs_and_models import log_inputs, log_models
from wipx.tracking.reach import SQLITE, check_reachable
from wipx.tracking.run_note import RUN, LogNote, RunNote, read_log_note, read_run_note, write_log_note
from wipx.tracking.views import PARENT

if TYPE_CHECKING:
    from mlflow import MlflowClient

# What the MLflow REST interface takes.
LONGEST_NAME = 250  # characters of a key
LONGEST_PARAMETER = 6000  # characters of a parameter's value
LONGEST_TAG = 5000  # characters of a tag's value
METRICS_IN_BATCH = 1000
PARAMETERS_IN_BATCH = 100
KEY = "wipx_key"  # tag by which a run is found again
LOCK = ".logging.lock"
RUNS_FIRST = {"mlflow.experimentKind": "custom_model_development"}  # MLflow opens such an experiment on its runs


@dataclass(frozen=True)
class NoTracking:
    """Logs nothing."""

    def check(self) -> None:
        """Do nothing; as `MlflowTracking.check`."""

    def log(self, out: Path) -> None:
        """Do nothing; as `MlflowTracking.log`."""

    def send(self, out: Path) -> bool:
        """Refuse, since there is no place to log to.

        Raises:
            InputError: always.
        """
        raise InputError(f"{out}: tracking=none logs nothing; choose tracking=mlflow")

    def log_sweep(self, sweep: Path, metrics: Mapping[str, float], artifacts: Sequence[Path]) -> None:
        """Do nothing; the arguments are those of `MlflowTracking.log_sweep`."""


@dataclass(frozen=True)
class MlflowTracking:
    """Logs to a local database or to a server.

    Attributes:
        folder: Holds mlflow.db and mlartifacts/, the database and the files, where no `uri` is given.
        uri: Address of a tracking server or database, as MLflow takes it; None for the database in `folder`.
        later: Whether runs are kept in their folders only, until task=log_runs logs them.
    """

    folder: str = "runs"
    uri: str | None = None
    later: bool = False

    @property
    def store(self) -> str:
        """The address of the tracking store."""
        return self.uri or f"{SQLITE}{Path(self.folder).resolve() / 'mlflow.db'}"

    def check(self) -> None:
        """Refuse a store that cannot take runs, before there are any; see `check_reachable`."""
        if not self.later:
            check_reachable(self.store)

    def log(self, out: Path) -> None:
        """Log the run in a folder; where that is not possible the run stays as it is, and one line tells why.

        Args:
            out: Folder of a finished run, with the `RunNote` of it.
        """
        if self.later:
            return
        try:
            self.send(out)
        except InputError as error:
            print(f"{out}: not logged; log it later with task=log_runs task.folder='{out}': {error}", file=sys.stderr)

    def send(self, out: Path) -> bool:
        """Log the run in a folder, if it was not logged to this store before; returns whether it was not.

        A logging that was interrupted goes on: the run is found by its key, and what it has is written again.

        Raises:
            InputError: the folder has no note of a run, or the store does not take it.
        """
        note = read_run_note(out)
        if self.store in read_log_note(out, note.key).runs:
            return False
        with self._opened() as client, locked(out / LOCK):
            experiment = self._experiment(client, note.experiment)
            logged = read_log_note(out, note.key)
            if self.store in logged.runs:
                return False
            tags = {**note.tags, KEY: note.key}
            if note.in_sweep:
                tags[PARENT] = self._parent(client, experiment, out.parent)
            run_id = _found(client, experiment, note.key) or _created(client, experiment, note, tags)
            _log_parameters(client, run_id, _texts(note.parameters, LONGEST_PARAMETER))
            _log_metrics(client, run_id, note)
            for name in note.artifacts:
                client.log_artifact(run_id, str(out / name))
            log_inputs(client, run_id, note.data)
            log_models(client, run_id, out, note.models)
            client.set_terminated(run_id, "FINISHED", end_time=_ms(note.ended))
            if note.in_sweep:
                client.set_terminated(tags[PARENT], "FINISHED", end_time=_ms(note.ended))
            write_log_note(out, logged.with_run(self.store, run_id))
        return True

    def log_sweep(self, sweep: Path, metrics: Mapping[str, float], artifacts: Sequence[Path]) -> None:
        """Log what was made of all jobs of a sweep to the sweep's own run; one line tells where that is not possible.

        Args:
            sweep: Its folder.
            metrics: Final numbers by name.
            artifacts: Files to copy; they replace those of the same name.
        """
        if self.later:
            return
        try:
            with self._opened() as client:
                run_id = self._parent(client, self._experiment(client, _experiment_of(sweep)), sweep)
                for name, value in metrics.items():
                    client.log_metric(run_id, valid_name(name), value)
                for path in artifacts:
                    client.log_artifact(run_id, str(path))
        except InputError as error:
            print(f"{sweep}: table and pictures are not logged; run this command again: {error}", file=sys.stderr)

    def _parent(self, client: "MlflowClient", experiment: str, sweep: Path) -> str:
        """The id of a sweep's own run, which the first job to be logged makes."""
        run_id = read_log_note(sweep, None).runs.get(self.store)
        if run_id is not None and _exists(client, run_id):
            return run_id
        with locked(sweep / LOCK):
            note: LogNote = read_log_note(sweep, None)
            run_id = _found(client, experiment, note.key)
            if run_id is None:
                begun, tags = _ms(_begun(sweep)), {KEY: note.key}
                run_id = client.create_run(
                    experiment, start_time=begun, run_name=f"all of {sweep.name}", tags=tags
                ).info.run_id
            write_log_note(sweep, note.with_run(self.store, run_id))
            return run_id

    @contextmanager
    def _opened(self) -> Iterator["MlflowClient"]:
        """A client of the store; what goes wrong with it is an `InputError`."""
        check_reachable(self.store)
        client_type = quiet_client_type()
        from mlflow.exceptions import MlflowException
        from sqlalchemy.exc import SQLAlchemyError

        try:
            yield _client(client_type, self.store, Path(self.folder))
        except (MlflowException, SQLAlchemyError, OSError) as error:
            reason = " ".join(str(error).split())[:300]
            raise InputError(f"tracking store {self.store}: {reason}") from error

    def _experiment(self, client: "MlflowClient", name: str) -> str:
        """The id of an experiment; it is made where it does not exist."""
        found = client.get_experiment_by_name(name)
        if found is not None:
            return found.experiment_id
        folder = Path(self.folder)
        with locked(folder / LOCK):
            found = client.get_experiment_by_name(name)
            if found is not None:
                return found.experiment_id
            place = None if self.uri is not None else (folder.resolve() / "mlartifacts").as_uri()
            return client.create_experiment(name, artifact_location=place, tags=RUNS_FIRST)


def _begun(sweep: Path) -> float:
    """Start of the first of a sweep's finished jobs [s since the epoch]."""
    return min((read_run_note(path.parent).started for path in sweep.glob(f"*/{RUN}")), default=time.time())


def _experiment_of(sweep: Path) -> str:
    """The experiment of a sweep's jobs; that of the folder's name where none has finished."""
    return next((read_run_note(path.parent).experiment for path in sweep.glob(f"*/{RUN}")), sweep.name)


_CLIENTS: dict[str, "MlflowClient"] = {}


def _client(client_type: type["MlflowClient"], store: str, folder: Path) -> "MlflowClient":
    """A client of a store; processes that create one database at once would break its migrations, so one does."""
    path = Path(store.removeprefix(SQLITE))
    if store in _CLIENTS and (not store.startswith(SQLITE) or path.is_file()):
        return _CLIENTS[store]
    with locked((path.parent if store.startswith(SQLITE) else folder) / LOCK):
        client = _CLIENTS[store] = client_type(tracking_uri=store)
        client.search_experiments(max_results=1)  # opens the database
    return client


@cache
def quiet_client_type() -> type["MlflowClient"]:
    """MLflow's client, with its chatter, telemetry and look at git switched off, and little patience with servers."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_LOGGING_LEVEL", "WARNING")
    os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "2")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "30")  # [s]
    logging.getLogger("alembic").setLevel(logging.WARNING)
    from mlflow import MlflowClient  # takes seconds

    return MlflowClient


def _found(client: "MlflowClient", experiment: str, key: str) -> str | None:
    """The id of the run with a key; None where there is none."""
    runs = client.search_runs([experiment], filter_string=f"tags.{KEY} = '{key}'", max_results=1)
    return runs[0].info.run_id if runs else None


def _created(client: "MlflowClient", experiment: str, note: RunNote, tags: Mapping[str, str]) -> str:
    run = client.create_run(
        experiment, start_time=_ms(note.started), run_name=note.name, tags=_texts(tags, LONGEST_TAG)
    )
    return run.info.run_id


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


def _log_metrics(client: "MlflowClient", run_id: str, note: RunNote) -> None:
    """Log final numbers and histories, all at the end of the run, so that a second time adds nothing."""
    from mlflow.entities import Metric

    now = _ms(note.ended)
    rows = [
        Metric(valid_name(name), _number(value), now, int(step or 0))
        for name, history in note.histories.items()
        for step, value in history
    ]
    last_step = max((row.step for row in rows), default=0)
    rows += [Metric(valid_name(name), _number(value), now, last_step) for name, value in note.metrics.items()]
    for first in range(0, len(rows), METRICS_IN_BATCH):
        client.log_batch(run_id, metrics=rows[first : first + METRICS_IN_BATCH])


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _ms(seconds: float) -> int:
    return int(1000 * seconds)


def valid_name(name: str) -> str:
    """`name` as MLflow takes it: letters, digits and "_-. /" only, and no path that climbs."""
    allowed = re.sub(r"[^\w\-. /]", "_", name)
    return "/".join(part for part in allowed.split("/") if part.strip("."))[:LONGEST_NAME] or "_"


def _texts(values: Mapping[str, object], longest: int) -> dict[str, str]:
    return {valid_name(name): str(value)[:longest] for name, value in values.items()}
