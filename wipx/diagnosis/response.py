"""What small forces on a joint do to the innovations: the linear response of the observer's error.

A force that is not in the model moves the state; the observer takes part of that back at every row, and what it shows
wrongly at the next one is the response (Ljung 1999, System Identification, sec. 3.2).
"""

import numpy as np

from wipx.diagnosis.fitting import Fit, Fitter
from wipx.diagnosis.observer import transition_over
from wipx.diagnosis.whiteness import whitened_change
from wipx.sim.cache import cached

SLOW = 0.02  # of the largest speed, at which half of dry friction has built up
FAST = 0.995  # quantile of the speed that counts as the largest


def motion_of(fitter: Fitter, fit: Fit) -> dict[str, np.ndarray]:
    """Coordinates, rates, commands and time at every row, shape (K + 1, R) each.

    Coordinates and rates are those that the fit's observer expects: a force made of them knows nothing of the
    noise of the row that it is tested on.
    """
    log = fitter.follower.log
    plant = log.plant
    gains = fitter.follower.gains(fit.levels, fit.hypothesis.model)
    state = fitter.follower.estimated(fit.hypothesis.model, gains, fit.levels.spread)
    signals = {name: state[:, i] for i, name in enumerate((*plant.coordinates, *plant.rates))}
    for c, name in enumerate(plant.commands):
        commands = log.inputs.commands[:, c]
        signals[name] = np.concatenate([commands, commands[-1:]])
    signals["t"] = np.where(log.rows, log.inputs.t, 0.0)
    return signals


def direction(rate: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sign of a rate (K + 1, R), without a jump where it is nearly at rest; `rows` exist."""
    slow = SLOW * max(float(np.quantile(np.abs(rate[rows]), FAST)), 1e-12)
    return rate / (np.abs(rate) + slow)


def response(fitter: Fitter, fit: Fit, joint: int, forces: np.ndarray) -> np.ndarray:
    """Slopes of a fit's white innovations by the sizes of forces on a joint.

    Args:
        fitter: Of the fit.
        fit: Whose observer and colour count.
        joint: Index of the joint.
        forces: At every row, of size one, shape (C, K + 1, R) [N or N m].

    Returns:
        Shape (R m (K + 1), C).
    """
    follower = fitter.follower
    linear, log = follower.linear, follower.log
    gains = follower.gains(fit.levels, fit.hypothesis.model)
    innovations = np.zeros((len(forces), *fit.white.shape))
    innovations[:, :, : len(log.channels)] = _driven(
        linear.a,
        linear.b[:, :, joint].copy(),
        linear.place,
        log.intervals,
        log.inputs.last,
        log.channels,
        gains.gains,
        gains.whitening,
        forces,
    )
    return whitened_change(innovations, fit.colour, log).reshape(len(forces), -1).T


@cached
def _driven(a, b, place, intervals, last, channels, gains, whitening, forces):
    columns, rows, recordings = forces.shape
    joints = a.shape[1]
    n, m = 2 * joints, len(channels)
    out = np.zeros((columns, recordings, m, rows))
    transition, push = np.zeros((n, n)), np.zeros(n)
    correction, show = np.eye(n), np.zeros((m, n))
    for r in range(recordings):
        states = np.zeros((n, columns))
        for k in range(last[r] + 1):
            for c in range(m):
                show[:, channels[c]] = -whitening[k, r, :, c]
                correction[:, channels[c]] = -gains[k, r, :, channels[c]]
                correction[channels[c], channels[c]] += 1.0
            shown = show @ states
            for d in range(m):
                out[:, r, d, k] = shown[d]
            if k == last[r]:
                break
            dt, g = intervals[k, r], place[k, r]
            transition_over(a[g], dt, transition)
            for i in range(joints):
                push[i], push[joints + i] = 0.5 * dt * dt * b[g, i], dt * b[g, i]
            states = (transition @ correction) @ states + np.outer(push, forces[:, k, r])
    return out
