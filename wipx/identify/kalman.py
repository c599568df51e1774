"""A Kalman filter along recordings, with a pass over a few later rows.

The state of each joint is its coordinate, its rate and an acceleration that wanders at random. Gains come from the body
linearised along the recording; they say what innovations of a row, and of those soon after it, tell of the state there
(Anderson, Moore 1979, Optimal Filtering, ch. 7).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wipx.core.law import law
from wipx.identify.linearisation import Linearisation, transition_over
from wipx.sim.cache import cached_for, floats, integers, tuples

FIRST_SPAN = 0.05  # [s] of rows from which the first rates are read


class Places(NamedTuple):
    """Some rows of recordings.

    Attributes:
        rows: Shape (W,).
        recordings: Whose rows, shape (W,).
        until: Last row that the state at each may be estimated from, shape (W,).
    """

    rows: np.ndarray
    recordings: np.ndarray
    until: np.ndarray


class Gains(NamedTuple):
    """A filter along R recordings of n = 3 joints states: coordinates, rates, disturbances.

    Attributes:
        moves: Transitions to every row from the one before, shape (K + 1, R, n, n).
        gains: From innovations to states, shape (K + 1, R, n, joints).
        covariance: Of the states after each row, shape (K + 1, R, n, n).
        innovation: Inverse covariance of the innovations, shape (K + 1, R, joints, joints).
    """

    moves: np.ndarray
    gains: np.ndarray
    covariance: np.ndarray
    innovation: np.ndarray


@dataclass(frozen=True)
class Filter:
    """The filter of a model along recordings.

    Attributes:
        along: Its gains.
        scale: What the model's sensors show of one unit, shape (joints,).
        late: Delay of each sensor, shape (joints,) [s].
    """

    along: Gains
    scale: np.ndarray
    late: np.ndarray

    @cached_property
    def corrections(self) -> np.ndarray:
        """From what the sensors show to the states, shape (K + 1, R, n, joints)."""
        return self.along.gains / self.scale

    @cached_property
    def _seen(self) -> np.ndarray:
        """What the sensors show at every row of the state after the row before, shape (K + 1, R, joints, n)."""
        joints = len(self.late)
        return self.along.moves[:, :, :joints] - self.late[:, None] * self.along.moves[:, :, joints : 2 * joints]

    @cached_property
    def _closed(self) -> np.ndarray:
        """What becomes of an error of the state from one row to the next, shape (K + 1, R, n, n)."""
        return self.along.moves - self.along.gains @ self._seen

    def smoothed(self, places: Places, prior: np.ndarray, surprises: np.ndarray) -> np.ndarray:
        """States of P models at some places, shape (W, 2 joints, P).

        The rows after a place are gone through backwards (Bryson, Frazier 1963).

        Args:
            places: W of them.
            prior: States at every row before they are corrected there, shape (K + 1, R, 2 joints, P).
            surprises: Innovations there, shape (K + 1, R, joints, P).
        """
        told = np.swapaxes(self._seen, 2, 3) @ (self.along.innovation @ surprises)
        found = np.empty((len(places.rows), *prior.shape[2:]))
        _smooth(self.along, self._closed, told, *places, prior, surprises, found)
        return found

    def spread_by(self, noise: np.ndarray, places: Places) -> np.ndarray:
        """Covariance of coordinates and rates at some places by noise of the sensors, shape (W, 2 joints, 2 joints).

        Args:
            noise: N courses of it, shape (K + 1, R, joints, N).
            places: W of them.
        """
        rows, recordings, joints, count = noise.shape
        size, state = 2 * joints, np.zeros((recordings, 3 * joints, count))
        prior, surprises = np.empty((rows, recordings, size, count)), np.empty_like(noise)
        for k in range(rows):
            shown = state[:, :joints] - self.late[:, None] * state[:, joints:size]
            prior[k], surprises[k] = state[:, :size], noise[k] - shown
            if k + 1 < rows:
                state = self.along.moves[k + 1] @ (state + self.along.gains[k] @ surprises[k])
        moved = self.smoothed(places, prior, surprises)
        return moved @ np.swapaxes(moved, 1, 2) / count

    def spread(self, places: Places) -> np.ndarray:
        """Covariance of coordinates and rates at some places, shape (W, 2 joints, 2 joints).

        Innovations are white, so each later one takes its own share off.
        """
        rows, recordings, until = places
        size = 2 * len(self.late)
        found = self.along.covariance[rows, recordings][:, :size]
        error, found = found, found[:, :, :size].copy()
        for ahead in range(1, 1 + int(np.max(until - rows, initial=0))):
            inside = rows + ahead <= until
            later = np.minimum(rows + ahead, until), recordings
            seen = error @ np.swapaxes(self._seen[later], 1, 2)
            taken = seen @ self.along.innovation[later] @ np.swapaxes(seen, 1, 2)
            found -= taken * inside[:, None, None]
            error = error @ np.swapaxes(self._closed[later], 1, 2)
        return found


def gains_along(
    linear: Linearisation,
    jolts: np.ndarray,
    t: np.ndarray,
    last: np.ndarray,
    sensor: np.ndarray,
    rates: Sequence[np.ndarray],
    late: np.ndarray,
) -> list[Gains]:
    """Gains along R recordings of several filters.

    Args:
        linear: The body along them.
        jolts: Covariance by which the body moves unseen within each row, shape (K + 1, R, 2 joints, 2 joints).
        t: Times of the rows, shape (K + 1, R) [s].
        last: Last row of each recording, shape (R,).
        sensor: Standard deviation of each coordinate, shape (joints,) [m or rad].
        rates: Variance by which each acceleration wanders in each filter, shape (joints,) [(m or rad)^2/s^5].
        late: Delay of each sensor, shape (joints,) [s].
    """
    moves = transitions_along(linear, t, last)
    n, found = 3 * len(late), []
    for rate in rates:
        gains = np.zeros((*t.shape, n, len(late)))
        covariance = np.zeros_like(moves)
        innovation = np.zeros((*t.shape, len(late), len(late)))
        _filter(moves, t, last, sensor**2, rate, late, jolts, gains, covariance, innovation)
        found.append(Gains(moves, gains, covariance, innovation))
    return found


def transitions_along(linear: Linearisation, t: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Transitions of coordinates, rates and accelerations to every row from the one before, shape (K + 1, R, n, n).

    Args:
        linear: The body along R recordings.
        t: Times of the rows, shape (K + 1, R) [s].
        last: Last row of each recording, shape (R,).
    """
    return _moves(linear.a, linear.place, t, last)


