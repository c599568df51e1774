"""Files of an adaptation: result.json and the table of its trajectories."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.adaptation import AdaptationResult, ClassTrajectory, GapLoss
from wipx.core.errors import InputError
from wipx.core.results import SearchHistory
from wipx.tasks.files.finished import read_result
from wipx.tasks.files.results import write_csv

TRAJECTORIES = "trajectories.csv"


def write_trajectories(result: AdaptationResult, folder: Path) -> None:
    """Write the mean trajectories of every load, recorded and simulated, as CSV."""
    columns = {"t": result.classes[0].t}
    for c in result.classes:
        for j, column in enumerate(result.coordinates):
            columns[f"{c.name}.{column}.recorded"] = c.recorded[:, j]
            columns[f"{c.name}.{column}.simulated"] = c.simulated[:, j]
    write_csv(folder / TRAJECTORIES, columns)


def plain_adaptation(result: AdaptationResult) -> dict[str, object]:
    """What result.json holds; the trajectories are in a table of their own."""
    plain = asdict(result)
    plain["classes"] = [{"name": c.name, "equilibrium": c.equilibrium, "held_out": c.held_out} for c in result.classes]
    return plain


def read_adaptation(folder: Path) -> AdaptationResult:
    """The result of a finished job.

    Raises:
        InputError: there is none, or its files do not fit together.
    """
    plain = read_result(folder)["result"]
    path = folder / TRAJECTORIES
    try:
        table = np.genfromtxt(path, delimiter=",", names=True, deletechars="", replace_space=" ")
        coordinates = tuple(plain["coordinates"])

        def stacked(name: str, kind: str) -> np.ndarray:
            return np.column_stack([table[f"{name}.{column}.{kind}"] for column in coordinates])

        return AdaptationResult(
            method=plain["method"],
            optimizer=plain["optimizer"],
            engine=plain["engine"],
            seed=plain["seed"],
            target=plain["target"],
            fit=GapLoss(**_numbers(plain["fit"])),
            held_out=None if plain["held_out"] is None else GapLoss(**_numbers(plain["held_out"])),
            parameters=plain["parameters"],
            intervals={name: (low, high) for name, (low, high) in plain["intervals"].items()},
            history=_history(plain["history"]),
            coordinates=coordinates,
            classes=tuple(
                ClassTrajectory(
                    c["name"],
                    c["equilibrium"],
                    c["held_out"],
                    table["t"],
                    stacked(c["name"], "recorded"),
                    stacked(c["name"], "simulated"),
                )
                for c in plain["classes"]
            ),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{folder}: not the result of task=adapt ({error}); remove the folder and run it again"
        ) from error


def _numbers(plain: Mapping[str, float | None]) -> dict[str, float]:
    return {key: float("nan") if value is None else value for key, value in plain.items()}


def _history(plain: Mapping[str, Any] | None) -> SearchHistory | None:
    if plain is None:
        return None
    course = [np.array(plain[key], dtype=float) for key in ("evaluations", "seconds", "best_loss")]
    return SearchHistory(plain["optimizer"], course[0].astype(int), course[1], course[2], plain["stopped"])
