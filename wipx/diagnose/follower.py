"""Innovations: recorded minus what a model, kept close by the observer, shows one row ahead."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnose.log import Log
from wipx.diagnose.observer import Gains, Linearisation, NoiseLevels, linearise_along, observer_gains
from wipx.identify.prediction import true_state
from wipx.sim.analytic import AnalyticSimulator, Observer

GUESS_SPAN = 0.05  # [s] of rows from which the first rates are read
DELAY_GRID = 1e-3  # [s] to which a sensor's delay is known to the observer
LARGEST = 1e3  # standard deviations; a model that falls over is counted so far


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

    def innovations(self, batch: ModelBatch, gains: tuple[Gains, ...], group: np.ndarray) -> np.ndarray:
        """Innovations in standard deviations of the observer, shape (P, K + 1, R, m).

        Args:
            batch: P models.
            gains: Of one or more observers.
            group: Which of them each model has, shape (P,).
        """
        log = self.log
        start = true_state(batch, np.repeat(self._first_rows[:, None], batch.size, axis=1))
        observer = Observer(log.measured, np.stack([g.gains for g in gains]), group)
        shown = self.simulator.follow(batch, log.inputs, start, observer)
        predicted = np.concatenate([shown.coordinates, shown.rates], axis=1)[:, log.channels]
        errors = np.moveaxis(log.measured[:, log.channels, None, :] - predicted, (2, 0, 3, 1), (0, 1, 2, 3))
        out = np.empty_like(errors, order="C")
        for g, one in enumerate(gains):
            chosen = group == g
            out[chosen] = np.einsum("krcd,pkrd->pkrc", one.whitening, errors[chosen])
        np.fmin(out, LARGEST, out=out)  # also where it is not a number
        np.fmax(out, -LARGEST, out=out)
        return out

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