@cached_for(floats(3), integers(2), floats(2), integers(1))
def _moves(a, place, t, last):
    """Transitions to every row from the one before, shape (K + 1, R, n, n)."""
    joints, size = a.shape[1:]
    small, pushed, work = np.zeros((size, size)), np.zeros((size, joints)), np.zeros((size, size))
    found = np.zeros((*place.shape, size + joints, size + joints))
    for r in range(place.shape[1]):
        for k in range(last[r]):
            transition_over(a[place[k, r]], t[k + 1, r] - t[k, r], small, pushed, work)
            move = found[k + 1, r]
            move[:size, :size] = small
            move[:size, size:] = pushed
            for j in range(joints):
                move[size + j, size + j] = 1.0
    return found


@cached_for(
    floats(4), floats(2), integers(1), floats(1), floats(1), floats(1), floats(4), floats(4), floats(4), floats(4)
)
def _filter(moves, t, last, sensor, rate, late, jolts, gains, covariance, innovation):
    """Gains, covariances after each row, and inverse covariances of the innovations, of every recording."""
    joints, n = len(late), moves.shape[2]
    p, shown, work = np.zeros((n, n)), np.zeros((n, joints)), np.zeros((n, n))
    for r in range(moves.shape[1]):
        p[:] = 0.0
        for j in range(joints):
            p[j, j] = 9.0 * sensor[j]
            p[joints + j, joints + j] = 9.0 * sensor[j] / FIRST_SPAN**2 + 1.0
            p[2 * joints + j, 2 * joints + j] = 100.0
        for k in range(last[r] + 1):
            _show(p, sensor, late, shown, innovation[k, r])
            _invert(innovation[k, r])
            _correct(p, shown, innovation[k, r], gains[k, r])
            covariance[k, r] = p
            if k < last[r]:
                _predict(p, moves[k + 1, r], work)
                _wander(p, rate, t[k + 1, r] - t[k, r])
                p[: 2 * joints, : 2 * joints] += jolts[k, r]


