"""States along recordings, smoothed with disturbances: where a prediction starts.

No model is exact. What it lacks acts as an acceleration of each joint that wanders at random, and an extended Kalman
filter estimates that acceleration beside coordinates and rates. A fixed-lag pass adds what the rows up to
`LOOK_AHEAD` later tell (Anderson, Moore 1979, Optimal Filtering, ch. 7; Bryson, Frazier 1963 for the backward
recursion). The state follows the nonlinear model; gains are those of the body linearised along the recording.

The bandwidth of the filter [rad/s] says how freely the acceleration wanders: the rate q [rad/s^2 per sqrt(s)]
of a random walk and sensor noise of spectral density r [rad sqrt(s)] give a filter of the bandwidth (q/r)^(1/3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.identify.kalman import FIRST_SPAN, Filter, Places, gains_along
from wipx.identify.linearisation import Linearisation, linearise_along
from wipx.identify.noise import LastingNoise
from wipx.identify.sensors import delays_of, scales_of, true_states
from wipx.identify.unlogged_commands import inputs_along, jolts
from wipx.identify.windows import LOOK_AHEAD
from wipx.sim.analytic import AnalyticSimulator, Observer
from wipx.sim.cache import cached
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts

BANDWIDTHS = (1.0, 3.0, 10.0, 30.0, 100.0)  # [rad/s] from nearly no disturbance to nearly no model
MOST_KNOWN = 8  # bodies that are kept; each holds as much as a recording for every joint
RUN_AWAY = 1e12  # [m, rad, m/s, rad/s] where a model that diverges is stopped, so that its squares stay finite
FEWEST_ROWS = 4  # from which the first rates are read, at least


class Followed(NamedTuple):
    """What P models that a filter keeps close to recordings tell.

    Attributes:
        states: At W places, shape (P, W, 2 joints), see `Smoother.along`.
        carried: What joints carry from step to step at K rows, as filtered, shape (N, STATES, P, K); None if not asked.
    """

    states: np.ndarray
    carried: np.ndarray | None


@dataclass(frozen=True)
class Smoother:
    """Estimates states along recordings.

    Attributes:
        simulator: The engine.
        plant: Of the recordings.
        recordings: R of them.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
    """

    simulator: AnalyticSimulator
    plant: Plant
    recordings: tuple[Recording, ...]
    noise: np.ndarray
    _bodies: dict[tuple[float, ...], tuple[Linearisation, np.ndarray]] = field(
        default_factory=dict, compare=False, repr=False
    )

    def along(self, model: Model, bandwidth: np.ndarray) -> np.ndarray:
        """States of a model at every row, shape (K + 1, 2 joints, R); zero after the last one.

        Each is estimated from the rows up to `LOOK_AHEAD` later. Coordinates are those of the instant, with bias and
        scale of their sensors and without their delay; rates have that scale too.

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
        """
        rows, joints, recordings = self._measured.shape
        row, recording = np.nonzero(np.arange(rows)[:, None] <= self._inputs.last)
        every = self.places(row, recording, row)
        found = np.zeros((rows, recordings, 2 * joints))
        found[row, recording] = self.following(ModelBatch(model), [self.filtered(model, bandwidth)], every).states[0]
        return found.transpose(0, 2, 1)

    def places(self, rows: np.ndarray, recordings: np.ndarray, starts: np.ndarray) -> Places:
        """Rows (W,) of recordings (W,); the state at each is estimated from those up to `LOOK_AHEAD` after its start.

        Args:
            rows: Where states are wanted.
            recordings: Whose rows.
            starts: Row of the start that each leads to.
        """
        until = np.zeros_like(starts)
        for r, last in enumerate(self._inputs.last):
            here, t = recordings == r, self._inputs.t[: last + 1, r]
            until[here] = np.searchsorted(t, t[starts[here]] + LOOK_AHEAD + 1e-6, side="right") - 1
        return Places(np.ascontiguousarray(rows), np.ascontiguousarray(recordings), until)

    def following(
        self,
        batch: ModelBatch,
        filters: Sequence[Filter],
        places: Places,
        kept: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> Followed:
        """States of P models, as `along` has them, at W places.

        Args:
            batch: The models.
            filters: That keep them close to the recordings: one for each, or one for all.
            places: Where states are wanted.
            kept: Rows (K,) of recordings (K,) at which to tell what joints carry from step to step; None for none.
        """
        late, scale = delays_of(batch), scales_of(batch)  # (joints, P)
        group = np.arange(batch.size) if len(filters) > 1 else np.zeros(batch.size, dtype=np.int64)
        shown = self._followed(batch, filters, group, kept)
        prior, surprises = self._compared(shown, scale)
        if np.any(late):
            joints = surprises.shape[2]
            prior[:, :, :joints] += self._moved_within(late, prior[:, :, joints:])
        if len(filters) == 1:
            found = filters[0].smoothed(places, prior, surprises)
        else:
            own = [np.ascontiguousarray(x) for x in (prior, surprises)]
            parts = [f.smoothed(places, *(x[..., [p]] for x in own)) for p, f in enumerate(filters)]
            found = np.concatenate(parts, axis=2)
        return Followed((found * np.tile(scale, (2, 1))).transpose(2, 0, 1), shown.carried)

    def _moved_within(self, late: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """How far each joint has moved up to every row since a time before it, shape (K + 1, R, joints, P).

        Args:
            late: That time, shape (joints, P) [s].
            rates: At the rows, linear between them, shape (K + 1, R, joints, P).
        """
        found = np.zeros_like(rates)
        for r, j in product(range(rates.shape[1]), np.flatnonzero(late.any(axis=1))):
            t, rate = self._inputs.t[:, r], rates[:, r, j]
            steps = np.maximum(np.diff(t), 1e-12)[:, None]
            way = np.concatenate(
                [np.zeros((1, rate.shape[1])), np.cumsum(0.5 * steps * (rate[1:] + rate[:-1]), axis=0)]
            )
            before = t[:, None] - late[j]
            k = np.clip(np.searchsorted(t, before, side="right") - 1, 0, len(t) - 2)
            past, change = before - t[k], np.take_along_axis(np.diff(rate, axis=0) / steps, k, 0)
            then = np.take_along_axis(way, k, 0) + past * np.take_along_axis(rate, k, 0)
            found[:, r, j] = way - (then + 0.5 * past * np.maximum(past, 0.0) * change)
        return found

    def disturbance(self, model: Model, bandwidth: np.ndarray) -> np.ndarray:
        """Acceleration that a model lacks at every row, by the rows up to it, shape (K + 1, joints, R).

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
        """
        each = self.filtered(model, bandwidth)
        shown = self._followed(ModelBatch(model), [each], np.zeros(1, dtype=np.int64))
        joints = self._measured.shape[1]
        surprises = self._compared(shown, scales_of(ModelBatch(model)))[1][..., 0]
        return np.cumsum(np.einsum("krij,krj->kir", each.along.gains[:, :, 2 * joints :], surprises), axis=0)

    def _compared(self, shown: Rollouts, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """States before their correction, and by how much each row surprises, of sensors with a scale (joints, P).

        Returns:
            prior: Shape (K + 1, R, 2 joints, P).
            surprises: Shape (K + 1, R, joints, P).
        """
        rows, joints, models, recordings = shown.coordinates.shape
        prior = np.empty((rows, recordings, 2 * joints, models))
        surprises = np.empty((rows, recordings, joints, models))
        _compare(shown.coordinates, shown.rates, self._measured, scale, prior, surprises)
        return prior, surprises

    def _followed(
        self,
        batch: ModelBatch,
        filters: Sequence[Filter],
        group: np.ndarray,
        kept: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> Rollouts:
        """What P models, each kept close by one of the filters, show at every row before they are corrected there."""
        gains = filters[0].corrections[None] if len(filters) == 1 else np.stack([f.corrections for f in filters])
        observer = Observer(self._measured, gains, group, kept=kept)
        return self.simulator.follow(batch, self._inputs, self._first_states(batch), observer)

    def drawn(self, noise: LastingNoise, count: int) -> np.ndarray:
        """Courses of a sensor noise that lasts along the recordings, shape (K + 1, R, joints, count)."""
        return noise.drawn(self._inputs.t, count)

    def filtered(self, model: Model, bandwidth: np.ndarray) -> Filter:
        """The filter of a model, of bandwidths (joints,) [rad/s]."""
        return self.filters(model, [bandwidth])[0]

    def filters(self, model: Model, bandwidths: Sequence[np.ndarray]) -> list[Filter]:
        """Filters of a model.

        Args:
            model: The model.
            bandwidths: Of each joint in each filter, shape (joints,) [rad/s].
        """
        inputs, one = self._inputs, ModelBatch(model)
        scale, late = scales_of(one)[:, 0], delays_of(one)[:, 0]
        sensor = self.noise / np.abs(scale)
        rates = [(np.asarray(bandwidth) ** 3 * sensor) ** 2 * self._interval for bandwidth in bandwidths]
        gains = gains_along(*self._body(model), inputs.t, inputs.last, sensor, rates, late)
        return [Filter(along, scale, late) for along in gains]

    def _body(self, model: Model) -> tuple[Linearisation, np.ndarray]:
        """A model's body along the recordings, and by how much commands that are not logged move it within each row."""
        key = tuple(model.parameters.values())
        known = self._bodies.get(key)
        if known is None:
            linear = linearise_along(model, self._inputs, self._measured)
            known = linear, jolts(model, self.recordings, self._inputs, self._measured)
            if len(self._bodies) >= MOST_KNOWN:
                self._bodies.clear()
            self._bodies[key] = known
        return known

    @cached_property
    def _inputs(self) -> Inputs:
        return inputs_along(self.recordings, self.plant)

    @cached_property
    def _measured(self) -> np.ndarray:
        """Recorded coordinates, shape (K + 1, joints, R); the last ones in the padding."""
        found = np.zeros((len(self._inputs.t), len(self.plant.coordinates), len(self.recordings)))
        for r, recording in enumerate(self.recordings):
            values = recording.stack(self.plant.coordinates)
            found[: len(values), :, r] = values
            found[len(values) :, :, r] = values[-1]
        return found

    @cached_property
    def _interval(self) -> float:
        """Typical time between rows [s]."""
        return float(np.median(np.concatenate([np.diff(r.t) for r in self.recordings])))

    def _first_states(self, batch: ModelBatch) -> np.ndarray:
        """True states at the first rows, by parabolas through what the sensors show, shape (2 joints, P, R)."""
        late = delays_of(batch)[..., None]  # (joints, P, 1)
        place, rate, half = self._first_courses[:, :, None]
        return true_states(batch, np.concatenate([place + late * (rate + late * half), rate + 2.0 * late * half]))

    @cached_property
    def _first_courses(self) -> np.ndarray:
        """Coefficients of the parabolas through the first rows, rising, shape (3, joints, R)."""
        found = np.zeros((3, len(self.plant.coordinates), len(self.recordings)))
        for r, recording in enumerate(self.recordings):
            t = recording.t - recording.t[0]
            count = min(max(FEWEST_ROWS, int(np.searchsorted(t, FIRST_SPAN))), len(t))
            for j, name in enumerate(self.plant.coordinates):
                course = np.polynomial.Polynomial.fit(t[:count], recording[name][:count], min(2, count - 1)).convert()
                found[: len(course.coef), j, r] = course.coef
        return found


@cached
def _compare(coordinates, rates, measured, scale, prior, surprises):
    """Write what `Smoother._compared` tells, in finite numbers: at most `RUN_AWAY` where a model diverges.

    What P models show has the shape (K + 1, joints, P, R), what is measured (K + 1, joints, R).
    """
    rows, joints, models, recordings = coordinates.shape
    for k in range(rows):
        for r in range(recordings):
            for j in range(joints):
                seen = measured[k, j, r]
                for p in range(models):
                    place, rate = coordinates[k, j, p, r], rates[k, j, p, r]
                    place = min(max(place, -RUN_AWAY), RUN_AWAY) if place == place else 0.0
                    rate = min(max(rate, -RUN_AWAY), RUN_AWAY) if rate == rate else 0.0
                    prior[k, r, j, p] = place / scale[j, p]
                    prior[k, r, joints + j, p] = rate
                    surprises[k, r, j, p] = (seen - place) / scale[j, p]
