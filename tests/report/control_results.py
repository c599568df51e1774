"""Results of made-up experiments with a controller, of known errors."""

from collections.abc import Sequence

import numpy as np

from wipx.core.control_result import ControlResult, ControlTrial, Course
from wipx.core.load import Load

PITCHES = {"a1": -0.03, "b5": -0.16}
LOADS = {"a1": Load(0.8, 0.45, -0.08), "b5": Load(1.6, 0.45, -0.25)}


def trial(
    load: str, number: int, error: float, *, stopped: float | None = None, estimate: float | None = None
) -> ControlTrial:
    """A robot that stands `error` metres away, and a tenth of it in radians beside its balance."""
    t = np.arange(251) * 0.04
    pitch = PITCHES[load]
    still = np.zeros(len(t))
    course = Course(t, still + error, still + pitch + 0.1 * error, still, still, still + pitch)
    failure = None if stopped is None else "rail end"
    recovery = None if stopped is not None else 2.0
    aim = abs(pitch + 0.1 * error - (estimate or 0.0))
    return ControlTrial(load, number, pitch, estimate, failure, stopped, error, 0.1 * error, aim, recovery, course)


def result(
    controller: str,
    errors: Sequence[float] = (1.0, 1.2),
    *,
    scenario: str = "balancing",
    method: str = "ours",
    seed: int = 0,
    heavy_stops: bool = False,
    off: float | None = None,
) -> ControlResult:
    """One trial for each error with each load; `off` is how far estimates are off."""
    trials = tuple(
        trial(
            load,
            k + 1,
            error,
            stopped=3.0 if heavy_stops and load == "b5" else None,
            estimate=None if off is None else PITCHES[load] + off,
        )
        for load in PITCHES
        for k, error in enumerate(errors)
    )
    return ControlResult(
        controller=controller,
        method=method,
        estimator="" if off is None else "cnn1d",
        scenario=scenario,
        target="emulated",
        seed=seed,
        gap=1e-3,
        begin=0.0,
        duration=10.0,
        rail=2.2,
        wheel_radius=0.0625,
        loads=LOADS,
        trials=trials,
    )
