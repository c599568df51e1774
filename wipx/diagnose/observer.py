"""The observer that follows a recording: Kalman gains along it, for given levels of noise.

The covariance obeys the Riccati recursion of the linearised rigid body, x' = A x + B f, where f is
white noise of the generalised forces and the sensors add white noise (Kristensen, Madsen,
Jorgensen 2004, Parameter estimation in stochastic grey-box models, Automatica 40(2)). Only gains are
taken from it; the state itself follows the nonlinear model.
"""

from dataclasses import dataclass


import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnose.log import SETTLES, Log
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.cache import cached
from wipx.sim.inputs import Inputs

STEP = 1e-5  # [s] of the simulated steps from which accelerations are read off
REACH = 1e-4  # of the differences [m, rad, m/s, rad/s]
PROBE = 1e-3  # damping by which the answer to a force is found [N s/m or N m s/rad]
GRID = 0.1  # [rad] between the angles about which the body is linearised
UNSETTLED = 100.0  # how much noisier forces count while the state is settling


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
        for l in range(n):
            second = a[j, l - joints] if l >= joints else 0.0
            for i in range(joints):
                second += a[j, joints + i] * a[i, l]
            transition[j, l] = (1.0 if j == l else 0.0) + (dt if l == joints + j else 0.0)
            transition[j, l] += 0.5 * dt * dt * a[j, l] + dt**3 / 6.0 * second
            transition[joints + j, l] = (1.0 if l == joints + j else 0.0) + dt * a[j, l] + 0.5 * dt * dt * second


@cached
def _riccati(a, b, place, intervals, last, channels, force, sensor, late, time):
    rows, recordings = place.shape
    joints = b.shape[1]
    n, m = 2 * joints, len(channels)
    gains = np.zeros((rows, recordings, n, n))
    whitening = np.zeros((rows, recordings, m, m))
    transition, covariance, half = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    before = np.zeros((n, n))
    h = np.zeros((m, n))
    ph, s, factor, inverse = np.zeros((n, m)), np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, m))
    for c in range(m):
        h[c, channels[c]] = 1.0
        if channels[c] < joints:
            h[c, channels[c] + joints] = -late[channels[c]]
    for r in range(recordings):
        # The first state is read off noisy rows: coordinates within some noise, rates within that over 20 ms.
        covariance[:] = 0.0
        for j in range(joints):
            covariance[j, j] = 9.0 * sensor[j]
            covariance[joints + j, joints + j] = 9.0 * sensor[j] / 0.02**2
        steady = False
        for k in range(last[r] + 1):
            if not steady:
                # Innovation covariance, its Cholesky factor and the inverse of that.
                for i in range(n):
                    for c in range(m):
                        total = 0.0
                        for l in range(n):
                            total += covariance[i, l] * h[c, l]
                        ph[i, c] = total
                for c in range(m):
                    for d in range(m):
                        total = sensor[c] if c == d else 0.0
                        for l in range(n):
                            total += h[c, l] * ph[l, d]
                        s[c, d] = total
                factor[:] = 0.0
                inverse[:] = 0.0
                for c in range(m):
                    for d in range(c + 1):
                        total = s[c, d]
                        for l in range(d):
                            total -= factor[c, l] * factor[d, l]
                        factor[c, d] = np.sqrt(max(total, 1e-300)) if c == d else total / factor[d, d]
                for d in range(m):
                    inverse[d, d] = 1.0 / factor[d, d]
                    for c in range(d + 1, m):
                        total = 0.0
                        for l in range(d, c):
                            total -= factor[c, l] * inverse[l, d]
                        inverse[c, d] = total / factor[c, c]
            whitening[k, r] = inverse
            for i in range(n):
                for c in range(m):
                    total = 0.0
                    for d in range(m):
                        weight = 0.0
                        for l in range(max(c, d), m):
                            weight += inverse[l, c] * inverse[l, d]
                        total += ph[i, d] * weight
                    gains[k, r, i, channels[c]] = total
            if k == last[r] or steady and _alike(place, intervals, k, r):
                continue
            steady = False
            for i in range(n):
                for l in range(n):
                    total = covariance[i, l]
                    for c in range(m):
                        total -= gains[k, r, i, channels[c]] * ph[l, c]
                    half[i, l] = total
            for i in range(n):  # rounding must not make it lopsided
                for l in range(n):
                    covariance[i, l] = 0.5 * (half[i, l] + half[l, i])
            dt = intervals[k, r]
            g = place[k, r]
            transition_over(a[g], dt, transition)
            for i in range(n):
                for l in range(n):
                    total = 0.0
                    for q in range(n):
                        total += transition[i, q] * covariance[q, l]
                    half[i, l] = total
            louder = 1.0 if time[k, r] > SETTLES else UNSETTLED
            change, size = 0.0, 0.0
            for i in range(n):
                for l in range(i, n):
                    total = 0.0
                    for q in range(n):
                        total += half[i, q] * transition[l, q]
                    if i % joints == l % joints or joints == 2:
                        drive = 0.0
                        for q in range(joints):
                            drive += b[g, i % joints, q] * b[g, l % joints, q] * force[q]
                        span = dt if i >= joints and l >= joints else (0.5 * dt * dt if l >= joints else dt**3 / 3.0)
                        total += louder * drive * span
                    covariance[i, l] = total
                    covariance[l, i] = total
                change = max(change, abs(covariance[i, i] - before[i, i]) / covariance[i, i])
            for i in range(n):
                for l in range(n):
                    before[i, l] = covariance[i, l]
            steady = change < 1e-7 and louder == 1.0
    return gains, whitening


@cached
def _alike(place, intervals, k, r):
    """Whether row k is followed by the same interval, at the same place, as row k - 1."""
    return k > 0 and place[k, r] == place[k - 1, r] and abs(intervals[k, r] - intervals[k - 1, r]) < 1e-6
