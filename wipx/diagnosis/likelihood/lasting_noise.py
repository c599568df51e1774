"""Whether noise that lasts is of a sensor or of a force.

The observer knows white noise only: of sensors, and of forces on the joints. A sensor's noise that lasts, as that of a
filter, leaves innovations that earlier ones foretell. So does a force that no law gives. They differ in what they do:
a force moves the body, whose equations of motion are known. The noise of the sensors is a first-order autoregression
here, beside white noise, and the levels are those of the greatest likelihood; the state is augmented by the noise
(Bryson, Johansen 1965, IEEE Trans. Automatic Control 10(1)).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from wipx.core.law import inlined
from wipx.core.model import ModelBatch
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.identify.kalman import transitions_along
from wipx.identify.noise import LastingNoise
from wipx.identify.sensors import delays_of
from wipx.sim.cache import booleans, cached_for, floats, integers

USUAL_TIME = 0.03  # [s] from which its search starts
REACH = 12.0  # natural logarithms by which a level may differ from where its search starts
LEAST = 1e-300  # of a level, whose logarithm is searched
AT_BOUND = 0.99  # share of the longest time from which a search counts as stopped by it
DIFFERENCE = 1e-4  # of the logarithms, by which slopes are taken: the likelihood has ten digits
ITERATIONS = 40  # of the search, at most


@dataclass(frozen=True)
class NoiseSources:
    """What innovations are made of.

    Attributes:
        force: Standard deviation of white forces on each joint, shape (joints,), spectral [N s^0.5 or N m s^0.5].
        lasting: Noise of the sensors that lasts; None where none was looked for.
    """

    force: np.ndarray
    lasting: LastingNoise | None


def noise_sources(model: InnovationsModel, fit: Fit, longest: float) -> NoiseSources:
    """The levels of noise under which the innovations of a fit are likeliest.

    What is likeliest to last longer than a sensor's noise is a force.

    Args:
        model: Follows the recordings.
        fit: By its innovations.
        longest: Correlation time of a sensor's noise, at most [s].
    """
    likelihood = _Likelihood.of(model, fit)
    levels, lasting = likelihood.greatest(fit.levels, np.full(model.data.joints, fill_value=True), longest)
    brief = np.array(lasting.times) < AT_BOUND * longest
    if not np.all(brief):
        levels, lasting = likelihood.greatest(fit.levels, brief, longest)
    return NoiseSources(levels.force, lasting)


@dataclass(frozen=True)
class _Likelihood:
    """Likelihood of a fit's innovations as a function of the noise.

    What an observer has done to its state is known, so its innovations tell as much as the recordings.

    Attributes:
        model: Follows the recordings.
        errors: Innovations of its channels, shape (R, m, K + 1).
        corrections: By what the observer moves its state at every row, shape (K + 1, R, 2 joints).
        moves: Transitions to every row from the one before, shape (K + 1, R, 2 joints, 2 joints).
        shown: What each channel shows of the observer's error and of the noise that lasts, shape (m, 3 joints).
    """

    model: InnovationsModel
    errors: np.ndarray
    corrections: np.ndarray
    moves: np.ndarray
    shown: np.ndarray

    @classmethod
    def of(cls, model: InnovationsModel, fit: Fit) -> "_Likelihood":
        data, fitted = model.data, fit.hypothesis.model
        gains = model.gains(fit.levels, fitted)
        surprises = data.measured - model.estimated(fitted, gains)
        surprises[~data.rows[:, None].repeat(surprises.shape[1], 1)] = 0.0
        corrections = np.einsum("krij,kjr->kri", gains.gains, surprises[:, : gains.gains.shape[3]])
        size = 2 * data.joints
        moves = transitions_along(model.linear, data.inputs.t, data.inputs.last)[:, :, :size, :size]
        errors = surprises[:, data.channels].transpose(2, 1, 0)
        shown = np.zeros((len(data.channels), size + data.joints))
        for row, channel in zip(shown, data.channels, strict=True):
            row[channel] = 1.0
            if channel < data.joints:
                row[data.joints + channel] = -delays_of(ModelBatch(fitted))[channel, 0]
                row[size + channel] = 1.0
        return cls(model, *(np.ascontiguousarray(x) for x in (errors, corrections, moves, shown)))

    def greatest(self, start: NoiseLevels, lasts: np.ndarray, longest: float) -> tuple[NoiseLevels, LastingNoise]:
        """Levels at which it is greatest, and the noise of those sensors whose noise may last.

        Args:
            start: Levels to start from.
            lasts: Whose noise may last, shape (joints,).
            longest: Correlation time, at most [s].
        """
        data, lasting = self.model.data, np.flatnonzero(lasts)
        joints, count = data.joints, len(lasting)
        spread = np.sqrt(np.mean(self.errors[:, lasting] ** 2, axis=(0, 2)))
        sizes = np.concatenate([start.force, start.sensor[:joints], spread])
        shortest = float(data.intervals[data.intervals > 0.0].min())
        begun = np.log(np.concatenate([np.maximum(sizes, LEAST), np.full(count, USUAL_TIME)]))
        reach = [(size - REACH, size + REACH) for size in begun[: len(sizes)]]
        reach += [(np.log(min(shortest, USUAL_TIME)), np.log(max(longest, shortest, USUAL_TIME)))] * count

        def parts(numbers: np.ndarray) -> tuple[NoiseLevels, LastingNoise]:
            force, white, deviation, time = np.split(np.exp(numbers), np.cumsum([joints, joints, count]))
            deviations, times = np.zeros(joints), np.full(joints, USUAL_TIME)
            deviations[lasting], times[lasting] = deviation, time
            levels = NoiseLevels(force, np.concatenate([white, start.sensor[joints:]]))
            return levels, LastingNoise(tuple(deviations.tolist()), tuple(times.tolist()))

        limits = {"maxiter": ITERATIONS, "eps": DIFFERENCE}
        ended = minimize(lambda x: -self(*parts(x)), begun, method="L-BFGS-B", bounds=reach, options=limits)
        return parts(ended.x)

    def __call__(self, levels: NoiseLevels, lasting: LastingNoise) -> float:
        """The logarithm, up to a constant, for levels of white noise and a noise that lasts."""
        data = self.model.data
        return _log_likelihood(
            self.errors,
            self.corrections,
            self.moves,
            self.model.linear.b,
            self.model.linear.place,
            data.intervals,
            data.inputs.last,
            data.counted,
            self.model.jolts,
            self.shown,
            levels.force**2,
            levels.sensor**2,
            np.square(lasting.deviations),
            np.array(lasting.times),
        )


@inlined
def _begin(covariance, sensor, variance):
    """At the first row coordinates are known within some noise, rates within that over 20 ms."""
    joints = len(variance)
    covariance[:] = 0.0
    for j in range(joints):
        known = 9.0 * (sensor[j] + variance[j])
        covariance[j, j], covariance[joints + j, joints + j] = known, known / 0.02**2
        covariance[2 * joints + j, 2 * joints + j] = variance[j]


@inlined
def _see(state, covariance, error, shown, sensor, gain):
    """Correct the state by an error of the observer; returns what the error adds to the log-likelihood.

    Args:
        state: Error of the observer's coordinates and rates, then the noise that lasts, shape (n,).
        covariance: Of it.
        error: Recorded minus shown.
        shown: What the channel shows of the state, shape (n,).
        sensor: Variance of its white noise.
        gain: Room, shape (n,).
    """
    n = len(state)
    variance = sensor
    for a in range(n):
        gain[a] = 0.0
        for b in range(n):
            gain[a] += covariance[a, b] * shown[b]
        variance += shown[a] * gain[a]
        error -= shown[a] * state[a]
    for a in range(n):
        state[a] += gain[a] * error / variance
        for b in range(n):
            covariance[a, b] -= gain[a] * gain[b] / variance
    return -0.5 * (np.log(variance) + error * error / variance)


@inlined
def _move(state, covariance, transition, work):
    """State and covariance one interval later, but for the noise; the state is a column of `work` meanwhile."""
    n = len(state)
    for i in range(n):
        for j in range(n):
            work[i, j] = 0.0
            for c in range(n):
                work[i, j] += transition[i, c] * covariance[c, j]
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for c in range(n):
                total += work[i, c] * transition[j, c]
            covariance[i, j] = covariance[j, i] = total
    for i in range(n):
        work[i, 0] = 0.0
        for c in range(n):
            work[i, 0] += transition[i, c] * state[c]
    state[:] = work[:, 0]


@inlined
def _shake(covariance, inverse_mass, force, jolts, dt):
    """What white forces, held over the interval, add to the covariance, and unseen moves of the body."""
    joints = len(force)
    for i in range(joints):
        for j in range(joints):
            drive = 0.0
            for q in range(joints):
                drive += inverse_mass[i, q] * inverse_mass[j, q] * force[q]
            covariance[i, j] += drive * dt**3 / 3.0
            covariance[i, joints + j] += drive * dt * dt / 2.0
            covariance[joints + i, j] += drive * dt * dt / 2.0
            covariance[joints + i, joints + j] += drive * dt
    for i in range(2 * joints):
        for j in range(2 * joints):
            covariance[i, j] += jolts[i, j]


@cached_for(
    floats(3),
    floats(3),
    floats(4),
    floats(3),
    integers(2),
    floats(2),
    integers(1),
    booleans(2),
    floats(4),
    floats(2),
    floats(1),
    floats(1),
    floats(1),
    floats(1),
)
def _log_likelihood(
    errors,
    corrections,
    moves,
    inverse_mass,
    place,
    intervals,
    last,
    counted,
    jolts,
    shown,
    force,
    sensor,
    variance,
    times,
):
    """Likelihood of the errors of an observer by a filter whose state is its error and the noise that lasts."""
    joints, size, n = len(force), 2 * len(force), 3 * len(force)
    state, covariance, transition = np.zeros(n), np.zeros((n, n)), np.zeros((n, n))
    work, gain = np.zeros((n, n)), np.zeros(n)
    total = 0.0
    for r in range(len(last)):
        state[:] = 0.0
        _begin(covariance, sensor, variance)
        for k in range(last[r] + 1):
            for c in range(len(shown)):
                told = _see(state, covariance, errors[r, c, k], shown[c], sensor[c], gain)
                total += told if counted[k, r] else 0.0
            if k == last[r]:
                break
            state[:size] -= corrections[k, r]
            transition[:size, :size] = moves[k + 1, r]
            for j in range(joints):
                transition[size + j, size + j] = np.exp(-intervals[k, r] / times[j])
            _move(state, covariance, transition, work)
            _shake(covariance, inverse_mass[place[k, r]], force, jolts[k, r], intervals[k, r])
            for j in range(joints):
                covariance[size + j, size + j] += variance[j] * (1.0 - transition[size + j, size + j] ** 2)
    return total
