"""The observer that follows a recording: Kalman gains along it, for given levels of noise.

The covariance obeys the Riccati recursion of the linearised rigid body, x' = A x + B f, where f is
white noise of the generalised forces and the sensors add white noise (Kristensen, Madsen,
Jorgensen 2004, Parameter estimation in stochastic grey-box models, Automatica 40(2)). Only gains are
taken from it; the state itself follows the nonlinear model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.law import inlined
from wipx.diagnosis.likelihood.recording_batch import SETTLES, RecordingBatch
from wipx.identify.linearisation import Linearisation, transition_over
from wipx.sim.cache import cached_for, floats, integers

UNSETTLED = 100.0  # how much noisier forces count while the state is settling
DIFFUSE = 1e4  # how much larger the variance of the first state is, which is read off noisy, perhaps late sensors
BEFORE = 1.0  # how fast a joint moves before its recording, at most [m/s, rad/s]


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of white noise.

    Attributes:
        force: On each joint, shape (joints,), spectral [N s^0.5 or N m s^0.5].
        sensor: Of each recorded channel, shape (m,) [unit of the column].
    """

    force: np.ndarray
    sensor: np.ndarray


@dataclass(frozen=True)
class Gains:
    """Gains and innovation covariances of one set of noise levels.

    Attributes:
        gains: Shape (K + 1, R, 2 joints, channels), from coordinates, and rates where any is recorded, to states.
        whitening: Inverse Cholesky factor of the innovations' covariance, shape (K + 1, R, m, m).
    """

    gains: np.ndarray
    whitening: np.ndarray


def observer_gains(
    linear: Linearisation,
    jolts: np.ndarray,
    data: RecordingBatch,
    levels: Sequence[NoiseLevels],
    delays: tuple[float, ...] | None = None,
) -> tuple[Gains, ...]:
    """Kalman gains along every recording, for each of several noise levels.

    Args:
        linear: The body.
        jolts: Covariance by which the body moves unseen within each row, shape (K + 1, R, 2 joints, 2 joints).
        data: The recordings.
        levels: Noise.
        delays: Delay of each coordinate's sensor [s]; None for none.
    """
    late = np.zeros(data.joints) if delays is None else np.array(delays)
    n, m = 2 * data.joints, len(data.channels)
    gains = np.zeros((len(levels), *data.rows.shape, n, data.seen))
    whitening = np.zeros((len(levels), *data.rows.shape, m, m))
    _riccati(
        linear.a,
        linear.b,
        linear.place,
        data.intervals,
        data.inputs.last,
        data.channels,
        np.array([level.force**2 for level in levels]),
        np.array([level.sensor**2 for level in levels]),
        late,
        data.inputs.t - data.inputs.t[0],
        jolts,
        gains,
        whitening,
    )
    return tuple(Gains(*each) for each in zip(gains, whitening, strict=True))


@inlined
def _correct(covariance, i, j, late, noise, half, root):
    """The covariance after a sensor of variance `noise` has shown state i, less `late` times state j.

    The covariance loses half half', where half is the gain times the deviation of the innovation, 1 / root.
    """
    n, lanes = len(half), len(noise)
    for a in range(n):
        for w in range(lanes):
            half[a, w] = covariance[a, i, w] - late * covariance[a, j, w]
    for w in range(lanes):
        root[w] = 1.0 / np.sqrt(half[i, w] - late * half[j, w] + noise[w])
    for a in range(n):
        for w in range(lanes):
            half[a, w] *= root[w]
    for a in range(n):
        for b in range(n):
            for w in range(lanes):
                covariance[a, b, w] -= half[a, w] * half[b, w]


@inlined
def _whiten(c, i, j, late, half, root, whitening):
    """Row c of the inverse Cholesky factor of the innovations' covariance: what earlier channels foretell is taken."""
    lanes = root.shape[1]
    for d in range(c):
        whitening[c, d] = 0.0
        for e in range(d, c):
            for w in range(lanes):
                whitening[c, d, w] -= root[c, w] * (half[e, i, w] - late * half[e, j, w]) * whitening[e, d, w]
    whitening[c, c] = root[c]


@inlined
def _predict(covariance, transition, half):
    """The covariance one interval later, but for the forces."""
    n, _, lanes = covariance.shape
    for a in range(n):
        for b in range(n):
            _multiply_add(half[a, b], transition[a], covariance[:, b], lanes)
    for a in range(n):
        for b in range(a + 1):
            _multiply_add(covariance[a, b], half[a], transition[b], lanes)
            for w in range(lanes):
                covariance[b, a, w] = covariance[a, b, w]


@inlined
def _multiply_add(total, left, right, lanes):
    """Write the sum over an even number of products, two at a time: half as often through the lanes."""
    for w in range(lanes):
        total[w] = left[0, w] * right[0, w] + left[1, w] * right[1, w]
    for q in range(2, len(left), 2):
        for w in range(lanes):
            total[w] += left[q, w] * right[q, w] + left[q + 1, w] * right[q + 1, w]


