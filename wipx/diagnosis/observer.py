"""The observer that follows a recording: Kalman gains along it, for given levels of noise.

The covariance obeys the Riccati recursion of the linearised rigid body, x' = A x + B f, where f is
white noise of the generalised forces and the sensors add white noise (Kristensen, Madsen,
Jorgensen 2004, Parameter estimation in stochastic grey-box models, Automatica 40(2)). Only gains are
taken from it; the state itself follows the nonlinear model.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.log import SETTLES, Log
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.cache import cached
from wipx.sim.inputs import Inputs

STEP = 1e-5  # [s] of the simulated steps from which accelerations are read off
REACH = 1e-4  # of the differences [m, rad, m/s, rad/s]
PROBE = 1e-3  # damping by which the answer to a force is found [N s/m or N m s/rad]
GRID = 0.1  # [rad] between the angles about which the body is linearised
JITTER = 0.1  # of the mean interval, a difference that gains need not follow
SETTLED = 1e-5  # relative change of the variances in a row, below which they are taken for constant
UNSETTLED = 100.0  # how much noisier forces count while the state is settling
DIFFUSE = 1e4  # how much larger the variance of the first state is, which is read off noisy, perhaps late sensors
UNHEARD = 1e6  # variance of a sensor that tells nothing [m^2, rad^2]


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of white noise.

    Attributes:
        force: On each joint, shape (joints,), spectral [N s^0.5 or N m s^0.5].
        sensor: Of each recorded channel, shape (m,) [unit of the column].
        spread: Half width by which single commands scatter about the mean that the log has [N or N m].
    """

    force: np.ndarray
    sensor: np.ndarray
    spread: float = 0.0


@dataclass(frozen=True)
class Linearisation:
    """The rigid body about the places that the recordings visit.

    Attributes:
        a: Slopes of the accelerations by coordinates and rates, shape (G, joints, 2 joints).
        b: Inverse mass matrix, shape (G, joints, joints).
        place: Which of the G each row belongs to, shape (K + 1, R).
    """

    a: np.ndarray
    b: np.ndarray
    place: np.ndarray


@dataclass(frozen=True)
class Gains:
    """Gains and innovation covariances of one set of noise levels.

    Attributes:
        gains: Shape (K + 1, R, 2 joints, 2 joints), from channels to states.
        whitening: Inverse Cholesky factor of the innovations' covariance, shape (K + 1, R, m, m).
    """

    gains: np.ndarray
    whitening: np.ndarray


def linearise_along(model: Model, log: Log) -> Linearisation:
    """The body of a model, its friction aside, at rest at the angles that the recordings visit."""
    joints = log.joints
    rounded = np.zeros((*log.rows.shape, joints), dtype=np.int64)
    for j, name in enumerate(model.plant.coordinates):
        if name != "x":
            rounded[..., j] = np.rint(log.measured[:, j] / GRID)
    places, index = np.unique(rounded.reshape(-1, joints), axis=0, return_inverse=True)
    bare = Model(model.plant, model.parameters, {})
    probes = {f"{site}/viscous": {"sigma": 0.0} for site in model.plant.joints}
    probed = bare.with_effects(probes)
    states = np.zeros((2 * joints, len(places), 1 + 4 * joints))
    states[:joints] = (places * GRID).T[:, :, None]
    for i in range(2 * joints):
        states[i, :, 1 + 2 * i] += REACH
        states[i, :, 2 + 2 * i] -= REACH
    rest = _accelerations(ModelBatch(probed), states.reshape(2 * joints, 1, -1))
    rest = rest.reshape(joints, len(places), 1 + 4 * joints)
    a = np.moveaxis((rest[:, :, 1::2] - rest[:, :, 2::2]) / (2.0 * REACH), 1, 0)
    # A known damping at a known rate is a known force: the difference that it makes shows the mass matrix.
    b = np.zeros((len(places), joints, joints))
    moving = np.zeros((2 * joints, 1, len(places)))
    moving[:joints, 0] = (places * GRID).T
    for j, site in enumerate(model.plant.joints):
        moving[joints:] = 0.0
        moving[joints + j] = 1.0
        free = _accelerations(ModelBatch(probed), moving)
        damped = _accelerations(ModelBatch(probed.with_values({f"{site}/viscous.sigma": PROBE})), moving)
        b[:, :, j] = ((free - damped) / PROBE)[:, 0].T
    return Linearisation(a, b, index.reshape(log.rows.shape))


