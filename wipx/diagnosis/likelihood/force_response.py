"""What small forces on a joint do to the innovations: the linear response of the observer's error.

A force that is not in the model moves the state; the observer takes part of that back at every row, and what it shows
wrongly at the next one is the response (Ljung 1999, System Identification, sec. 3.2).
"""

from collections.abc import Mapping

import numpy as np

from wipx.core.law import inlined
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
    state = fitter.innovations_model.estimated(fit.hypothesis.model, gains, fit.levels.spread)
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
    held, push = np.zeros((n, joints)), np.zeros(n)
    for r in range(recordings):
        states, moved = np.zeros((n, columns)), np.zeros((n, columns))
        for k in range(last[r] + 1):
            for d in range(m):
                for i in range(m):
                    show[d, channels[i]] = -whitening[k, r, d, i]
            _add_product(out[k, :, r], show, states)
            if k == last[r]:
                break
            dt, g = intervals[k, r], place[k, r]
            transition_over(a[g], dt, transition, held)
            kept[:] = transition
            _add_product(kept, transition, -gains[k, r])
            push[:] = held @ b[g]
            for i in range(n):
                for c in range(columns):
                    moved[i, c] = push[i] * forces[r, k, c]
            _add_product(moved, kept, states)
            states, moved = moved, states
    return out


@inlined
def _add_product(total, weights, states):
    """Add the product of two matrices; the second has many columns."""
    for i in range(len(total)):
        for j in range(len(states)):
            weight = weights[i, j]
            for c in range(states.shape[1]):
                total[i, c] += weight * states[j, c]
