"""Innovations: recorded minus what a model, kept close by the observer, shows one row ahead."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.log import Log
from wipx.diagnosis.observer import Gains, Linearisation, NoiseLevels, linearise_along, observer_gains
from wipx.diagnosis.whiteness import LARGEST
from wipx.identify.prediction import true_state
from wipx.sim.analytic import AnalyticSimulator, Observer, Rollouts
from wipx.sim.cache import cached

GUESS_SPAN = 0.05  # [s] of rows from which the first rates are read
DELAY_GRID = 1e-3  # [s] to which a sensor's delay is known to the observer


@dataclass(frozen=True)
class Follower:
    """Follows recordings with any model.

    Attributes:
        simulator: The engine.
        log: The recordings.
        linear: The nominal body about the places that they visit.
    """

    simulator: AnalyticSimulator
    log: Log
    linear: Linearisation
    _known: dict[tuple[bytes, tuple[float, ...]], Gains] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(cls, simulator: AnalyticSimulator, log: Log, nominal: Model) -> "Follower":
        """A follower of recordings whose gains are those of the nominal body."""
        return cls(simulator, log, linearise_along(nominal, log))

    def gains(self, levels: NoiseLevels, model: Model) -> Gains:
        """Gains for noise levels and for the sensor delays of a model."""
        columns = model.plant.coordinates
        taus = [model.effects.get(f"sensor_{column}/delay", {}).get("tau", 0.0) for column in columns]
        delays = tuple(round(tau / DELAY_GRID) * DELAY_GRID for tau in taus)
        key = (np.concatenate([levels.force, levels.sensor]).tobytes(), delays)
        if key not in self._known:
            if len(self._known) > 20:
                self._known.clear()
            self._known[key] = observer_gains(self.linear, self.log, levels, delays)
        return self._known[key]

    def innovations(
        self, batch: ModelBatch, gains: tuple[Gains, ...], group: np.ndarray, spread: np.ndarray
    ) -> np.ndarray:
        """Innovations in standard deviations of the observer, then errors of reported forces, shape (P, R, m, K + 1).

        Args:
            batch: P models.
            gains: Of one or more observers.
            group: Which of them each model has, shape (P,).
            spread: Half width of the single commands, shape (P,) [N or N m].
        """
        log = self.log
        shown = self._shown(batch, gains, group, spread)
        whitening = gains[0].whitening[None] if len(gains) == 1 else np.stack([g.whitening for g in gains])
        found = np.zeros((batch.size, len(log.recordings), log.signals, len(log.rows)))
        _innovations(
            log.measured, shown.coordinates, shown.rates, log.channels, whitening, group, log.inputs.last, found
        )
        if shown.delivered is not None:
            _report_errors(log.reported, shown.delivered, log.counted, log.inputs.last, len(log.channels), found)
        return found

    def estimated(self, model: Model, gains: Gains, spread: float) -> np.ndarray:
        """Coordinates and rates that a model expects before it sees each row, shape (K + 1, 2 joints, R)."""
        shown = self._shown(ModelBatch(model), (gains,), np.zeros(1, dtype=np.int64), np.array([spread]))
        return np.concatenate([shown.coordinates, shown.rates], axis=1)[:, :, 0]

    def _shown(self, batch: ModelBatch, gains: tuple[Gains, ...], group: np.ndarray, spread: np.ndarray) -> Rollouts:
        start = true_state(batch, np.repeat(self._first_rows[:, None], batch.size, axis=1))
        corrections = gains[0].gains[None] if len(gains) == 1 else np.stack([g.gains for g in gains])
        return self.simulator.follow(
            batch,
            self.log.inputs,
            start,
            Observer(self.log.measured, corrections, group, spread, reports=self.log.reported.shape[1] > 0),
        )

    @cached_property
    def _first_rows(self) -> np.ndarray:
        """Recorded coordinates and mean rates at each recording's start, shape (2 joints, R)."""
        log = self.log
        first = log.measured[0].copy()
        for r in range(first.shape[1]):
            t = log.inputs.t[:, r] - log.inputs.t[0, r]
            count = min(max(4, int(np.searchsorted(t, GUESS_SPAN))), int(log.inputs.last[r]) + 1)
            for j in range(log.joints):
                fit = np.polynomial.polynomial.polyfit(t[:count], log.measured[:count, j, r], min(2, count - 1))
                first[[j, log.joints + j], r] = fit[0], fit[1]
        return first


@cached
def _innovations(measured, coordinates, rates, channels, whitening, group, last, out):
    _, joints, models, recordings = coordinates.shape
    m = len(channels)
    error = np.zeros(m)
    for p in range(models):
        g = group[p]
        for r in range(recordings):
            for k in range(last[r] + 1):
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


@cached
def _report_errors(reported, delivered, counted, last, first, out):
    """Reported forces minus a + b F[k] + c F[k - 1] of the modelled force F, by least squares for each model.

    A drive's torque constant and zero are not trusted, nor the instant within a row at which it reads its current:
    what counts is the course of the force.
    """
    inputs = reported.shape[1]
    known = np.ones(3)
    for i in range(inputs):
        size = max(np.std(reported[:, i]), 1e-12)
        for p in range(delivered.shape[2]):
            normal, right = 1e-9 * size * size * np.eye(3), np.zeros(3)
            for r in range(delivered.shape[3]):
                for k in range(1, last[r]):
                    if counted[k, r]:
                        known[1], known[2] = delivered[k, i, p, r], delivered[k - 1, i, p, r]
                        for a in range(3):
                            right[a] += known[a] * reported[k, i, r]
                            for b in range(3):
                                normal[a, b] += known[a] * known[b]
            finite = np.all(np.isfinite(normal))
            weights = np.linalg.solve(normal, right) if finite else np.zeros(3)
            for r in range(delivered.shape[3]):
                for k in range(1, last[r]):
                    error = reported[k, i, r] - weights[0]
                    error -= weights[1] * delivered[k, i, p, r] + weights[2] * delivered[k - 1, i, p, r]
                    error *= 10.0 / size
                    out[p, r, first + i, k] = min(max(error, -LARGEST), LARGEST) if finite else LARGEST
