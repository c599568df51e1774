"""States along recordings, smoothed with disturbances: where a prediction starts.

No model is exact. What it lacks acts as an acceleration of each joint that wanders at random, and an extended Kalman
filter estimates that acceleration beside coordinates and rates. A fixed-lag pass adds what the rows up to
`LOOK_AHEAD` later tell (Anderson, Moore 1979, Optimal Filtering, ch. 7; Bryson, Frazier 1963 for the backward
recursion). The state follows the nonlinear model; gains are those of the body linearised along the recording.

How freely the acceleration wanders is told by the bandwidth of the filter [rad/s]: the rate q [rad/s^2 per sqrt(s)]
of a random walk and sensor noise of spectral density r [rad sqrt(s)] give a filter of the bandwidth (q/r)^(1/3).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.identify.linearisation import linearise_along, transition_over
from wipx.identify.windows import LOOK_AHEAD, Windows
from wipx.sim.analytic import AnalyticSimulator, Observer
from wipx.sim.cache import cached
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path, Rollouts

BANDWIDTHS = (1.0, 3.0, 10.0, 30.0, 100.0)  # [rad/s] from nearly no disturbance to nearly no model
FIRST_SPAN = 0.05  # [s] of rows from which the first rates are read
FEWEST_ROWS = 4  # for the same, at least


class Places(NamedTuple):
    """Some rows of recordings.

    Attributes:
        rows: Shape (W,).
        recordings: Whose rows, shape (W,).
    """

    rows: np.ndarray
    recordings: np.ndarray


class Along(NamedTuple):
    """A filter along recordings: what it was linearised at, gains, and covariances after each row.

    Attributes:
        a: Slopes of the accelerations at G places, shape (G, joints, 2 joints).
        place: Of every row, shape (K + 1, R).
        gains: From innovations to coordinates, rates and disturbances, shape (K + 1, R, 3 joints, joints).
        covariance: Of these, after the row, shape (K + 1, R, 3 joints, 3 joints).
        innovation: Inverse covariance of the innovations, shape (K + 1, R, joints, joints).
    """

    a: np.ndarray
    place: np.ndarray
    gains: np.ndarray
    covariance: np.ndarray
    innovation: np.ndarray


@dataclass(frozen=True)
class Filter:
    """The filter of a model, and what it makes of the rows after a place.

    Attributes:
        along: Its gains.
        scale: What the model's sensors show of one unit, shape (joints,).
        places: Where it smooths.
        ahead: Gains from innovations of the next M rows to the state at each place, shape (W, M, 2 joints, joints);
            zero for rows that do not count.
    """

    along: Along
    scale: np.ndarray
    places: Places
    ahead: np.ndarray

    def smoothed(self, prior: np.ndarray, surprises: np.ndarray) -> np.ndarray:
        """States of P models at the places, shape (W, 2 joints, P).

        Args:
            prior: States at every row before they are corrected there, shape (K + 1, R, 2 joints, P).
            surprises: Innovations there, shape (K + 1, R, joints, P).
        """
        found = np.empty((len(self.places.rows), *prior.shape[2:]))
        _smooth(self.along.gains, self.ahead, *self.places, prior, surprises, found)
        return found


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

    def along(self, model: Model, bandwidth: np.ndarray) -> np.ndarray:
        """States of a model at every row, shape (K + 1, 2 joints, R); zero after the last one.

        Each is estimated from the rows up to `LOOK_AHEAD` later. Coordinates are those of the instant, with bias and
        scale of their sensors and without their delay; rates have that scale too.

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
        """
        rows, joints, recordings = self._measured.shape
        every = Places(*np.nonzero(np.arange(rows)[:, None] <= self._inputs.last))
        found = np.zeros((rows, recordings, 2 * joints))
        found[every] = self.following(ModelBatch(model), [self.filtered(model, bandwidth, every)])[0]
        return found.transpose(0, 2, 1)

    def following(self, batch: ModelBatch, filters: Sequence[Filter]) -> np.ndarray:
        """States of P models, as `along` has them, at the W places of their filters, shape (P, W, 2 joints).

        Args:
            batch: The models.
            filters: That keep them close to the recordings: one for each, or one for all.
        """
        late, scale = delays_of(batch), scales_of(batch)  # (joints, P)
        group = np.arange(batch.size) if len(filters) > 1 else np.zeros(batch.size, dtype=np.int64)
        shown = self._followed(batch, filters, group)
        coordinates, rates = (np.nan_to_num(x.transpose(0, 3, 1, 2)) for x in (shown.coordinates, shown.rates))
        coordinates /= scale
        surprises = self._measured.transpose(0, 2, 1)[..., None] / scale - coordinates
        prior = np.concatenate([coordinates + late * rates, rates], axis=2)  # (K + 1, R, 2 joints, P)
        if len(filters) == 1:
            found = filters[0].smoothed(prior, surprises)
        else:
            own = [np.ascontiguousarray(x) for x in (prior, surprises)]
            parts = [f.smoothed(*(x[..., [p]] for x in own)) for p, f in enumerate(filters)]
            found = np.concatenate(parts, axis=2)
        return (found * np.tile(scale, (2, 1))).transpose(2, 0, 1)

    def disturbance(self, model: Model, bandwidth: np.ndarray) -> np.ndarray:
        """Acceleration that a model lacks at every row, by the rows up to it, shape (K + 1, joints, R).

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
        """
        nowhere = Places(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
        each = self.filtered(model, bandwidth, nowhere)
        shown = self._followed(ModelBatch(model), [each], np.zeros(1, dtype=np.int64))
        joints = self._measured.shape[1]
        surprises = np.nan_to_num(self._measured - shown.coordinates[:, :, 0]) / scales_of(ModelBatch(model))
        return np.cumsum(np.einsum("krij,kjr->kir", each.along.gains[:, :, 2 * joints :], surprises), axis=0)

    def _followed(self, batch: ModelBatch, filters: Sequence[Filter], group: np.ndarray) -> Rollouts:
        """What P models, each kept close by one of the filters, show at every row before they are corrected there."""
        inputs, measured = self._inputs, self._measured
        joints, recordings = measured.shape[1:]
        gains = np.stack([each.along.gains / each.scale for each in filters])
        recorded = np.zeros((len(measured), 2 * joints, recordings))
        recorded[:, :joints] = measured
        corrections = np.zeros((*gains.shape[:3], 2 * joints, 2 * joints))
        corrections[..., :joints] = gains[..., : 2 * joints, :]
        drift = np.zeros((*gains.shape[:3], joints, 2 * joints))
        drift[..., :joints] = gains[..., 2 * joints :, :]
        idle = np.zeros((batch.size, len(self.plant.commands)))
        observer = Observer(recorded, corrections, group, idle, drift=drift)
        return self.simulator.follow(batch, inputs, self._first_states(batch), observer)

    def spread(self, model: Model, bandwidth: np.ndarray, rows: np.ndarray, recordings: np.ndarray) -> np.ndarray:
        """Covariance of true states at some rows by sensor noise and disturbance, shape (N, 2 joints, 2 joints).

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
            rows: Shape (N,).
            recordings: Whose rows, shape (N,).
        """
        inputs, joints = self._inputs, len(self.plant.coordinates)
        found = np.zeros((len(rows), 2 * joints, 2 * joints))
        _smoothed_covariance(
            *self._along(model, bandwidth),
            inputs.t,
            inputs.last,
            delays_of(ModelBatch(model))[:, 0],
            rows,
            recordings,
            found,
        )
        return found

    def filtered(self, model: Model, bandwidth: np.ndarray, places: Places) -> Filter:
        """The filter of a model, with what it needs to smooth at some places.

        Args:
            model: The model.
            bandwidth: Of each joint, shape (joints,) [rad/s].
            places: Where states are wanted.
        """
        scale, late = scales_of(ModelBatch(model))[:, 0], delays_of(ModelBatch(model))[:, 0]
        along, inputs, joints = self._along(model, bandwidth), self._inputs, len(late)
        until = np.zeros_like(places.rows)
        for r, last in enumerate(inputs.last):
            here, t = places.recordings == r, inputs.t[: last + 1, r]
            until[here] = np.searchsorted(t, t[places.rows[here]] + LOOK_AHEAD + 1e-6, side="right") - 1
        ahead = np.zeros((len(places.rows), int(np.max(until - places.rows, initial=0)), 2 * joints, joints))
        if len(places.rows):
            moves = _moves(along.a, along.place, inputs.t, inputs.last)
            gains = (along.covariance, along.gains, along.innovation)
            _look_ahead(moves, *gains, late, places.rows, until, places.recordings, ahead)
        return Filter(along, scale, places, ahead)

    def _along(self, model: Model, bandwidth: np.ndarray) -> Along:
        inputs, measured = self._inputs, self._measured
        joints, recordings = measured.shape[1:]
        linear = linearise_along(model, measured)
        sensor = self.noise / np.abs(scales_of(ModelBatch(model))[:, 0])
        n, rows = 3 * joints, len(measured)
        gains = np.zeros((rows, recordings, n, joints))
        covariance = np.zeros((rows, recordings, n, n))
        innovation = np.zeros((rows, recordings, joints, joints))
        rate = (np.asarray(bandwidth) ** 3 * sensor) ** 2 * self._interval
        late = delays_of(ModelBatch(model))[:, 0]
        _filter(linear.a, linear.place, inputs.t, inputs.last, sensor**2, rate, late, gains, covariance, innovation)
        return Along(linear.a, linear.place, gains, covariance, innovation)

    @cached_property
    def _inputs(self) -> Inputs:
        return Inputs.of(
            [r.t for r in self.recordings],
            [r.stack(self.plant.commands) for r in self.recordings],
            [0] * len(self.recordings),
            tuple(r.periods for r in self.recordings),
        )

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
        joints = len(self.plant.coordinates)
        shown = np.zeros((2 * joints, len(self.recordings)))
        for r, recording in enumerate(self.recordings):
            t = recording.t - recording.t[0]
            count = min(max(FEWEST_ROWS, int(np.searchsorted(t, FIRST_SPAN))), len(t))
            for j, name in enumerate(self.plant.coordinates):
                fit = np.polynomial.polynomial.polyfit(t[:count], recording[name][:count], min(2, count - 1))
                shown[j, r], shown[joints + j, r] = fit[0], fit[1]
        found = np.repeat(shown[:, None], batch.size, axis=1)
        found[:joints] -= _of_sensors(batch, "bias", "b")[..., None]
        return found / np.tile(scales_of(batch), (2, 1))[..., None]


@dataclass(frozen=True)
class Starts:
    """Windows, and the states that lead into them.

    Attributes:
        windows: R of them.
        until: Row of each window at which its prediction starts, shape (R,).
        states: As the sensors show them, without their delay, shape (rows, 2 joints, B, R): one for all models, or one
            for each.
        delays: Of the sensors of the models that they were estimated with, shape (joints, B) [s].
    """

    windows: Windows
    until: np.ndarray
    states: np.ndarray
    delays: np.ndarray

    def of(self, index: np.ndarray) -> "Starts":
        """Of some of the B models, or of another one for each window, index (R,)."""
        if index.shape == self.until.shape:
            return replace(self, states=self.states[:, :, index, np.arange(len(index))][:, :, None])
        return replace(self, states=self.states[:, :, index], delays=self.delays[:, index])

    def path(self, batch: ModelBatch) -> Path:
        """The true states of each model that the sensors would show so."""
        joints = len(self.delays)
        states = self.states
        plant = batch.model.plant
        moved = [f"sensor_{name}/{kind}" for name in plant.coordinates for kind in ("bias", "scale", "delay")]
        if any(name in batch.model.effects for name in moved):
            states = np.repeat(states, batch.size, axis=2) if states.shape[2] == 1 else states.copy()
            for j, name in enumerate(plant.coordinates):
                self._shift(states, j, joints, _column(batch, f"sensor_{name}/delay", "tau") - self.delays[j])
                states[:, j] -= _column(batch, f"sensor_{name}/bias", "b")[:, None]
                states[:, [j, joints + j]] /= 1.0 + _column(batch, f"sensor_{name}/scale", "e")[:, None]
        return Path(states, self.until)

    def _shift(self, states: np.ndarray, j: int, joints: int, later: np.ndarray) -> None:
        """Replace the states of joint j by those `later` [s], of each model (P,), at constant acceleration."""
        if not later.any():
            return
        t = np.minimum(self.windows.inputs.t[: len(states)], 1e6)[:, None, :]
        interval = np.maximum(np.diff(t, axis=0), 1e-9)
        acceleration = np.diff(states[:, joints + j], axis=0) / interval
        acceleration = np.concatenate([acceleration[:1], acceleration])
        ahead = later[:, None]
        states[:, j] += ahead * states[:, joints + j] + 0.5 * ahead**2 * acceleration
        states[:, joints + j] += ahead * acceleration


def starts_of(smoother: Smoother, windows: Windows, model: Model, bandwidths: Sequence[np.ndarray]) -> Starts:
    """Where predictions of windows start, by filters of B bandwidths, of each joint [rad/s]."""
    filters = [smoother.filtered(model, bandwidth, leads_of(windows)) for bandwidth in bandwidths]
    return starts_by(smoother, windows, ModelBatch(model, (), np.zeros((len(filters), 0))), filters)


def leads_of(windows: Windows) -> Places:
    """The rows that lead into windows, one after the other, the last one where it starts; window by window."""
    until = np.sum(windows.inputs.t <= windows.starts + 1e-6, axis=0) - 1
    rows = np.minimum(np.arange(until.max() + 1)[:, None], until) + windows.row
    return Places(rows.ravel(), np.broadcast_to(windows.recording, rows.shape).ravel())


def starts_by(smoother: Smoother, windows: Windows, batch: ModelBatch, filters: Sequence[Filter]) -> Starts:
    """Where predictions of windows start, by each of B models, with a filter for each or one for all."""
    until = np.sum(windows.inputs.t <= windows.starts + 1e-6, axis=0) - 1
    found = smoother.following(batch, filters).reshape(batch.size, until.max() + 1, windows.count, -1)
    return Starts(windows, until, np.ascontiguousarray(found.transpose(1, 3, 0, 2)), delays_of(batch))


def delays_of(batch: ModelBatch) -> np.ndarray:
    """Delay of each coordinate's sensor in each of P models, shape (joints, P) [s]."""
    return _of_sensors(batch, "delay", "tau")


