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

    def along(self, model: Model, bandwidths: Sequence[np.ndarray]) -> np.ndarray:
        """States of a model at every row, by filters of B bandwidths, shape (B, K + 1, 2 joints, R).

        Each is estimated from the rows up to `LOOK_AHEAD` later. Coordinates are those of the instant, with bias and
        scale of their sensors and without their delay; rates have that scale too.

        Args:
            model: The model.
            bandwidths: Of each joint's filter, each of shape (joints,) [rad/s].
        """
        measured, late, scale = self._measured, _delays(model), self._scale(model)
        filters = [self._filtered(model, bandwidth) for bandwidth in bandwidths]
        shown = self._followed(model, filters)
        found = np.zeros((len(filters), len(measured), 2 * measured.shape[1], measured.shape[2]))
        for b, each in enumerate(filters):
            coordinates, rates = shown.coordinates[:, :, b] / scale[:, None], shown.rates[:, :, b]
            surprises = np.nan_to_num(measured / scale[:, None] - coordinates)
            prior = np.concatenate([coordinates + late[:, None] * rates, rates], axis=1)
            _smooth(*each, self._inputs.t, self._inputs.last, late, surprises, prior, found[b])
        return found * np.tile(scale, 2)[:, None]

    def disturbance(self, model: Model, bandwidth: np.ndarray) -> np.ndarray:
        """Acceleration that a model lacks at every row, by the rows up to it, shape (K + 1, joints, R).

        Args:
            model: The model.
            bandwidth: Of each joint's filter, shape (joints,) [rad/s].
        """
        each = self._filtered(model, bandwidth)
        shown = self._followed(model, [each])
        joints = self._measured.shape[1]
        surprises = np.nan_to_num(self._measured - shown.coordinates[:, :, 0]) / self._scale(model)[:, None]
        return np.cumsum(np.einsum("krij,kjr->kir", each.gains[:, :, 2 * joints :], surprises), axis=0)

    def _scale(self, model: Model) -> np.ndarray:
        """What the sensors show of one unit, shape (joints,)."""
        return np.array([1.0 + _value(model, f"sensor_{name}/scale", "e") for name in self.plant.coordinates])

    def _followed(self, model: Model, filters: "Sequence[_Filter]") -> Rollouts:
        """What a model, kept close by each of B filters, shows at every row before it is corrected there."""
        inputs, measured, scale = self._inputs, self._measured, self._scale(model)
        joints, recordings = measured.shape[1:]
        gains = np.stack([each.gains for each in filters]) / scale
        recorded = np.zeros((len(measured), 2 * joints, recordings))
        recorded[:, :joints] = measured
        corrections = np.zeros((*gains.shape[:3], 2 * joints, 2 * joints))
        corrections[..., :joints] = gains[..., : 2 * joints, :]
        drift = np.zeros((*gains.shape[:3], joints, 2 * joints))
        drift[..., :joints] = gains[..., 2 * joints :, :]
        count = len(filters)
        idle = np.zeros((count, len(self.plant.commands)))
        observer = Observer(recorded, corrections, np.arange(count), idle, drift=drift)
        start = np.repeat(self._first_states(model)[:, None], count, axis=1)
        batch = ModelBatch(model, (), np.zeros((count, 0)))
        return self.simulator.follow(batch, inputs, start, observer)

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
            *self._filtered(model, bandwidth), inputs.t, inputs.last, _delays(model), rows, recordings, found
        )
        return found

    def _filtered(self, model: Model, bandwidth: np.ndarray) -> "_Filter":
        inputs, measured = self._inputs, self._measured
        joints, recordings = measured.shape[1:]
        linear = linearise_along(model, measured)
        sensor = self.noise / np.abs(self._scale(model))
        n, rows = 3 * joints, len(measured)
        gains = np.zeros((rows, recordings, n, joints))
        covariance = np.zeros((rows, recordings, n, n))
        innovation = np.zeros((rows, recordings, joints, joints))
        rate = (np.asarray(bandwidth) ** 3 * sensor) ** 2 * self._interval
        _filter(
            linear.a,
            linear.place,
            inputs.t,
            inputs.last,
            sensor**2,
            rate,
            _delays(model),
            gains,
            covariance,
            innovation,
        )
        return _Filter(linear.a, linear.place, gains, covariance, innovation)

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

    def _first_states(self, model: Model) -> np.ndarray:
        """True states at the first rows, by parabolas through what the sensors show, shape (2 joints, R)."""
        joints = len(self.plant.coordinates)
        found = np.zeros((2 * joints, len(self.recordings)))
        for r, recording in enumerate(self.recordings):
            t = recording.t - recording.t[0]
            count = min(max(FEWEST_ROWS, int(np.searchsorted(t, FIRST_SPAN))), len(t))
            for j, name in enumerate(self.plant.coordinates):
                fit = np.polynomial.polynomial.polyfit(t[:count], recording[name][:count], min(2, count - 1))
                found[j, r], found[joints + j, r] = fit[0] - _value(model, f"sensor_{name}/bias", "b"), fit[1]
                found[[j, joints + j], r] /= 1.0 + _value(model, f"sensor_{name}/scale", "e")
        return found


