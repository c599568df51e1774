"""How well models predict recordings that no fit saw."""

from collections.abc import Mapping
from dataclasses import dataclass

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import HORIZON, FitErrors, Trace
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class Unseen:
    """Recordings to predict.

    Attributes:
        judge: Predicts them, with the sensor noise of the recordings that were fitted.
        recordings: That no fit saw.
    """

    judge: Judge
    recordings: tuple[Recording, ...]

    def errors(self, model: Model) -> Mapping[str, float]:
        """Root mean square errors of a model, by column [SI]."""
        return self.compare(model, model)[0].completed

    def noise_floor(self, model: Model) -> Mapping[str, float]:
        """Errors that a perfect model would have, from the sensor noise, by column [SI]."""
        return self.compare(model, model)[0].noise_floor

    def compare(self, nominal: Model, completed: Model) -> tuple[FitErrors, tuple[Trace, ...]]:
        """Errors of two models on the same windows, and what they predicted."""
        return self.judge.compare(nominal, completed, self.recordings, held_out=True)


def unseen(job: Job, fitted: RecordingSource, recordings: tuple[Recording, ...], horizon: float = HORIZON) -> Unseen:
    """Recordings to predict over `horizon` [s], beside the source of those that are fitted."""
    plant = fitted.describe().model.plant
    return Unseen(Judge(job.part("sim"), sensor_noise(fitted.load(), plant), horizon), recordings)
