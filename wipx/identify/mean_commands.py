"""What a log of mean commands leaves open: how the single commands shook the body within a row."""

import numpy as np

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.identify.linearisation import answers_to_commands
from wipx.sim.inputs import Inputs


def noise_of_means(recording: Recording, command: str) -> float:
    """Standard deviation of white noise of a logged command, read off fourth differences [N or N m]; else zero."""
    if len(recording) < 5:
        return 0.0
    return 1.4826 * float(np.median(np.abs(np.diff(recording[command], 4)))) / np.sqrt(70.0)


def jolts(model: Model, recordings: tuple[Recording, ...], inputs: Inputs, coordinates: np.ndarray) -> np.ndarray:
    """Covariance by which single commands move coordinates unseen within each row, shape (K + 1, R, joints, joints).

    The mean of N white commands, each of variance v, moves the rate. Their first moment moves the coordinate besides;
    over a row of length T its variance is v T^4 (1 - 1/N^2) / (12 N). A row before a gap has the commands of the gap.

    Args:
        model: Whose body is moved.
        recordings: R of them.
        inputs: Their rows.
        coordinates: Recorded ones, shape (K + 1, joints, R).
    """
    rows, joints = coordinates.shape[:2]
    found = np.zeros((rows, len(recordings), joints, joints))
    counts = [_commands_in_rows(recording) for recording in recordings]
    if all(np.all(count == 1.0) for count in counts):
        return found
    slopes = answers_to_commands(model, inputs, coordinates)
    for r, (recording, count) in enumerate(zip(recordings, counts, strict=True)):
        noise = np.array([noise_of_means(recording, name) for name in model.plant.commands])
        moment = np.diff(recording.t) ** 2 * np.sqrt(recording.periods * (1.0 - count**-2.0) / (12.0 * count))
        moved = slopes[: len(count), r] * noise * moment[:, None, None]
        found[: len(count), r] = moved @ np.swapaxes(moved, 1, 2)
    return found


def _commands_in_rows(recording: Recording) -> np.ndarray:
    """How many commands of the controller act from each row to the next, shape (rows - 1,)."""
    return recording.periods * np.maximum(np.rint(np.diff(recording.t) * recording.rate), 1.0)