def scales_of(batch: ModelBatch) -> np.ndarray:
    """What the sensors of each of P models show of one unit, shape (joints, P)."""
    return 1.0 + _of_sensors(batch, "scale", "e")


def _of_sensors(batch: ModelBatch, kind: str, symbol: str) -> np.ndarray:
    return np.stack([_column(batch, f"sensor_{name}/{kind}", symbol) for name in batch.model.plant.coordinates])


def _column(batch: ModelBatch, effect: str, symbol: str) -> np.ndarray:
    """A number of an effect in every model, shape (P,); zero where the effect is absent."""
    return batch.column(f"{effect}.{symbol}") if effect in batch.model.effects else np.zeros(batch.size)


@cached
def _transition(a, dt, small, out):
    """Transition of coordinates, rates and added accelerations over an interval."""
    joints = a.shape[0]
    transition_over(a, dt, small)
    out[:] = 0.0
    out[: 2 * joints, : 2 * joints] = small
    for j in range(joints):
        out[j, 2 * joints + j] = 0.5 * dt * dt
        out[joints + j, 2 * joints + j] = dt
        out[2 * joints + j, 2 * joints + j] = 1.0


@cached
def _filter(a, place, t, last, sensor, rate, late, gains, covariance, innovation):
    """Gains, covariances after each row, and inverse covariances of the innovations, of every recording."""
    joints = a.shape[1]
    n = 3 * joints
    small, transition = np.zeros((2 * joints, 2 * joints)), np.zeros((n, n))
    for r in range(place.shape[1]):
        p = np.zeros((n, n))
        for j in range(joints):
            p[j, j] = 9.0 * sensor[j]
            p[joints + j, joints + j] = 9.0 * sensor[j] / FIRST_SPAN**2 + 1.0
            p[2 * joints + j, 2 * joints + j] = 100.0
        for k in range(last[r] + 1):
            ph = np.zeros((n, joints))
            for j in range(joints):
                ph[:, j] = p[:, j] - late[j] * p[:, joints + j]
            s = np.zeros((joints, joints))
            for i in range(joints):
                for j in range(joints):
                    s[i, j] = ph[i, j] - late[i] * ph[joints + i, j]
                s[i, i] += sensor[i]
            inverse = np.linalg.inv(s)
            gain = ph @ inverse
            p = p - gain @ ph.T
            p = 0.5 * (p + p.T)
            gains[k, r], covariance[k, r], innovation[k, r] = gain, p, inverse
            if k < last[r]:
                dt = t[k + 1, r] - t[k, r]
                _transition(a[place[k, r]], dt, small, transition)
                p = transition @ p @ transition.T
                for j in range(joints):
                    i, m = joints + j, 2 * joints + j
                    p[j, j] += rate[j] * dt**5 / 20.0
                    p[j, i] += rate[j] * dt**4 / 8.0
                    p[i, j] += rate[j] * dt**4 / 8.0
                    p[j, m] += rate[j] * dt**3 / 6.0
                    p[m, j] += rate[j] * dt**3 / 6.0
                    p[i, i] += rate[j] * dt**3 / 3.0
                    p[i, m] += rate[j] * dt**2 / 2.0
                    p[m, i] += rate[j] * dt**2 / 2.0
                    p[m, m] += rate[j] * dt


