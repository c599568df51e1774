"""The next experiment that a diagnosis proposes, as a trial, and the command that records it.

It is read from the folder of a diagnosis (diagnosis.json, next_experiment.csv), or from a table of a reference alone.
"""

import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.core.plant import Plant
from wipx.hardware.target import Reference, Trial
from wipx.recordings.source import RecordingSource
from wipx.recordings.tables import check_increasing, open_table
from wipx.tasks.shared.record_note import read_note

ANSWER, REFERENCE = "diagnosis.json", "next_experiment.csv"
RELEASE_DURATION = 10.0  # [s] of an experiment without a reference
ROBOT_GROUPS = ("target", "controller", "plant")  # what a command line says of the robot and of what drives it


@dataclass(frozen=True)
class ProposedExperiment:
    """What a robot is to do.

    Attributes:
        trial: It; named after the excitation.
        repeats: How often.
        diagnosed: Folder of the recordings that were diagnosed; None for a table alone.
    """

    trial: Trial
    repeats: int
    diagnosed: str | None


def read_experiment(path: Path, plant: Plant) -> ProposedExperiment:
    """The experiment in a folder of task=diagnose, or in a table with t and references such as x_ref and x_dot_ref.

    Args:
        path: The folder or the table.
        plant: Of the robot that is to do it.

    Raises:
        InputError: there is none, or the robot cannot do it under its controller.
    """
    if path.is_dir():
        return _of_diagnosis(path, plant)
    if not path.is_file():
        raise InputError(f"task.experiment {path} does not exist; give the folder of a diagnosis, or a CSV file")
    duration, reference = _reference(path, plant)
    return ProposedExperiment(Trial(path.stem, duration, reference=reference), 1, None)


def record_command(diagnosis: Diagnosis, source: RecordingSource, out: Path) -> str | None:
    """The command that records what a diagnosis proposes.

    Args:
        diagnosis: The answer.
        source: The recordings that were diagnosed.
        out: Folder of its results.

    Returns:
        None where nothing is proposed, or no target can do it: the plant cannot be driven, no controller ran, a weight
        must be added or a cart moved by hand.
    """
    following, plant = diagnosis.next_experiment, diagnosis.nominal.plant
    if following is None or following.mass or plant.tree is not None:
        return None
    if following.release:
        doable = plant.coordinates[-1] == "theta"
    else:
        doable = any(name.endswith("_ref") for name in following.reference)
    robot = _recorded_with(source) or (("target=hardware",) if plant.kind == "wip" else ())
    if not doable or not robot:
        return None
    return shlex.join(["python", "-m", "wipx", "task=record", *robot, f"task.experiment={out}"])


def _recorded_with(source: RecordingSource) -> tuple[str, ...]:
    """What the command line said of the robot where the recordings come from task=record; else nothing."""
    folders = source.path if isinstance(source.path, list) else [source.place]
    words = read_note(Path(folders[0]).expanduser())["command"]
    if not words:
        return ()
    robot = [word for word in words if word.lstrip("+").partition("=")[0].split(".")[0].split("@")[-1] in ROBOT_GROUPS]
    return tuple(robot) if any(word.startswith("target=") for word in robot) else ("target=emulated", *robot)


def _of_diagnosis(folder: Path, plant: Plant) -> ProposedExperiment:
    answer = folder / ANSWER
    try:
        content: Any = json.loads(answer.read_text(encoding="utf-8"))
        experiment = content["identifiability"].get("experiment")
        source = str(content["source"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{answer}: no answer of task=diagnose; give the folder that task=diagnose has left"
        ) from error
    if experiment is None:
        raise InputError(
            f"{answer}: the diagnosis proposes no experiment, nothing is open; nothing needs to be recorded"
        )
    if experiment["mass"]:
        raise InputError(
            f"{answer}: the experiment needs a weight of {experiment['mass']:.3g} kg on the body; do it as "
            "identifiability.next_experiment says"
        )
    name, release = experiment["name"].replace(" ", "_"), float(experiment["release"])
    if release:
        if plant.coordinates[-1] != "theta":
            raise InputError(f"{answer}: the robot must be released from {plant.coordinates[-1]} = {release:.3g}")
        trial = Trial(name, RELEASE_DURATION, pitch=release)
    else:
        duration, reference = _reference(folder / REFERENCE, plant)
        trial = Trial(name, duration, reference=reference)
    return ProposedExperiment(trial, int(experiment["repeats"]), source)


def _reference(path: Path, plant: Plant) -> tuple[float, Reference]:
    """Duration [s] and reference of a table, linear between its rows and held after the last."""
    table = open_table(path)
    if "t" not in table.names:
        raise InputError(f"{path}: column t [s] is missing; the table has {', '.join(table.names)}")
    names = [f"{column}_ref" for column in (*plant.coordinates, *plant.rates)]
    if not set(names) & set(table.names):
        raise InputError(
            f"{path}: no reference for a {plant.kind} under its controller, expected {' or '.join(names)}; "
            f"the table has {', '.join(table.names)}"
        )
    t = table.column("t")
    check_increasing(t, table)
    columns = [(i, table.column(name)) for i, name in enumerate(names) if name in table.names]

    def reference(at: float) -> np.ndarray:
        state = np.zeros(len(names))
        for i, values in columns:
            state[i] = np.interp(at, t - t[0], values)
        return state

    return float(t[-1] - t[0]), reference


def named(trial: Trial, name: str) -> Trial:
    """The same trial under another name of its recording."""
    return replace(trial, name=name)