@dataclass(frozen=True)
class Starts:
    """Windows, and the states that lead into them.

    Attributes:
        windows: R of them.
        until: Row of each window at which its prediction starts, shape (R,).
        states: As the sensors show them, without their delay, shape (rows, 2 joints, B, R): one for all models, or one
            for each.
        delays: Of the sensors of the model that they were estimated with, shape (joints,) [s].
    """

    windows: Windows
    until: np.ndarray
    states: np.ndarray
    delays: np.ndarray

    def of(self, index: np.ndarray) -> "Starts":
        """Of some of the B models, or of another one for each window, index (R,)."""
        if index.shape == self.until.shape:
            return replace(self, states=self.states[:, :, index, np.arange(len(index))][:, :, None])
        return replace(self, states=self.states[:, :, index])

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
    t = windows.inputs.t
    until = np.sum(t <= windows.starts + 1e-6, axis=0) - 1
    rows = np.minimum(np.arange(until.max() + 1)[:, None], until) + windows.row
    found = smoother.along(model, bandwidths)[:, rows, :, windows.recording]
    return Starts(windows, until, np.ascontiguousarray(found.transpose(0, 3, 2, 1)), _delays(model))


def _column(batch: ModelBatch, effect: str, symbol: str) -> np.ndarray:
    """A number of an effect in every model, shape (P,); zero where the effect is absent."""
    return batch.column(f"{effect}.{symbol}") if effect in batch.model.effects else np.zeros(batch.size)


class _Filter(NamedTuple):
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


def _value(model: Model, effect: str, symbol: str) -> float:
    """A number of an effect; zero where the effect is absent."""
    return model.effects[effect][symbol] if effect in model.effects else 0.0


def _delays(model: Model) -> np.ndarray:
    """Delay of each coordinate's sensor, shape (joints,) [s]."""
    return np.array([_value(model, f"sensor_{name}/delay", "tau") for name in model.plant.coordinates])


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
def _back(gain, innovation, surprise, late, move, adjoint, moved):
    """Take the adjoint state from after the correction at a row to the row before."""
    joints, n = len(late), len(adjoint)
    moved[:] = adjoint
    for j in range(joints):
        pull = 0.0
        for q in range(joints):
            pull += innovation[j, q] * surprise[q]
        for q in range(n):
            pull -= gain[q, j] * adjoint[q]
        moved[j] += pull
        moved[joints + j] -= late[j] * pull
    for q in range(n):
        adjoint[q] = 0.0
        for p in range(n):
            adjoint[q] += move[p, q] * moved[p]


@cached
def _smooth(a, place, gains, covariance, innovation, t, last, late, surprises, prior, found):
    """States at every row by the rows up to `LOOK_AHEAD` later, from the innovations (K + 1, joints, R)."""
    joints = a.shape[1]
    n = 3 * joints
    small, transition = np.zeros((2 * joints, 2 * joints)), np.zeros((n, n))
    adjoint, moved = np.zeros(n), np.zeros(n)
    for r in range(place.shape[1]):
        moves = np.zeros((last[r], n, n))
        for k in range(last[r]):
            _transition(a[place[k, r]], t[k + 1, r] - t[k, r], small, transition)
            moves[k] = transition
        for k in range(last[r] + 1):
            adjoint[:] = 0.0
            for i in range(_last_seen(t, k, r, last[r]), k, -1):
                _back(gains[i, r], innovation[i, r], surprises[i, :, r], late, moves[i - 1], adjoint, moved)
            for i in range(2 * joints):
                total = prior[k, i, r]
                for j in range(joints):
                    total += gains[k, r, i, j] * surprises[k, j, r]
                for q in range(n):
                    total += covariance[k, r, i, q] * adjoint[q]
                found[k, i, r] = total


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