@cached
def _last_seen(t, k, r, last):
    """Last row that the state at row k may be estimated from."""
    row = k
    while row < last and t[row + 1, r] <= t[k, r] + LOOK_AHEAD + 1e-6:
        row += 1
    return row


@cached
def _moves(a, place, t, last):
    """Transitions to every row from the one before, shape (K + 1, R, n, n)."""
    n = 3 * a.shape[1]
    small = np.zeros((n - a.shape[1], n - a.shape[1]))
    found = np.zeros((*place.shape, n, n))
    for r in range(place.shape[1]):
        for k in range(last[r]):
            _transition(a[place[k, r]], t[k + 1, r] - t[k, r], small, found[k + 1, r])
    return found


@cached
def _carried(back, move, gain, late, moved, seen):
    """Take a row of gains (n,) from the correction at a row to that at the next; `seen` of it by the sensors there."""
    joints = len(late)
    for p in range(len(back)):
        moved[p] = 0.0
        for m in range(len(back)):
            moved[p] += move[p, m] * back[m]
    for j in range(joints):
        seen[j] = moved[j] - late[j] * moved[joints + j]
    for p in range(len(back)):
        back[p] = moved[p]
        for j in range(joints):
            back[p] -= gain[p, j] * seen[j]


@cached
def _look_ahead(moves, covariance, gains, innovation, late, rows, until, recordings, found):
    """Gains from the innovations of later rows, until some row, to the states at some rows."""
    joints, n = len(late), covariance.shape[3]
    back, moved, seen = np.zeros(n), np.zeros(n), np.zeros(joints)
    for w in range(len(rows)):
        r = recordings[w]
        for q in range(2 * joints):
            back[:] = covariance[rows[w], r, q]
            for i in range(rows[w] + 1, until[w] + 1):
                _carried(back, moves[i, r], gains[i, r], late, moved, seen)
                for m in range(joints):
                    for j in range(joints):
                        found[w, i - rows[w] - 1, q, m] += seen[j] * innovation[i, r, j, m]


