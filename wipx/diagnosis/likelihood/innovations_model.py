"""Innovations: recorded minus what a model, kept close by the observer, shows one row ahead."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import int64

from wipx.core.law import inlined
from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.likelihood.noise_model import LARGEST
from wipx.diagnosis.likelihood.observer import Gains, NoiseLevels, observer_gains
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.identify.linearisation import Linearisation, linearise_along
from wipx.identify.sensors import true_states
from wipx.identify.unlogged_commands import jolts
from wipx.sim.analytic import AnalyticSimulator, Observer
from wipx.sim.cache import booleans, cached, cached_for, floats, integers
from wipx.sim.simulator import Rollouts

GUESS_SPAN = 0.05  # [s] of rows from which the first rates are read
TAPS = 3  # rows of the modelled force that a report may be made of
ALIKE = 1e-9  # relative, of the normal equations of rows that are nearly alike
DELAY_GRID = 1e-3  # [s] to which a sensor's delay is known to the observer
TOGETHER = 16  # rows of all models that are turned into innovations before the next
MOST_KNOWN = 20  # gains that are kept; each holds as much as some ten recordings


@dataclass(frozen=True)
class InnovationsModel:
    """Follows recordings with any model.

    Attributes:
        simulator: The engine.
        data: The recordings.
        linear: The nominal body along them.
        jolts: Covariance by which it moves unseen within each row, shape (K + 1, R, 2 joints, 2 joints).
    """

    simulator: AnalyticSimulator
    data: RecordingBatch
    linear: Linearisation
    jolts: np.ndarray
    _known: dict[tuple[bytes, tuple[float, ...]], Gains] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(cls, simulator: AnalyticSimulator, data: RecordingBatch, nominal: Model) -> "InnovationsModel":
        """An observer of recordings whose gains are those of the nominal body."""
        coordinates = data.measured[:, : data.joints]
        moved = jolts(nominal, data.recordings, data.inputs, coordinates)
        return cls(simulator, data, linearise_along(nominal, data.inputs, coordinates), moved)

    def gains(self, levels: NoiseLevels, model: Model) -> Gains:
        """Gains for noise levels and for the sensor delays of a model."""
        return self.gains_of((levels,), model)[0]

    def gains_of(self, levels: Sequence[NoiseLevels], model: Model) -> tuple[Gains, ...]:
        """Gains for each of several noise levels, all that are not known yet at once."""
        taus = [model.effects.get(f"sensor_{name}/delay", {}).get("tau", 0.0) for name in model.plant.coordinates]
        delays = tuple(round(tau / DELAY_GRID) * DELAY_GRID for tau in taus)
        keys = [(np.concatenate([level.force, level.sensor]).tobytes(), delays) for level in levels]
        known = {key: self._known.get(key) for key in keys}
        missing = {key: level for key, level in zip(keys, levels, strict=True) if known[key] is None}
        if missing:
            found = observer_gains(self.linear, self.jolts, self.data, list(missing.values()), delays)
            fresh = dict(zip(missing, found, strict=True))
            if len(self._known) > MOST_KNOWN:
                self._known.clear()
            self._known.update(fresh)  # other threads may have cleared it meanwhile
            known |= fresh
        return tuple(gains for gains in (known[key] for key in keys) if gains is not None)

    def innovations(self, batch: ModelBatch, gains: tuple[Gains, ...], group: np.ndarray) -> np.ndarray:
        """Innovations in standard deviations of the observer, then errors of reported forces, shape (P, R, m, K + 1).

        Args:
            batch: P models.
            gains: Of one or more observers.
            group: Which of them each model has, shape (P,).
        """
        data = self.data
        shown = self._shown(batch, gains, group)
        whitening = gains[0].whitening[None] if len(gains) == 1 else np.stack([g.whitening for g in gains])
        found = np.zeros((batch.size, len(data.recordings), data.signals, len(data.rows)))
        _innovations(
            data.measured, shown.coordinates, shown.rates, data.channels, whitening, group, data.inputs.last, found
        )
        if shown.delivered is not None:
            motion = len(data.channels)
            _report_errors(data.reported, shown.delivered, data.counted, data.inputs.last, motion, found)
            for r, k in self._untold:
                found[:, r, motion:, k : k + TAPS] = 0.0
        return found

    def estimated(self, model: Model, gains: Gains) -> np.ndarray:
        """Coordinates and rates that a model expects before it sees each row, shape (K + 1, 2 joints, R)."""
        shown = self._shown(ModelBatch(model), (gains,), np.zeros(1, dtype=np.int64))
        return np.concatenate([shown.coordinates, shown.rates], axis=1)[:, :, 0]

    def _shown(self, batch: ModelBatch, gains: tuple[Gains, ...], group: np.ndarray) -> Rollouts:
        start = true_states(batch, np.repeat(self._first_rows[:, None], batch.size, axis=1))
        corrections = gains[0].gains[None] if len(gains) == 1 else np.stack([g.gains for g in gains])
        return self.simulator.follow(
            batch,
            self.data.inputs,
            start,
            Observer(
                self.data.measured[:, : self.data.seen],
                corrections,
                group,
                reports=self.data.reported.shape[1] > 0,
            ),
        )

    @cached_property
    def _untold(self) -> list[tuple[int, int]]:
        """Recording and first row after each gap: what the drives report there answers to commands of the gap."""
        gaps = [(r, np.flatnonzero(recording.missing)) for r, recording in enumerate(self.data.recordings)]
        return [(r, int(k) + 1) for r, rows in gaps for k in rows]

    @cached_property
    def _first_rows(self) -> np.ndarray:
        """Recorded coordinates and mean rates at each recording's start, shape (2 joints, R)."""
        data = self.data
        first = data.measured[0].copy()
        for r in range(first.shape[1]):
            t = data.inputs.t[:, r] - data.inputs.t[0, r]
            count = min(max(4, int(np.searchsorted(t, GUESS_SPAN))), int(data.inputs.last[r]) + 1)
            for j in range(data.joints):
                fit = np.polynomial.polynomial.polyfit(t[:count], data.measured[:count, j, r], min(2, count - 1))
                first[[j, data.joints + j], r] = fit[0], fit[1]
        return first


