"""What is logged of a run, noted in its folder before it is logged: nothing is lost where MLflow cannot be reached."""

import json
import uuid
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.whole_file import write_whole

RUN = "run.json"  # the note, beside the results
LOGGED = ".mlflow.json"  # where it was logged


@dataclass(frozen=True)
class DataNote:
    """A data set that a run has read.

    Attributes:
        name: Shown beside the run.
        source: Its file or folder.
        digest: Short name of its content.
        context: What it was used for.
    """

    name: str
    source: str
    digest: str
    context: str


@dataclass(frozen=True)
class RunNote:
    """What MLflow shows of a run.

    Attributes:
        name: Shown in the list of runs.
        experiment: Under which it is listed.
        started: Time at which the run began [s since the epoch].
        ended: Time at which its results were complete [s since the epoch].
        in_sweep: Whether it is a job of a sweep, whose folder is the parent of the run's.
        parameters: Settings by name.
        metrics: Final numbers by name; None for one that does not exist.
        histories: Course of numbers by name, rows of (step, value).
        artifacts: Names of files in the run's folder.
        tags: Texts by name.
        data: What it has read.
        models: Names of files in the run's folder that hold estimators as ONNX graphs, by the name under which MLflow
            registers them.
        key: Of this run alone; MLflow has it as a tag, so that no run is logged twice.
    """

    name: str
    experiment: str
    started: float
    ended: float
    in_sweep: bool
    parameters: Mapping[str, object]
    metrics: Mapping[str, float | None]
    histories: Mapping[str, list[list[float | None]]] = field(default_factory=dict)
    artifacts: list[str] = field(default_factory=list)
    tags: Mapping[str, str] = field(default_factory=dict)
    data: list[DataNote] = field(default_factory=list)
    models: Mapping[str, str] = field(default_factory=dict)
    key: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class LogNote:
    """Where a run, or a sweep as a whole, was logged.

    Attributes:
        key: Of what was logged.
        runs: Ids of MLflow's runs, by the address of the tracking store.
    """

    key: str
    runs: Mapping[str, str] = field(default_factory=dict)

    def with_run(self, uri: str, run_id: str) -> "LogNote":
        """The note with one more place."""
        return LogNote(self.key, {**self.runs, uri: run_id})


def write_run_note(folder: Path, note: RunNote) -> None:
    """Write the note of a run."""
    write_whole(folder / RUN, json.dumps({"schema": 1, **_plain(asdict(note))}, indent=2, default=str))


def read_run_note(folder: Path) -> RunNote:
    """The note of a run.

    Raises:
        InputError: it is missing or damaged.
    """
    path = folder / RUN
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        del content["schema"]
        return RunNote(**{**content, "data": [DataNote(**data) for data in content["data"]]})
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; nothing was noted of this run, run it again") from error
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path}: no note of a run ({error}); remove the folder and run it again") from error


def read_log_note(folder: Path, key: str | None) -> LogNote:
    """Where a folder was logged.

    Args:
        folder: Of a run or of a sweep.
        key: Of the run that is in the folder; None for a sweep, whose key is drawn here and kept.
    """
    path = folder / LOGGED
    if path.is_file():
        note = LogNote(**json.loads(path.read_text(encoding="utf-8")))
        if key in (None, note.key):
            return note
    note = LogNote(key or uuid.uuid4().hex)
    write_log_note(folder, note)
    return note


def write_log_note(folder: Path, note: LogNote) -> None:
    """Note where a folder was logged."""
    write_whole(folder / LOGGED, json.dumps({"key": note.key, "runs": dict(note.runs)}))


def _plain(value: Any) -> Any:
    """Containers as JSON has them; a number that does not exist is None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.integer) else value