@cached
def _smooth(gains, ahead, rows, recordings, prior, surprises, found):
    """States at some rows from those before their correction, and the innovations there and later."""
    joints, models = surprises.shape[2:]
    for w in range(len(rows)):
        k, r = rows[w], recordings[w]
        until = min(ahead.shape[1], len(prior) - 1 - k)
        for i in range(2 * joints):
            for p in range(models):
                found[w, i, p] = prior[k, r, i, p]
            for j in range(joints):
                for p in range(models):
                    found[w, i, p] += gains[k, r, i, j] * surprises[k, r, j, p]
                for m in range(until):
                    for p in range(models):
                        found[w, i, p] += ahead[w, m, i, j] * surprises[k + 1 + m, r, j, p]


@cached
def _smoothed_covariance(a, place, gains, covariance, innovation, t, last, late, rows, recordings, found):
    """Covariances of coordinates and rates at some rows by the rows up to `LOOK_AHEAD` later."""
    joints = a.shape[1]
    n = 3 * joints
    small, transition = np.zeros((2 * joints, 2 * joints)), np.zeros((n, n))
    shows = np.zeros((joints, n))
    for j in range(joints):
        shows[j, j], shows[j, joints + j] = 1.0, -late[j]
    for s in range(len(rows)):
        k, r = rows[s], recordings[s]
        adjoint = np.zeros((n, n))
        for i in range(_last_seen(t, k, r, last[r]), k, -1):
            kept = np.eye(n) - gains[i, r] @ shows
            adjoint = shows.T @ innovation[i, r] @ shows + kept.T @ adjoint @ kept
            _transition(a[place[i - 1, r]], t[i, r] - t[i - 1, r], small, transition)
            adjoint = transition.T @ adjoint @ transition
        p = covariance[k, r]
        p = p - p @ adjoint @ p
        found[s] = p[: 2 * joints, : 2 * joints]