@law
def _show(p, sensor, late, shown, innovation):
    """Covariance of the state with what the sensors show, (n, joints), and that of what they show."""
    joints = len(late)
    for i in range(len(p)):
        for j in range(joints):
            shown[i, j] = p[i, j] - late[j] * p[i, joints + j]
    for i in range(joints):
        for j in range(joints):
            innovation[i, j] = shown[i, j] - late[i] * shown[joints + i, j]
        innovation[i, i] += sensor[i]


@law
def _invert(a):
    """Invert a positive definite matrix in place, by Gauss and Jordan without pivots."""
    n = len(a)
    for k in range(n):
        pivot = 1.0 / a[k, k]
        a[k, k] = 1.0
        for j in range(n):
            a[k, j] *= pivot
        for i in range(n):
            if i != k:
                weight = a[i, k]
                a[i, k] = 0.0
                for j in range(n):
                    a[i, j] -= weight * a[k, j]


@law
def _correct(p, shown, inverse, gain):
    """Gain of a row, and the covariance (n, n) after it."""
    joints = len(inverse)
    for i in range(len(p)):
        for j in range(joints):
            total = 0.0
            for c in range(joints):
                total += shown[i, c] * inverse[c, j]
            gain[i, j] = total
        for j in range(i + 1):
            total = p[i, j]
            for c in range(joints):
                total -= gain[i, c] * shown[j, c]
            p[i, j] = p[j, i] = total


@law
def _predict(p, move, work):
    """Covariance (n, n) after a move, which leaves the accelerations, the last third of the state, as they are."""
    n = len(p)
    moved = n - n // 3
    for i in range(n):
        for j in range(n):
            work[i, j] = 0.0 if i < moved else p[i, j]
    for i in range(moved):
        for c in range(n):
            for j in range(n):
                work[i, j] += move[i, c] * p[c, j]
    for i in range(n):
        for j in range(min(i + 1, moved)):
            total = 0.0
            for c in range(n):
                total += work[i, c] * move[j, c]
            p[i, j] = p[j, i] = total


@law
def _wander(p, rate, dt):
    """Add to a covariance what accelerations that wander do to the state within an interval."""
    joints = len(rate)
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


@cached_for(
    tuples(Gains, floats(4)),
    floats(4),
    floats(4),
    integers(1),
    integers(1),
    integers(1),
    floats(4),
    floats(4),
    floats(3),
)
def _smooth(along, closed, told, rows, recordings, until, prior, surprises, found):
    """States at some rows from those before their correction, the innovations there, and those of later rows.

    What an innovation tells of the state after the row before, `told` (K + 1, R, n, P), is carried backwards: from one
    row to an earlier one of the same stretch, or anew from the last row that a state may use.
    """
    n, models = told.shape[2:]
    now, after = np.zeros((n, models)), np.zeros((n, models))
    reached = 0
    for w in range(len(rows)):
        k, r = rows[w], recordings[w]
        if w == 0 or r != recordings[w - 1] or until[w] != until[w - 1] or k > reached:
            now[:] = 0.0
            reached = until[w]
        while reached > k:
            now, after = after, now
            now[:] = told[reached, r]
            _add_product(closed[reached, r], after, now)
            reached -= 1
        found[w] = prior[k, r]
        _add_product(along.gains[k, r].T, surprises[k, r], found[w])
        _add_product(along.covariance[k, r], now, found[w])


@law
def _add_product(columns, of, to):
    """Add the product of a matrix, given by its columns, with some columns to `to`, as many rows as that has."""
    rows, models = to.shape
    if models == 1:  # the longer loop is the inner one
        only = to.reshape(to.size)
        for c in range(len(of)):
            column, factor = columns[c], of[c, 0]
            for i in range(rows):
                only[i] += factor * column[i]
        return
    for i in range(rows):
        row = to[i]
        for c in range(len(of)):
            factor, other = columns[c, i], of[c]
            for p in range(models):
                row[p] += factor * other[p]
