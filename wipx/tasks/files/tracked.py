"""What a task hands to MLflow: noted beside its results first, logged when they are complete."""

import hashlib
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.results import FitErrors
from wipx.effects.catalogue import effect_of
from wipx.recordings.source import RecordingSource
from wipx.tasks.files.results import flat
from wipx.tasks.shared.job import Job
from wipx.tracking.run_note import RUN, DataNote, RunNote, write_run_note


def note_run(
    job: Job,
    folder: Path,
    name: str,
    *,
    metrics: Mapping[str, float],
    tags: Mapping[str, str],
    histories: Mapping[str, np.ndarray] | None = None,
    data: Sequence[DataNote] = (),
    models: Mapping[str, str] | None = None,
) -> None:
    """Note what MLflow shows of a run, in its folder of unfinished results; all files that are there belong to it.

    Args:
        job: The run.
        folder: Of its results.
        name: Of a single run in the list of runs; a job of a sweep has the name of what was swept.
        metrics: Final numbers by name, with their units.
        tags: Texts by name.
        histories: Course of numbers by name, arrays of shape (n, 2): step, value. A metric of the same name stays
            the last value.
        data: What the run has read.
        models: Estimators in the folder, as of `RunNote.models`.
    """
    files = sorted(path.name for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    note = RunNote(
        name=name if job.sweep is None else _swept(job),
        experiment=str(job.settings["name"]),
        started=job.started,
        ended=time.time(),
        in_sweep=job.sweep is not None,
        parameters={**job.chosen, **flat(job.settings)},
        metrics=metrics,
        histories={key: rows.tolist() for key, rows in (histories or {}).items()},
        artifacts=[name for name in files if name != RUN],
        tags=tags,
        data=list(data),
        models=models or {},
    )
    write_run_note(folder, note)


def in_unit(name: str, unit: str) -> str:
    """The name of a metric with its unit, in the characters that MLflow takes: "x in rad per s"."""
    plain = unit.replace("/", " per ").replace("^", "")
    return f"{name} in {plain}" if plain else name


def error_metrics(errors: Mapping[str, FitErrors | None], plant: Plant) -> dict[str, float]:
    """Prediction errors as metrics, with their units.

    Args:
        errors: By the name of the recordings that they are of.
        plant: Whose signals are predicted.
    """
    return {
        in_unit(f"{part}/{model}/{column}", plant.unit_of(column)): value
        for part, found in errors.items()
        if found is not None
        for model in ("nominal", "completed", "noise_floor")
        for column, value in getattr(found, model).items()
    }


def parameter_metrics(values: Mapping[str, float], plant: Plant) -> dict[str, float]:
    """Numbers of a model as metrics, with their units.

    Args:
        values: By name, "site/kind.symbol" or a parameter of the plant [SI].
        plant: Whose they are.
    """
    return {in_unit(f"parameter/{name}", _unit(name, plant)): value for name, value in values.items()}


def recorded_data(source: RecordingSource, recordings: Iterable[Recording], context: str) -> DataNote:
    """What a run has read of a source of recordings.

    Args:
        source: The source.
        recordings: What was read of it.
        context: What it was used for.
    """
    digest = hashlib.sha256()
    for recording in recordings:
        digest.update(recording.name.encode())
        for column in recording.columns.values():
            digest.update(column.tobytes())
    return DataNote(robot_name(source), source.place, digest.hexdigest()[:12], context)


def training_data(card: Mapping[str, Any]) -> DataNote:
    """The training set of simulated robots that a run has learned from, by its card."""
    name = f"{card['method']} robots, seed {card['seed']}"
    return DataNote(name, str(card["name"]), str(card["digest"]), "training")


def robot_name(source: RecordingSource) -> str:
    """The title of recordings, or their folder with the one that it is in: many folders are called "recordings"."""
    if source.title or not isinstance(source.path, str):
        return source.name
    return "/".join(Path(source.path).resolve().parts[-2:])


def _swept(job: Job) -> str:
    """What distinguishes a job from the others of its sweep: its label, or its overrides where it has a number only."""
    if not job.out.name.isdigit():
        return job.out.name
    return " ".join(override for override in job.overrides if not override.startswith(("task=", "+experiment=")))


def _unit(name: str, plant: Plant) -> str:
    if name in plant.parameters:
        return plant.parameters[name].unit
    effect, _, symbol = name.rpartition(".")
    angular = plant.is_angular(effect.partition("/")[0])
    return next(p.unit(angular=angular) for p in effect_of(effect, plant).parameters if p.name == symbol)


def log_run(job: Job) -> None:
    """Log the finished run in the job's folder; a run that was logged before is not logged again."""
    job.part("tracking").log(job.out)
