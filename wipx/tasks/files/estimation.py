"""File of an experiment with an estimator: result.json."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.estimation import EstimationResult, Judged
from wipx.tasks.files.finished import read_result


def plain_estimation(result: EstimationResult) -> dict[str, object]:
    """What result.json holds."""
    return asdict(result)


def read_estimation(folder: Path) -> EstimationResult:
    """The result of a finished job.

    Raises:
        InputError: there is none, or it is that of another task.
    """
    plain = dict(read_result(folder)["result"])
    try:
        simulated, recorded = (_judged(plain.pop(key)) for key in ("simulated", "recorded"))
        return EstimationResult(simulated=simulated, recorded=recorded, **plain)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{folder}: no result of task=train ({error}); remove it, run the job again") from error


def _judged(plain: Mapping[str, Any]) -> Judged:
    return Judged(*(np.array(plain[key], dtype=float) for key in ("pitch", "estimate", "low", "high")))
