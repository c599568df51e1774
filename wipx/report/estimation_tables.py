"""The paper's Tables I and II from finished experiments: Markdown and LaTeX, beside the printed figures.

The paper prints "MSE (rad)". A mean squared error has the unit rad^2, and 0.023 rad^2 would be an error of 0.15 rad, as
large as the pitches themselves; its figures are therefore compared with the root mean squared error in rad.
"""

from collections.abc import Sequence

import numpy as np

from wipx.core.estimation import EstimationResult
from wipx.report.numbers import MISSING, significant
from wipx.report.tables import latex, markdown

# Paper, Table I: mean Sim, mean Real; Table II: length -> (Sim, Real), last the inference time [s]
PRINTED_METHODS = {
    "pure_sim": (0.012, 0.033),
    "ours_wo_opt": (0.011, 0.030),
    "sim_param_opt": (0.089, 0.096),
    "sim_param_dr": (0.008, 0.111),
    "ours": (0.024, 0.023),
}
PRINTED_ESTIMATORS = {
    "lstm": {20: (0.038, 0.036), 40: (0.031, 0.042), 60: (0.012, 0.030), 80: (0.024, 0.023)},
    "transformer": {20: (0.064, 0.060), 40: (0.064, 0.060), 60: (0.063, 0.060), 80: (0.028, 0.024)},
    "gru": {20: (0.010, 0.037), 40: (0.008, 0.036), 60: (0.010, 0.032), 80: (0.020, 0.030)},
    "tcn": {20: (0.068, 0.065), 40: (0.087, 0.065), 60: (0.020, 0.023), 80: (0.038, 0.027)},
    "cnn1d": {20: (0.009, 0.040), 40: (0.005, 0.033), 60: (0.005, 0.033), 80: (0.005, 0.035)},
}
PRINTED_LATENCY = {"lstm": 0.035, "transformer": 0.003, "gru": 0.02, "tcn": 0.003, "cnn1d": 0.006}

METHODS_HEAD = (
    "method",
    "seeds",
    "Sim RMSE [rad]",
    "Real RMSE [rad]",
    "difference [rad]",
    "Sim MSE [rad^2]",
    "Real MSE [rad^2]",
    "Real coverage of 90 %",
    "paper: Sim, Real",
)
ESTIMATORS_HEAD = (
    "estimator",
    "samples",
    "Sim RMSE [rad]",
    "Real RMSE [rad]",
    "Real MSE [rad^2]",
    "Real coverage of 90 %",
    "one estimate [ms]",
    "training [s]",
    "paper: Sim, Real",
    "paper: inference [ms]",
)


def methods_rows(results: Sequence[EstimationResult]) -> list[tuple[str, ...]]:
    """Cells of Table I under `METHODS_HEAD`: mean +- standard deviation over seeds."""
    rows = []
    for name in dict.fromkeys(result.method for result in results):
        own = [result for result in results if result.method == name]
        sim, real = [r.simulated.rmse for r in own], [r.recorded.rmse for r in own]
        rows.append(
            (
                name,
                str(len(own)),
                _mean_deviation(sim),
                _mean_deviation(real),
                significant(abs(float(np.mean(real)) - float(np.mean(sim)))),
                significant(float(np.mean([r.simulated.mse for r in own]))),
                significant(float(np.mean([r.recorded.mse for r in own]))),
                _per_cent([r.recorded.coverage for r in own]),
                _pair(PRINTED_METHODS.get(name)),
            )
        )
    return rows


def estimators_rows(results: Sequence[EstimationResult]) -> list[tuple[str, ...]]:
    """Cells of Table II under `ESTIMATORS_HEAD`: medians over seeds."""
    rows = []
    for name in dict.fromkeys(result.estimator for result in results):
        for length in sorted({result.length for result in results if result.estimator == name}):
            own = [result for result in results if (result.estimator, result.length) == (name, length)]
            printed = PRINTED_LATENCY.get(name)
            rows.append(
                (
                    name,
                    str(length),
                    _median([r.simulated.rmse for r in own]),
                    _median([r.recorded.rmse for r in own]),
                    _median([r.recorded.mse for r in own]),
                    _per_cent([r.recorded.coverage for r in own]),
                    _median([1e3 * r.latency for r in own]),
                    _median([r.seconds for r in own]),
                    _pair(PRINTED_ESTIMATORS.get(name, {}).get(length)),
                    MISSING if printed is None else significant(1e3 * printed, 2),
                )
            )
    return rows


def methods_table(results: Sequence[EstimationResult]) -> tuple[str, str]:
    """Table I as Markdown and as LaTeX."""
    rows, numbers = methods_rows(results), tuple(range(4, 8))
    return markdown(METHODS_HEAD, rows, numbers), latex(METHODS_HEAD, rows, numbers)


def estimators_table(results: Sequence[EstimationResult]) -> tuple[str, str]:
    """Table II as Markdown and as LaTeX."""
    rows, numbers = estimators_rows(results), tuple(range(1, 8))
    return markdown(ESTIMATORS_HEAD, rows, numbers), latex(ESTIMATORS_HEAD, rows, numbers)


def _mean_deviation(values: Sequence[float]) -> str:
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
    return f"{significant(float(np.mean(values)))} +- {significant(deviation, 2)}"


def _median(values: Sequence[float]) -> str:
    return significant(float(np.median(values)))


def _per_cent(shares: Sequence[float]) -> str:
    return f"{100.0 * float(np.mean(shares)):.0f} %"


def _pair(printed: tuple[float, float] | None) -> str:
    return MISSING if printed is None else f"{printed[0]:.3f}, {printed[1]:.3f}"