def _accelerations(batch: ModelBatch, states: np.ndarray) -> np.ndarray:
    """Mean accelerations over one tiny step without commands, shape (joints, P, R)."""
    joints = len(batch.model.plant.joints)
    window = Inputs.regular(STEP, 1.0 / STEP, len(batch.model.plant.commands), states.shape[2])
    run = AnalyticSimulator(STEP, threads=1).replay(batch, window, states)
    return (run.rates[1] - run.rates[0]).reshape(joints, *states.shape[1:]) / STEP


def observer_gains(
    linear: Linearisation, log: Log, levels: NoiseLevels, delays: tuple[float, ...] | None = None
) -> Gains:
    """Kalman gains along every recording.

    Args:
        linear: The body.
        log: The recordings.
        levels: Noise.
        delays: Delay of each coordinate's sensor [s]; None for none.
    """
    late = np.zeros(log.joints) if delays is None else np.array(delays)
    gains, whitening = _riccati(
        linear.a,
        linear.b,
        linear.place,
        log.intervals,
        log.inputs.last,
        log.channels,
        levels.force**2,
        levels.sensor**2,
        late,
        log.inputs.t - log.inputs.t[0],
    )
    return Gains(gains, whitening)


@cached
def transition_over(a, dt, transition):
    """exp(A dt) to third order, written to `transition`; A has the slopes `a` of the accelerations."""
    joints, n = a.shape
    for j in range(joints):
        for i in range(n):
            second = a[j, i - joints] if i >= joints else 0.0
            for q in range(joints):
                second += a[j, joints + q] * a[q, i]
            transition[j, i] = (1.0 if j == i else 0.0) + (dt if i == joints + j else 0.0)
            transition[j, i] += 0.5 * dt * dt * a[j, i] + dt**3 / 6.0 * second
            transition[joints + j, i] = (1.0 if i == joints + j else 0.0) + dt * a[j, i] + 0.5 * dt * dt * second


@cached
def _factorise(s, factor, inverse):
    """Cholesky factor of a small matrix, and the inverse of the factor."""
    m = len(s)
    factor[:] = 0.0
    inverse[:] = 0.0
    for c in range(m):
        for d in range(c + 1):
            total = s[c, d]
            for q in range(d):
                total -= factor[c, q] * factor[d, q]
            factor[c, d] = np.sqrt(max(total, 1e-300)) if c == d else total / factor[d, d]
    for d in range(m):
        inverse[d, d] = 1.0 / factor[d, d]
        for c in range(d + 1, m):
            total = 0.0
            for q in range(d, c):
                total -= factor[c, q] * inverse[q, d]
            inverse[c, d] = total / factor[c, c]


@cached
def _times(a, b, out):
    """Product of two small matrices, without the overhead of a library call."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for q in range(a.shape[1]):
                total += a[i, q] * b[q, j]
            out[i, j] = total


@cached
def _correct(covariance, h, sensor, gain, inverse, work):
    """Kalman gain (n, m) and inverse factor of the innovations' covariance; the covariance after the correction."""
    ph, s, factor, half, after = work
    n, m = gain.shape
    _times(covariance, h.T, ph)
    _times(h, ph, s)
    for c in range(m):
        s[c, c] += sensor[c]
    _factorise(s, factor, inverse)
    _times(ph, inverse.T, half)
    _times(half, inverse, gain)
    _times(gain, ph.T, after)
    for i in range(n):  # rounding must not make it lopsided
        for j in range(i + 1):
            covariance[i, j] -= 0.5 * (after[i, j] + after[j, i])
            covariance[j, i] = covariance[i, j]


