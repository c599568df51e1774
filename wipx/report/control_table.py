"""Control under unknown loads as tables: ours and the baseline, other controllers, and the effect of the reality gap.

The paper's pitch error is measured from what a controller aims at, zero for its baseline; a baseline that stands still
at the robot's true balance has a large one. Errors here are measured from the robot's true balance, for
all controllers alike; the paper's definition is given in addition.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.control_result import ControlResult, ControlTrial
from wipx.report.numbers import MISSING, significant
from wipx.report.tables import latex, markdown

# Paper, Sec. VI-B: mean improvement of position and pitch over all payloads [%]
PRINTED = {"balancing": (38, 23), "tracking": (77, 60)}
ERRORS = ("rmse_x", "rmse_pitch", "rmse_target")  # of ControlTrial

PAYLOADS_HEAD = (
    "task",
    "balances at [rad]",
    "RMSE x: baseline [m]",
    "ours [m]",
    "better by [%]",
    "RMSE pitch: baseline [rad]",
    "ours [rad]",
    "better by [%]",
    "pitch, paper's error: better by [%]",
    "stopped: baseline, ours",
    "ours recovers in [s]",
    "paper: x, pitch [%]",
)
CONTROLLERS_HEAD = (
    "task",
    "controller",
    "stopped",
    "recovered",
    "recovers in [s]",
    "RMSE x [m]",
    "better by [%]",
    "RMSE pitch [rad]",
    "better by [%]",
    "pitch, paper's error: better by [%]",
)
METHODS_HEAD = (
    "simulation",
    "seeds",
    "reality gap",
    "estimate: RMSE [rad]",
    "task",
    "stopped",
    "recovered",
    "RMSE x [m]",
    "RMSE pitch [rad]",
)


@dataclass(frozen=True)
class Improvement:
    """By how much a controller's errors are smaller than the baseline's.

    Attributes:
        mean: Over the loads, of the ratio of mean errors of a load's trials [%].
        low: Worst of the trials, each beside the baseline's trial with the same draws [%].
        high: Best [%].
    """

    mean: float
    low: float
    high: float

    @classmethod
    def of(cls, baseline: Sequence[np.ndarray], ours: Sequence[np.ndarray]) -> "Improvement":
        """From the errors of all trials, one array for each load, in the same order."""
        per_load = [1.0 - np.mean(b) / np.mean(a) for a, b in zip(baseline, ours, strict=True)]
        per_trial = 1.0 - np.concatenate(ours) / np.concatenate(baseline)
        return cls(*(100.0 * float(v) for v in (np.mean(per_load), per_trial.min(), per_trial.max())))

    def __str__(self) -> str:
        return f"{round(self.mean)} [{round(self.low)}, {round(self.high)}]"


def improvement(baseline: ControlResult, ours: ControlResult, error: str, loads: Sequence[str]) -> Improvement:
    """Of one of the errors of `ControlTrial`, over some loads."""
    return Improvement.of(*([_errors(result.of(load), error) for load in loads] for result in (baseline, ours)))


def payload_rows(baseline: ControlResult, ours: ControlResult) -> list[tuple[str, ...]]:
    """Cells under `PAYLOADS_HEAD`: one row for each load, and one for all of them."""
    return [
        *(_payload_row(baseline, ours, [load]) for load in ours.loads),
        _payload_row(baseline, ours, list(ours.loads)),
    ]


def controller_rows(baseline: ControlResult, results: Sequence[ControlResult]) -> list[tuple[str, ...]]:
    """Cells under `CONTROLLERS_HEAD` of one scenario, over all loads."""
    rows = []
    for result in results:
        better = [str(improvement(baseline, result, error, list(result.loads))) for error in ERRORS]
        if result is baseline:
            better = [MISSING] * len(ERRORS)
        rows.append(
            (
                result.scenario,
                result.controller,
                *_outcome(result.trials),
                _recovery(result.trials),
                significant(_mean(result.trials, "rmse_x")),
                better[0],
                significant(_mean(result.trials, "rmse_pitch")),
                better[1],
                better[2],
            )
        )
    return rows


def method_rows(results: Sequence[ControlResult]) -> list[tuple[str, ...]]:
    """Cells under `METHODS_HEAD`: from reality gap to estimate to control; mean +- deviation over seeds."""
    rows = []
    for method in dict.fromkeys(result.method for result in results):
        for scenario in dict.fromkeys(result.scenario for result in results):
            own = [r for r in results if (r.method, r.scenario) == (method, scenario)]
            trials = [trial for result in own for trial in result.trials]
            rows.append(
                (
                    method,
                    str(len(own)),
                    _spread([result.gap for result in own]),
                    _spread([estimate_error(result) for result in own]),
                    scenario,
                    *_outcome(trials),
                    _spread([_mean(result.trials, "rmse_x") for result in own]),
                    _spread([_mean(result.trials, "rmse_pitch") for result in own]),
                )
            )
    return rows


def estimate_error(result: ControlResult) -> float:
    """Root mean squared error of the pitches that the controller was given [rad]; NaN if it was given none."""
    errors = [trial.estimate - trial.pitch for trial in result.trials if trial.estimate is not None]
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")


def tables(head: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[str, str]:
    """Rows as Markdown and as LaTeX."""
    numbers = tuple(range(1, len(head)))
    return markdown(head, rows, numbers), latex(head, rows, numbers)


def _payload_row(baseline: ControlResult, ours: ControlResult, loads: list[str]) -> tuple[str, ...]:
    before, after = ([trial for load in loads for trial in result.of(load)] for result in (baseline, ours))
    better = [str(improvement(baseline, ours, error, loads)) for error in ERRORS]
    single = len(loads) == 1
    printed = None if single else PRINTED.get(ours.scenario)
    return (
        ours.scenario,
        f"{after[0].pitch:+.2f}" if single else "all",
        significant(_mean(before, "rmse_x")),
        significant(_mean(after, "rmse_x")),
        better[0],
        significant(_mean(before, "rmse_pitch")),
        significant(_mean(after, "rmse_pitch")),
        better[1],
        better[2],
        f"{_stopped(before)}, {_stopped(after)} of {len(after)}",
        _recovery(after),
        MISSING if printed is None else f"{printed[0]}, {printed[1]}",
    )


def _outcome(trials: Sequence[ControlTrial]) -> tuple[str, str]:
    """How many were stopped, and how many recovered."""
    recovered = sum(trial.recovery is not None for trial in trials)
    return f"{_stopped(trials)} of {len(trials)}", f"{recovered} of {len(trials)}"


def _stopped(trials: Sequence[ControlTrial]) -> int:
    return sum(trial.failure is not None for trial in trials)


def _recovery(trials: Sequence[ControlTrial]) -> str:
    """Median time to recover and its range, of the trials that do."""
    times = [trial.recovery for trial in trials if trial.recovery is not None]
    if not times:
        return MISSING
    return f"{np.median(times):.1f} [{min(times):.1f}, {max(times):.1f}]"


def _errors(trials: Sequence[ControlTrial], error: str) -> np.ndarray:
    return np.array([getattr(trial, error) for trial in trials])


def _mean(trials: Sequence[ControlTrial], error: str) -> float:
    return float(np.mean(_errors(trials, error)))


def _spread(values: Sequence[float]) -> str:
    deviation = f" +- {significant(float(np.std(values, ddof=1)), 2)}" if len(values) > 1 else ""
    return f"{significant(float(np.mean(values)))}{deviation}"
