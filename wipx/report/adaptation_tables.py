"""Adaptations beside each other: optimizers on one problem, methods on one robot; as Markdown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.adaptation import AdaptationResult
from wipx.report.numbers import MISSING, significant
from wipx.report.tables import markdown

SUCCESS = 1.01  # ratio to the best loss found by any optimizer, up to which a search has succeeded

OPTIMIZERS_HEAD = (
    "optimizer",
    "success",
    "loss over best, median [range]",
    "evaluations",
    "evaluations to 1 %",
    "seconds",
    "seconds to 1 %",
    "held-out loss over floor",
    "parameter error",
)
METHODS_HEAD = (
    "method",
    "runs",
    "reality gap, fitted loads",
    "reality gap, held-out loads",
    "held-out over noise floor",
    "pure_sim over it",
)


@dataclass(frozen=True)
class OptimizerScore:
    """Results of one optimizer on one problem, over seeds.

    Attributes:
        name: Of the optimizer.
        ratios: Final loss over the best that any optimizer found, by seed.
        evaluations: Spent in all, by seed.
        to_success: Evaluations until the loss was within 1 % of the best, by seed; NaN where it never was.
        seconds: Spent in all, by seed.
        seconds_to_success: As `to_success`, in seconds.
        held_out: Held-out loss over its noise floor, by seed.
        parameter_errors: Median relative error of the numbers against the truth, by seed; NaN where it is unknown.
    """

    name: str
    ratios: np.ndarray
    evaluations: np.ndarray
    to_success: np.ndarray
    seconds: np.ndarray
    seconds_to_success: np.ndarray
    held_out: np.ndarray
    parameter_errors: np.ndarray

    @property
    def successes(self) -> int:
        """Seeds with which it came within 1 % of the best loss."""
        return int(np.sum(self.ratios <= SUCCESS))


def optimizer_scores(runs: Sequence[AdaptationResult], truth: Mapping[str, float] | None) -> list[OptimizerScore]:
    """One score for each optimizer, the most successful first.

    Args:
        runs: Searches of the same problem.
        truth: The robot's true numbers by name [SI]; None if they are not known.
    """
    best = min(run.fit.value for run in runs)
    scores = [
        _score(name, [run for run in runs if run.optimizer == name], best, truth)
        for name in dict.fromkeys(run.optimizer for run in runs)
    ]
    return sorted(scores, key=lambda score: (-score.successes, float(np.median(score.ratios))))


def optimizer_table(scores: Sequence[OptimizerScore]) -> str:
    """The scores as a Markdown table; medians with ranges over seeds."""
    rows = [
        (
            score.name,
            f"{score.successes} of {len(score.ratios)}",
            _median_range(score.ratios),
            _median(score.evaluations),
            _median(score.to_success),
            _median(score.seconds),
            _median(score.seconds_to_success),
            _median(score.held_out),
            _per_cent(score.parameter_errors),
        )
        for score in scores
    ]
    return markdown(OPTIMIZERS_HEAD, rows, numbers=tuple(range(3, 9)))


def method_table(runs: Sequence[AdaptationResult]) -> str:
    """The reality gap of each method as a Markdown table; medians with ranges over seeds and draws."""
    pure = [run.held_out.value for run in runs if run.method == "pure_sim" and run.held_out is not None]
    # The noise floor is best estimated with the best model: a worse one mistakes differences between trials for noise.
    floor = min((run.held_out.floor for run in runs if run.held_out is not None), default=float("nan"))
    rows = []
    for name in dict.fromkeys(run.method for run in runs):
        own = [run for run in runs if run.method == name]
        unseen = [run.held_out for run in own if run.held_out is not None]
        gap = float(np.median([loss.value for loss in unseen])) if unseen else float("nan")
        rows.append(
            (
                name,
                str(len(own)),
                _losses([run.fit for run in own]),
                _losses(unseen),
                significant(gap / floor),
                significant(float(np.median(pure)) / gap) if pure else MISSING,
            )
        )
    return markdown(METHODS_HEAD, rows, numbers=(4, 5))


def _score(
    name: str, runs: Sequence[AdaptationResult], best: float, truth: Mapping[str, float] | None
) -> OptimizerScore:
    reached = [_first_within(run, SUCCESS * best) for run in runs]
    histories = [run.history for run in runs if run.history is not None]
    return OptimizerScore(
        name,
        np.array([run.fit.value / best for run in runs]),
        np.array([history.evaluations[-1] for history in histories], dtype=float),
        np.array([evaluations for evaluations, _ in reached]),
        np.array([history.seconds[-1] for history in histories]),
        np.array([seconds for _, seconds in reached]),
        np.array([run.held_out.value / run.held_out.floor if run.held_out else np.nan for run in runs]),
        np.array([_parameter_error(run.parameters, truth) for run in runs]),
    )


def _first_within(run: AdaptationResult, loss: float) -> tuple[float, float]:
    """Evaluations and seconds until the loss was reached; NaN where it never was."""
    history = run.history
    if history is None or not np.any(history.best_loss <= loss):
        return np.nan, np.nan
    i = int(np.argmax(history.best_loss <= loss))
    return float(history.evaluations[i]), float(history.seconds[i])


def _parameter_error(parameters: Mapping[str, float], truth: Mapping[str, float] | None) -> float:
    """Median relative error."""
    if truth is None:
        return np.nan
    errors = [
        abs(value - truth[name]) / max(abs(truth[name]), 1e-9) for name, value in parameters.items() if name in truth
    ]
    return float(np.median(errors)) if errors else np.nan


def _losses(losses: Sequence) -> str:
    if not losses:
        return MISSING
    middle = float(np.median([loss.value for loss in losses]))
    low, high = min(loss.low for loss in losses), max(loss.high for loss in losses)
    return f"{significant(middle)} [{significant(low)}, {significant(high)}]"


def _median_range(values: np.ndarray) -> str:
    middle, low, high = (significant(v) for v in (float(np.median(values)), float(values.min()), float(values.max())))
    return f"{middle} [{low}, {high}]"


def _median(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return significant(float(np.median(known))) if len(known) else MISSING


def _per_cent(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return f"{significant(100.0 * float(np.median(known)))} %" if len(known) else MISSING
