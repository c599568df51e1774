"""What a task hands to MLflow: noted beside its results first, logged when they are complete."""

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wipx.tasks.files.results import flat
from wipx.tasks.shared.job import Job
from wipx.tracking.run_note import RUN, RunNote, write_run_note


def note_run(
    job: Job,
    folder: Path,
    name: str,
    *,
    metrics: Mapping[str, float],
    tags: Mapping[str, str],
    histories: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Note what MLflow shows of a run, in its folder of unfinished results; all files that are there belong to it.

    Args:
        job: The run.
        folder: Of its results.
        name: Shown in the list of runs.
        metrics: Final numbers by name.
        tags: Texts by name.
        histories: Course of numbers by name, arrays of shape (n, 2): step, value. A metric of the same name stays
            the last value.
    """
    files = sorted(path.name for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    note = RunNote(
        name=name,
        started=job.started,
        ended=time.time(),
        in_sweep=job.sweep is not None,
        parameters=flat(job.settings),
        metrics=metrics,
        histories={key: rows.tolist() for key, rows in (histories or {}).items()},
        artifacts=[name for name in files if name != RUN],
        tags=tags,
    )
    write_run_note(folder, note)


def log_run(job: Job) -> None:
    """Log the finished run in the job's folder; a run that was logged before is not logged again."""
    job.part("tracking").log(job.out)