@inlined
def _shake(covariance, drive, jolts, dt):
    """What white forces, held over the interval, add to the covariance, and unseen moves of the body."""
    joints, _, lanes = drive.shape
    for i in range(joints):
        for j in range(joints):
            for w in range(lanes):
                covariance[i, j, w] += drive[i, j, w] * dt[w] ** 3 / 3.0
                covariance[i, joints + j, w] += drive[i, j, w] * 0.5 * dt[w] * dt[w]
                covariance[joints + i, j, w] += drive[i, j, w] * 0.5 * dt[w] * dt[w]
                covariance[joints + i, joints + j, w] += drive[i, j, w] * dt[w]
    for i in range(2 * joints):
        for j in range(2 * joints):
            for w in range(lanes):
                covariance[i, j, w] += jolts[w % len(jolts), i, j]


@inlined
def _combine(half, whitening, gain):
    """Gain by which each channel's error moves the states, shape (n, m, lanes): that of all channels at once."""
    m, n, lanes = half.shape
    gain[:] = 0.0
    for q in range(n):
        for d in range(m):
            for c in range(d, m):
                for w in range(lanes):
                    gain[q, d, w] += half[c, q, w] * whitening[c, d, w]


@inlined
def _move(a, b, place, interval, force, recording, recordings, own, pushed, work, transition, drive, dt):
    """Transition over an interval, and what white forces do meanwhile, for all levels on one recording."""
    joints, n = b.shape[1], len(own)
    transition_over(a[place], interval, own, pushed, work)
    for level in range(len(force)):
        w = level * recordings + recording
        dt[w] = interval
        for i in range(n):
            for j in range(n):
                transition[i, j, w] = own[i, j]
        for i in range(joints):
            for j in range(joints):
                drive[i, j, w] = 0.0
                for q in range(joints):
                    drive[i, j, w] += b[place, i, q] * b[place, j, q] * force[level, q]


@inlined
def _begin(covariance, sensor, time, k):
    """At the first row the state is hardly known; once it has settled, as well as the sensors tell.

    Coordinates are then known within some noise, rates within that over 20 ms; `sensor` has the variances of the
    coordinates, shape (L, joints).
    """
    (levels, joints), recordings = sensor.shape, time.shape[1]
    for r in range(recordings):
        if k == 0 or time[k - 1, r] <= SETTLES < time[k, r]:
            factor = DIFFUSE if k == 0 else 1.0
            covariance[:, :, r::recordings] = 0.0
            for level in range(levels):
                for j in range(joints):
                    known = 9.0 * factor * sensor[level, j]
                    covariance[j, j, level * recordings + r] = known
                    covariance[joints + j, joints + j, level * recordings + r] = known / 0.02**2


@inlined
def _hear(sensor, time, delay, noise):
    """Variance of a sensor's noise: a late one shows at first what was before the recording, at unknown speeds."""
    for level in range(len(sensor)):
        for r in range(len(time)):
            noise[level * len(time) + r] = sensor[level] + (BEFORE * max(delay - time[r], 0.0)) ** 2


@inlined
def _store(gain, inverse, channels, exists, gains, whitening):
    """Write gains (L, R, n, channels) and whitening (L, R, m, m) of one row, where a recording has it."""
    levels, recordings, n, _ = gains.shape
    for level in range(levels):
        for r in range(recordings):
            if exists[r]:
                w = level * recordings + r
                for c in range(len(channels)):
                    for i in range(n):
                        gains[level, r, i, channels[c]] = gain[i, c, w]
                    for d in range(c + 1):
                        whitening[level, r, c, d] = inverse[c, d, w]


@cached_for(
    floats(3),
    floats(3),
    integers(2),
    floats(2),
    integers(1),
    integers(1),
    floats(2),
    floats(2),
    floats(1),
    floats(2),
    floats(4),
    floats(5),
    floats(5),
)
def _riccati(a, b, place, intervals, last, channels, force, sensor, late, time, jolts, gains, whitening):
    """Fill in gains (L, K + 1, R, n, channels) and whitening (L, K + 1, R, m, m) of L noise levels.

    A lane is one level on one recording, lane = level R + recording; the innermost loops run along the lanes.
    """
    rows, recordings = place.shape
    joints, m = b.shape[1], len(channels)
    n, lanes = 2 * joints, len(force) * recordings
    covariance, work, transition = np.zeros((n, n, lanes)), np.zeros((n, n, lanes)), np.zeros((n, n, lanes))
    drive, dt, noise = np.zeros((joints, joints, lanes)), np.zeros(lanes), np.zeros(lanes)
    half, root = np.zeros((m, n, lanes)), np.zeros((m, lanes))
    inverse, gain = np.zeros((m, m, lanes)), np.zeros((n, m, lanes))
    own, pushed, room = np.zeros((n, n)), np.zeros((n, joints)), np.zeros((n, n))
    for k in range(rows):
        _begin(covariance, sensor[:, :joints], time, k)
        for c in range(m):
            i = channels[c]
            j, delay = (i + joints, late[i]) if i < joints else (i, 0.0)
            _hear(sensor[:, c], time[k], delay, noise)
            _correct(covariance, i, j, delay, noise, half[c], root[c])
            _whiten(c, i, j, delay, half, root, inverse)
        _combine(half, inverse, gain)
        _store(gain, inverse, channels, k <= last, gains[:, k], whitening[:, k])
        if k == rows - 1:
            break
        for r in range(recordings):
            louder = 1.0 if time[k, r] > SETTLES else UNSETTLED
            loud, g, interval = louder * force, place[k, r], intervals[k, r]
            _move(a, b, g, interval, loud, r, recordings, own, pushed, room, transition, drive, dt)
        _predict(covariance, transition, work)
        _shake(covariance, drive, jolts[k], dt)
