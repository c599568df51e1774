"""What small forces on a joint do to the innovations: the linear response of the observer's error.

A force that is not in the model moves the state; the observer takes part of that back at every row, and what it shows
wrongly at the next one is the response (Ljung 1999, System Identification, sec. 3.2).
"""

from collections.abc import Mapping

import numpy as np

from wipx.core.law import law
from wipx.core.model import Model
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.noise_model import whitened_change
from wipx.identify.linearisation import transition_over
from wipx.sim.cache import cached_for, floats, integers

SLOW = 0.02  # of the largest speed, at which half of dry friction has built up
FAST = 0.995  # quantile of the speed that counts as the largest


def motion_of(fitter: InnovationFitter, fit: Fit) -> dict[str, np.ndarray]:
    """Coordinates, rates, commands and time at every row, shape (K + 1, R) each.

    Coordinates and rates are those that the fit's observer expects: a force made of them knows nothing of the
    noise of the row that it is tested on.
    """
    data = fitter.data
    plant = data.plant
    gains = fitter.innovations_model.gains(fit.levels, fit.hypothesis.model)
    state = fitter.innovations_model.estimated(fit.hypothesis.model, gains)
    signals = {name: state[:, i] for i, name in enumerate((*plant.coordinates, *plant.rates))}
    for c, name in enumerate(plant.commands):
        commands = data.inputs.commands[:, c]
        signals[name] = np.concatenate([commands, commands[-1:]])
    signals["t"] = np.where(data.rows, data.inputs.t, 0.0)
    return signals


def drive_force(model: Model, motion: Mapping[str, np.ndarray], joint: str) -> np.ndarray:
    """Force that the drive of a joint makes of what was commanded, shape (K + 1, R) [N or N m].

    Args:
        model: Gain and stiffness of the drive; what else is missing at it is left out.
        motion: By column, see `motion_of`.
        joint: One that is driven.
    """
    plant, p = model.plant, model.parameters
    site = "actuator" if plant.tree is None else f"actuator_{joint}"
    gain = model.effects.get(f"{site}/gain", {}).get("k", 1.0)
    command = motion[plant.commands[plant.actuated.index(joint)]]
    drive = plant.drives.get(joint)
    if drive is None:
        return gain * p["input_gain"] * command
    if drive.kind == "torque":
        return gain * p[f"{joint}.gain"] * command
    column = plant.columns[joint]
    stiffness, damping = model.servo(joint)
    force = stiffness * (command - motion[column]) - damping * motion[f"{column}_dot"]
    return gain * (force if drive.limit is None else np.clip(force, -drive.limit, drive.limit))


def direction(rate: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sign of a rate (K + 1, R), without a jump where it is nearly at rest; `rows` exist."""
    slow = SLOW * max(float(np.quantile(np.abs(rate[rows]), FAST)), 1e-12)
    return rate / (np.abs(rate) + slow)


def response(fitter: InnovationFitter, fit: Fit, joint: int, forces: np.ndarray) -> np.ndarray:
    """Slopes of a fit's white innovations by the sizes of forces on a joint.

    Args:
        fitter: Of the fit.
        fit: Whose observer and noise model count.
        joint: Index of the joint.
        forces: At every row, of size one, shape (C, K + 1, R) [N or N m].

    Returns:
        Shape (R m (K + 1), C).
    """
    innovations_model = fitter.innovations_model
    linear, data = innovations_model.linear, innovations_model.data
    gains = innovations_model.gains(fit.levels, fit.hypothesis.model)
    innovations = np.zeros((len(forces), *fit.white.shape))
    innovations[:, :, : len(data.channels)] = _driven(
        linear.a,
        linear.b[:, :, joint].copy(),
        linear.place,
        data.intervals,
        data.inputs.last,
        data.channels,
        gains.gains,
        gains.whitening,
        np.ascontiguousarray(forces.T),
    ).T
    return whitened_change(innovations, fit.noise, data).reshape(len(forces), -1).T


@cached_for(floats(3), floats(2), integers(2), floats(2), integers(1), integers(1), floats(4), floats(4), floats(3))
def _driven(a, b, place, intervals, last, channels, gains, whitening, forces):
    """White innovations (K + 1, m, R, C) that forces (R, K + 1, C) cause; all columns of a row lie side by side."""
    recordings, rows, columns = forces.shape
    joints = a.shape[1]
    n, m = 2 * joints, len(channels)
    out = np.zeros((rows, m, recordings, columns))
    transition, kept, show = np.zeros((n, n)), np.zeros((n, n)), np.zeros((m, n))
    held, push, work = np.zeros((n, joints)), np.zeros(n), np.zeros((n, n))
    states, moved = np.zeros((n, columns)), np.zeros((n, columns))
    for r in range(recordings):
        states[:] = 0.0
        for k in range(last[r] + 1):
            _show(whitening[k, r], channels, states, show, out[k, :, r])
            if k < last[r]:
                g = place[k, r]
                transition_over(a[g], intervals[k, r], transition, held, work)
                _correct(transition, gains[k, r], kept)
                _push(held, b[g], push)
                _move(kept, push, states, forces[r, k], moved)
                states, moved = moved, states
    return out


@law
def _show(whitening, channels, states, show, out):
    """White innovations (m, C) of a row that errors of the states (n, C) cause."""
    for d in range(len(channels)):
        for i in range(len(channels)):
            show[d, channels[i]] = -whitening[d, i]
    for d in range(len(show)):
        for j in range(len(states)):
            weight = show[d, j]
            for c in range(states.shape[1]):
                out[d, c] += weight * states[j, c]


@law
def _correct(transition, gain, kept):
    """What an interval leaves of an error that was corrected first: the transition times (1 - gain)."""
    n = len(transition)
    for i in range(n):
        for j in range(n):
            kept[i, j] = transition[i, j]
        for q in range(n):
            weight = transition[i, q]
            for c in range(gain.shape[1]):
                kept[i, c] -= weight * gain[q, c]


@law
def _push(held, b, push):
    """What a force of one on a joint does to the states in an interval."""
    for i in range(len(held)):
        push[i] = 0.0
        for j in range(len(b)):
            push[i] += held[i, j] * b[j]


@law
def _move(kept, push, states, forces, moved):
    """Errors of the states (n, C) one interval later."""
    for i in range(len(kept)):
        for c in range(len(forces)):
            moved[i, c] = push[i] * forces[c]
        for j in range(len(states)):
            weight = kept[i, j]
            for c in range(len(forces)):
                moved[i, c] += weight * states[j, c]
