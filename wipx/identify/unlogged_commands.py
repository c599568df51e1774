"""Commands that a log does not have: how they scatter about those that it has, and how they moved the body unseen."""

import numpy as np

from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.identify.linearisation import answers_to_commands
from wipx.sim.inputs import Inputs


def noise_of_means(recording: Recording, command: str) -> float:
    """Standard deviation of white noise of a logged command, read off fourth differences [N or N m]; else zero."""
    if len(recording) < 5:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(recording[command], 4)))) / np.sqrt(70.0)


def command_spread(recordings: tuple[Recording, ...], plant: Plant) -> np.ndarray:
    """Half width by which single commands scatter about a row's mean if their noise is white, shape (inputs,).

    The noise of n commands' mean is sqrt(n) times less than theirs, and a triangular distribution is sqrt(6) standard
    deviations wide to either side. Zero where every command is in the log.
    """
    found = []
    for name in plant.commands:
        scaled = [np.sqrt(r.periods - 1) * noise_of_means(r, name) for r in recordings]
        found.append(np.sqrt(6.0) * float(np.median(scaled)))
    return np.array(found)


def inputs_along(recordings: tuple[Recording, ...], plant: Plant) -> Inputs:
    """All rows of recordings, each integrated from its first one."""
    return Inputs.of(
        [recording.t for recording in recordings],
        [recording.stack(plant.commands) for recording in recordings],
        [0] * len(recordings),
        tuple(recording.periods for recording in recordings),
        command_spread(recordings, plant),
    )


def jolts(model: Model, recordings: tuple[Recording, ...], inputs: Inputs, coordinates: np.ndarray) -> np.ndarray:
    """Covariance by which commands that are not in the log move the body from each row to the next.

    The log has the mean of N white commands of a row, each of variance v, and with it how far they move the rate. Their
    first moment moves the coordinate besides; over a row of length T its variance is v T^4 (1 - 1/N^2) / (12 N).
    Where rows are missing, the command is taken as held. It then differs from the true one by about as much as it has
    changed across the gap, and by its noise.

    Args:
        model: Whose body is moved.
        recordings: R of them.
        inputs: Their rows.
        coordinates: Recorded ones, shape (K + 1, joints, R).

    Returns:
        Of coordinates, then rates, shape (K + 1, R, 2 joints, 2 joints).
    """
    rows, joints = coordinates.shape[:2]
    found = np.zeros((rows, len(recordings), 2 * joints, 2 * joints))
    if all(recording.periods == 1 and not recording.missing.any() for recording in recordings):
        return found
    slopes = answers_to_commands(model, inputs, coordinates)
    for r, recording in enumerate(recordings):
        noise = np.array([noise_of_means(recording, name) for name in model.plant.commands])
        steps, missing = np.diff(recording.t), recording.missing
        gaps = steps * missing / (1.0 + missing)
        slope = slopes[: len(steps), r]
        moved = slope * noise * ((steps - gaps) ** 2 * np.sqrt((1.0 - recording.periods**-2.0) / 12.0))[:, None, None]
        found[: len(steps), r, :joints, :joints] = moved @ np.swapaxes(moved, 1, 2)
        (lacking,) = np.nonzero(missing)
        changes = np.diff(recording.stack(model.plant.commands), axis=0)[lacking]
        pushed = slope[lacking] * np.sqrt(changes**2 + 2.0 * noise**2)[:, None]
        gap = gaps[lacking, None, None]
        states = np.concatenate([0.5 * gap**2 * pushed, gap * pushed], axis=1)
        found[lacking, r] += states @ np.swapaxes(states, 1, 2)
    return found