@cached
def _predict(covariance, transition, b, force, dt, half, after):
    """The covariance one interval later; forces are white noise held over the interval."""
    joints = len(force)
    _times(transition, covariance, half)
    _times(half, transition.T, after)
    for i in range(joints):
        for j in range(joints):
            drive = 0.0
            for q in range(joints):
                drive += b[i, q] * b[j, q] * force[q]
            after[i, j] += drive * dt**3 / 3.0
            after[i, joints + j] += drive * 0.5 * dt * dt
            after[joints + i, j] += drive * 0.5 * dt * dt
            after[joints + i, joints + j] += drive * dt
    covariance[:] = after


@cached
def _settled(covariance, before):
    """Whether the variances hardly changed; remembers them."""
    settled = True
    for i in range(len(before)):
        settled = settled and abs(covariance[i, i] - before[i]) < SETTLED * covariance[i, i]
        before[i] = covariance[i, i]
    return settled


@cached
def _seen_by(channels, late, joints):
    """What the channels see of the state, shape (m, n): a late sensor sees d seconds of the rate less."""
    h = np.zeros((len(channels), 2 * joints))
    for c in range(len(channels)):
        h[c, channels[c]] = 1.0
        if channels[c] < joints:
            h[c, channels[c] + joints] = -late[channels[c]]
    return h


@cached
def _begin(covariance, sensor, factor):
    """Coordinates known within some noise, rates within that over 20 ms, or worse by a factor of the variance."""
    joints = len(covariance) // 2
    covariance[:] = 0.0
    for j in range(joints):
        covariance[j, j] = 9.0 * factor * sensor[j]
        covariance[joints + j, joints + j] = 9.0 * factor * sensor[j] / 0.02**2


@cached
def _riccati(a, b, place, intervals, last, channels, force, sensor, late, time):
    rows, recordings = place.shape
    joints = b.shape[1]
    n, m = 2 * joints, len(channels)
    gains = np.zeros((rows, recordings, n, n))
    whitening = np.zeros((rows, recordings, m, m))
    covariance, transition, half, after = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    gain, inverse, before, heard = np.zeros((n, m)), np.zeros((m, m)), np.zeros(n), np.zeros(m)
    work = (np.zeros((n, m)), np.zeros((m, m)), np.zeros((m, m)), np.zeros((n, m)), np.zeros((n, n)))
    h = _seen_by(channels, late, joints)
    for r in range(recordings):
        _begin(covariance, sensor, DIFFUSE)
        steady, usual = False, intervals[: last[r], r].mean()
        for k in range(last[r] + 1):
            if k > 0 and time[k - 1, r] <= SETTLES < time[k, r]:
                _begin(covariance, sensor, 1.0)
            if not steady:
                for c in range(m):  # a late sensor shows at first what was before the recording
                    late_by = late[channels[c]] if channels[c] < joints else 0.0
                    heard[c] = sensor[c] if time[k, r] >= late_by else UNHEARD
                _correct(covariance, h, heard, gain, inverse, work)
            whitening[k, r] = inverse
            for c in range(m):
                gains[k, r, :, channels[c]] = gain[:, c]
            if k == last[r]:
                break
            alike = place[k, r] == place[max(k, 1) - 1, r] and abs(intervals[k, r] - usual) < JITTER * usual
            if not steady or not alike:
                transition_over(a[place[k, r]], intervals[k, r], transition)
                louder = 1.0 if time[k, r] > SETTLES else UNSETTLED
                _predict(covariance, transition, b[place[k, r]], louder * force, intervals[k, r], half, after)
                steady = _settled(covariance, before) and alike and louder == 1.0
    return gains, whitening
