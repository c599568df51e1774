"""Files of an experiment with a controller: result.json and the table of its courses."""

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.control_result import ControlResult, ControlTrial, Course
from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.tasks.files.finished import read_result
from wipx.tasks.files.results import write_csv

COURSES = "courses.csv"
PER_TRIAL = tuple(item.name for item in fields(Course) if item.name != "t")


def write_courses(result: ControlResult, folder: Path) -> None:
    """Write the motion in every trial as CSV, columns LOAD_NUMBER.SIGNAL."""
    columns = {"t": result.trials[0].course.t}
    for trial in result.trials:
        columns |= {f"{trial.load}_{trial.number}.{name}": getattr(trial.course, name) for name in PER_TRIAL}
    write_csv(folder / COURSES, columns)


def plain_control(result: ControlResult) -> dict[str, object]:
    """What result.json holds; the courses are in a table of their own."""
    plain = {item.name: getattr(result, item.name) for item in fields(result) if item.name not in ("loads", "trials")}
    plain["loads"] = {name: asdict(load) for name, load in result.loads.items()}
    plain["trials"] = [{k: v for k, v in asdict(trial).items() if k != "course"} for trial in result.trials]
    return plain


def read_control(folder: Path) -> ControlResult:
    """The result of a finished job.

    Raises:
        InputError: there is none, or its files do not fit together.
    """
    plain: dict[str, Any] = dict(read_result(folder)["result"])
    try:
        table = np.genfromtxt(folder / COURSES, delimiter=",", names=True, deletechars="", replace_space=" ")
        loads = {name: Load(**place) for name, place in plain.pop("loads").items()}
        trials = tuple(
            ControlTrial(
                **{**trial, "notes": tuple(trial["notes"])},
                course=_course(table, f"{trial['load']}_{trial['number']}"),
            )
            for trial in plain.pop("trials")
        )
        return ControlResult(loads=loads, trials=trials, **plain)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{folder}: not the result of task=control ({error}); remove the folder and run it again"
        ) from error


def _course(table: np.ndarray, trial: str) -> Course:
    return Course(table["t"], **{name: table[f"{trial}.{name}"] for name in PER_TRIAL})
