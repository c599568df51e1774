"""A Kalman filter along recordings, with a pass over a few later rows.

The state of each joint is its coordinate, its rate and an acceleration that wanders at random. Gains come from the body
linearised along the recording; they say what innovations of a row, and of those soon after it, tell of the state there
(Anderson, Moore 1979, Optimal Filtering, ch. 7).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wipx.identify.linearisation import Linearisation, transition_over
from wipx.sim.cache import cached

FIRST_SPAN = 0.05  # [s] of rows from which the first rates are read


class Places(NamedTuple):
    """Some rows of recordings.

    Attributes:
        rows: Shape (W,).
        recordings: Whose rows, shape (W,).
    """

    rows: np.ndarray
    recordings: np.ndarray


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
    """The filter of a model, and what it makes of the rows after a place.

    Attributes:
        along: Its gains.
        scale: What the model's sensors show of one unit, shape (joints,).
        places: Where it smooths.
        ahead: Gains from innovations of the next M rows to coordinates and rates at each place, shape (W, M, 2 joints,
            joints); zero for rows that do not count.
    """

    along: Gains
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

    def spread(self) -> np.ndarray:
        """Covariance of coordinates and rates at the places, shape (W, 2 joints, 2 joints).

        Innovations are white, so each later one takes its own share off.
        """
        rows, recordings = self.places
        count, size = self.ahead.shape[1:3]
        later = np.minimum(rows[:, None] + 1 + np.arange(count), len(self.along.gains) - 1)
        known = np.any(self.ahead != 0.0, axis=(2, 3))
        inverse = np.where(known[..., None, None], self.along.innovation[later, recordings[:, None]], np.eye(size // 2))
        taken = np.einsum("wmij,wmjk,wmlk->wil", self.ahead, np.linalg.inv(inverse), self.ahead)
        return self.along.covariance[rows, recordings, :size, :size] - taken


def gains_along(
    linear: Linearisation, t: np.ndarray, last: np.ndarray, sensor: np.ndarray, rate: np.ndarray, late: np.ndarray
) -> Gains:
    """Gains along R recordings.

    Args:
        linear: The body along them.
        t: Times of the rows, shape (K + 1, R) [s].
        last: Last row of each recording, shape (R,).
        sensor: Standard deviation of each coordinate, shape (joints,) [m or rad].
        rate: Variance by which each acceleration wanders, shape (joints,) [(m or rad)^2/s^5].
        late: Delay of each sensor, shape (joints,) [s].
    """
    moves = _moves(linear.a, linear.place, t, last)
    n = 3 * len(late)
    gains = np.zeros((*t.shape, n, len(late)))
    covariance = np.zeros_like(moves)
    innovation = np.zeros((*t.shape, len(late), len(late)))
    _filter(moves, t, last, sensor**2, rate, late, gains, covariance, innovation)
    return Gains(moves, gains, covariance, innovation)


def look_ahead(along: Gains, late: np.ndarray, places: Places, until: np.ndarray) -> np.ndarray:
    """`Filter.ahead` of rows up to `until` (W,), for sensors with delays (joints,) [s]."""
    joints = len(late)
    found = np.zeros((len(until), int(np.max(until - places.rows, initial=0)), 2 * joints, joints))
    _look_ahead(along.moves, along.covariance, along.gains, along.innovation, late, *places, until, found)
    return found


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
def _filter(moves, t, last, sensor, rate, late, gains, covariance, innovation):
    """Gains, covariances after each row, and inverse covariances of the innovations, of every recording."""
    joints, n = len(late), moves.shape[2]
    for r in range(moves.shape[1]):
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
                p = moves[k + 1, r] @ p @ moves[k + 1, r].T
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
def _look_ahead(moves, covariance, gains, innovation, late, rows, recordings, until, found):
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