@cached
def _innovations(measured, coordinates, rates, channels, whitening, group, last, out):
    """White errors of what is shown, some rows of all models at a time: the arrays run along models or along rows."""
    rows, joints, models, recordings = coordinates.shape
    m = len(channels)
    error = np.zeros(m)
    for begin in range(0, rows, TOGETHER):
        for p in range(models):
            g = group[p]
            for r in range(recordings):
                for k in range(begin, min(begin + TOGETHER, last[r] + 1)):
                    for c in range(m):
                        i = channels[c]
                        shown = coordinates[k, i, p, r] if i < joints else rates[k, i - joints, p, r]
                        error[c] = measured[k, i, r] - shown
                    for c in range(m):
                        total = 0.0
                        for d in range(c + 1):
                            total += whitening[g, k, r, c, d] * error[d]
                        # Also where it is not a number: a model that fell over is only counted so far.
                        out[p, r, c, k] = min(max(total, -LARGEST), LARGEST) if total == total else LARGEST


@cached_for(floats(3), floats(4), booleans(2), integers(1), int64, floats(4))
def _report_errors(reported, delivered, counted, last, first, out):
    """Reported forces minus a + sum_i b_i F[k - i] of the modelled force F, by least squares for each model.

    A drive's torque constant and zero are not trusted, nor the instant at which it reads its current, up to TAPS - 1
    rows late: what counts is the course of the force.
    """
    for i in range(reported.shape[1]):
        size = max(np.std(reported[:, i]), 1e-12)
        for p in range(delivered.shape[2]):
            forces = delivered[:, i, p].T.copy()
            weights, finite = _report_weights(reported[:, i], forces, counted, size)
            for r in range(len(forces)):
                errors = out[p, r, first + i]
                errors[TAPS - 1 : last[r]] = reported[TAPS - 1 : last[r], i, r] - weights[0]
                for tap in range(TAPS):
                    errors[TAPS - 1 : last[r]] -= weights[1 + tap] * forces[r, TAPS - 1 - tap : last[r] - tap]
                for k in range(TAPS - 1, last[r]):
                    errors[k] = min(max(10.0 * errors[k] / size, -LARGEST), LARGEST) if finite else LARGEST


@inlined
def _report_weights(reported, forces, counted, size):
    """Zero and weights of one drive's report, and whether the modelled force is finite."""
    normal, right = ALIKE * size * size * np.eye(1 + TAPS), np.zeros(1 + TAPS)
    for r in range(len(forces)):
        begin = max(np.argmax(counted[:, r]), TAPS - 1)  # rows that count follow each other
        end = max(begin, np.argmax(counted[:, r]) + counted[:, r].sum() - 1)  # the last row has no force
        shown = reported[begin:end, r].copy()
        normal[0, 0] += len(shown)
        right[0] += shown.sum()
        for a in range(TAPS):
            force = forces[r, begin - a : end - a]
            normal[0, 1 + a] += force.sum()
            right[1 + a] += force @ shown
            for b in range(a + 1):
                normal[1 + b, 1 + a] += force @ forces[r, begin - b : end - b]
    for a in range(1 + TAPS):
        normal[a, a] *= 1.0 + ALIKE  # forces of neighbouring rows may be all but equal, and huge
        for b in range(a):
            normal[a, b] = normal[b, a]
    if not np.all(np.isfinite(normal)):
        return np.zeros(1 + TAPS), False
    return np.linalg.solve(normal, right), True
