"""What a completed model leaves over, as a force: how large it is, how long it lasts, and what it goes with.

The filter that estimates states estimates beside them an acceleration that the model lacks (`wipx.identify.smoothing`).
With the body's mass matrix that is a force on each joint. Whether it goes with a signal, comes again with every turn
or every period, or follows the command with a gain that drifts, is tried by least squares on every other stretch of
time, and judged on those between.
"""

from collections.abc import Iterator

import numpy as np

from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.remainder import HorizonErrors, LeftForce
from wipx.core.results import HORIZON, Trace
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.identify.linearisation import linearise_along
from wipx.identify.smoothing import Smoother
from wipx.sim.analytic import AnalyticSimulator

HORIZONS = (0.1, 0.2, HORIZON)  # [s] after a start
WITHIN = 0.05  # [s] up to a horizon, whose rows count
BANDWIDTH = 30.0  # [rad/s] of the filter; forces that change faster than in 30 ms do not show
STRETCH = 1.0  # [s] of the stretches that are fitted and judged in turn
KNOTS = 9  # of a law over a signal, and of a gain over time
WAVES = np.arange(1, 61)  # that are tried, in multiples of one over the whole way or time


def horizon_errors(traces: tuple[Trace, ...]) -> tuple[HorizonErrors, ...]:
    """Errors of predictions by the time since their start."""
    found = []
    for horizon in HORIZONS:
        errors = {"nominal": {}, "completed": {}}
        for model, by_column in errors.items():
            for name in traces[0].recorded:
                values = [getattr(trace, model)[name] - trace.recorded[name] for trace in traces]
                at = [_since_start(trace) for trace in traces]
                near = np.concatenate(at)
                chosen = np.concatenate(values)[(near > horizon - WITHIN) & (near <= horizon)]
                chosen = chosen[np.isfinite(chosen)]
                by_column[name] = float(np.sqrt(np.mean(chosen**2))) if len(chosen) else float("nan")
        found.append(HorizonErrors(horizon, errors["nominal"], errors["completed"]))
    return tuple(found)


def _since_start(trace: Trace) -> np.ndarray:
    """Time of every row since the last start of a prediction [s]; not a number before the first."""
    last = np.searchsorted(trace.starts, trace.t + 1e-6, side="right") - 1
    return np.where(last >= 0, trace.t - trace.starts[np.maximum(last, 0)], np.nan)


def left_forces(
    simulator: AnalyticSimulator, data: RecordingBatch, noise: np.ndarray, model: Model, telling: float
) -> tuple[LeftForce, ...]:
    """The force that a model lacks on each joint.

    Args:
        simulator: The engine.
        data: The recordings.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        model: The completed model.
        telling: Share of a force's variance that what it goes with must explain.
    """
    plant = data.plant
    smoother = Smoother(simulator, plant, data.recordings, noise)
    bandwidth = np.full(data.joints, BANDWIDTH)
    states = smoother.along(model, bandwidth)
    missing = smoother.disturbance(model, bandwidth)
    linear = linearise_along(model, data.inputs, data.measured[:, : data.joints])
    forces = np.einsum("krij,kjr->kir", np.linalg.inv(linear.b)[linear.place], missing)
    found = []
    for j, site in enumerate(plant.joints):
        force = np.where(data.counted, forces[:, j], 0.0)
        kind, signal, period, share = _what(plant, data, states, force, j, telling)
        size = float(np.sqrt(np.mean(force[data.counted] ** 2)))
        unit = "N m" if plant.is_angular(site) else "N"
        found.append(LeftForce(site, size, unit, _lasting(force, data), kind, signal, period, share))
    return tuple(found)


def _what(
    plant: Plant, data: RecordingBatch, states: np.ndarray, force: np.ndarray, joint: int, telling: float
) -> tuple[str, str | None, float | None, float]:
    """What a force goes with best: kind, signal, period of the signal, and share of its variance; or "random"."""
    best: tuple[str, str | None, float | None, float] = ("random", None, None, 0.0)
    for kind, signal, period, columns in _families(plant, data, states, joint):
        share = _share(columns, force, data)
        if share > max(best[3], telling):
            best = (kind, signal, period, share)
    return best


def _families(
    plant: Plant, data: RecordingBatch, states: np.ndarray, joint: int
) -> Iterator[tuple[str, str | None, float | None, np.ndarray]]:
    """Forces of unit size at every row, family by family: kind, signal, period, and columns (C, K + 1, R)."""
    time = data.inputs.t - data.inputs.t[0]
    names = (*plant.coordinates, *plant.rates)
    for name, values in zip(names, np.moveaxis(states, 1, 0), strict=True):
        yield "law", name, None, _hats(values, data.rows)
    commands = np.concatenate([data.inputs.commands, data.inputs.commands[-1:]])
    for name, values in zip(plant.commands, np.moveaxis(commands, 1, 0), strict=True):
        yield "law", name, None, _hats(values, data.rows)
        yield "gain", name, None, _hats(time, data.rows) * values
    for name, values in ((plant.coordinates[joint], states[:, joint]), ("t", time)):
        way = max(float(np.ptp(values[data.rows])), 1e-9)
        for wave in WAVES[3:]:
            angle = 2.0 * np.pi * wave / way * values
            columns = np.stack([np.cos(angle), np.sin(angle)])
            yield "periodic" if name != "t" else "swing", name, way / wave, columns


def _hats(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Triangular functions of a signal (K + 1, R) about knots at its quantiles, shape (KNOTS or fewer, K + 1, R)."""
    knots = np.unique(np.quantile(values[rows], np.linspace(0.01, 0.99, KNOTS)))
    return np.stack([np.interp(values, knots, row) for row in np.eye(len(knots))])


def _share(columns: np.ndarray, force: np.ndarray, data: RecordingBatch) -> float:
    """Share of a force's variance that a family explains on stretches of time that it was not fitted to."""
    number = np.floor((data.inputs.t - data.inputs.t[0]) / STRETCH).astype(np.int64)
    left = total = 0.0
    for parity in (0, 1):
        seen, unseen = (data.counted & (number % 2 == side) for side in (parity, 1 - parity))
        if not seen.any() or not unseen.any():
            return 0.0
        weights = np.linalg.lstsq(columns[:, seen].T, force[seen], rcond=1e-6)[0]
        left += float(np.sum((force[unseen] - weights @ columns[:, unseen]) ** 2))
        total += float(np.sum(force[unseen] ** 2))
    return max(0.0, 1.0 - left / total) if total > 0.0 else 0.0


def _lasting(force: np.ndarray, data: RecordingBatch) -> float:
    """Time in which the correlation of a force with itself falls to 1/e [s]."""
    interval = float(np.median(data.intervals[data.intervals > 0.0]))
    variance = float(np.sum(force**2))
    for lag in range(1, len(force) - 1):
        if float(np.sum(force[lag:] * force[:-lag])) <= variance / np.e:
            return lag * interval
    return len(force) * interval
