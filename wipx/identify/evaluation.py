"""Judging a model: prediction errors over windows, and the predictions themselves."""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.results import FitErrors, Trace
from wipx.identify.prediction import Predictor
from wipx.identify.windows import Windows, cut
from wipx.sim.simulator import Simulator


@dataclass(frozen=True)
class Judge:
    """Predicts recordings window by window, contract section 4.

    Attributes:
        simulator: The engine.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        horizon: Length of a prediction [s].
        lead: Time before a window's start from which its state is estimated [s].
    """

    simulator: Simulator
    noise: np.ndarray
    horizon: float
    lead: float

    def predict(self, model: Model, recordings: tuple[Recording, ...]) -> list[np.ndarray]:
        """Predicted coordinates of each recording, shape (rows, joints); NaN before the first window."""
        predictor = self._predictor(recordings, model.plant)
        return _by_recording(predictor.windows, predictor.predict(ModelBatch(model)).coordinates[:, :, 0], recordings)

    def compare(
        self, nominal: Model, completed: Model, recordings: tuple[Recording, ...], *, held_out: bool
    ) -> tuple[FitErrors, tuple[Trace, ...]]:
        """Errors of two models on the same windows, and what they predicted."""
        plant = nominal.plant
        predictor = self._predictor(recordings, plant)
        windows = predictor.windows
        before = predictor.predict(ModelBatch(nominal))
        after = predictor.predict(ModelBatch(completed), floor=True)
        assert after.floor is not None
        names = plant.coordinates
        errors = FitErrors(
            self.horizon,
            windows.count,
            dict(zip(names, _rms(windows, before.coordinates[:, :, 0] - windows.recorded), strict=True)),
            dict(zip(names, _rms(windows, after.coordinates[:, :, 0] - windows.recorded), strict=True)),
            dict(zip(names, _typical(windows, after.floor[:, :, 0]), strict=True)),
        )
        predicted = [
            _by_recording(windows, prediction.coordinates[:, :, 0], recordings) for prediction in (before, after)
        ]
        traces = [
            self._trace(plant, recordings[i], windows, i, predicted[0][i], predicted[1][i], held_out=held_out)
            for i in range(len(recordings))
        ]
        return errors, tuple(traces)

    def _predictor(self, recordings: tuple[Recording, ...], plant: Plant) -> Predictor:
        windows = cut(recordings, plant, horizon=self.horizon, lead=self.lead)
        return Predictor(self.simulator, windows, self.noise)

    def _trace(
        self,
        plant: Plant,
        recording: Recording,
        windows: Windows,
        index: int,
        nominal: np.ndarray,
        completed: np.ndarray,
        *,
        held_out: bool,
    ) -> Trace:
        names = plant.coordinates
        return Trace(
            recording.name,
            held_out,
            recording.t,
            {name: recording[name] for name in plant.commands},
            {name: recording[name] for name in names},
            {name: nominal[:, j] for j, name in enumerate(names)},
            {name: completed[:, j] for j, name in enumerate(names)},
            windows.starts[windows.recording == index],
        )


def _rms(windows: Windows, errors: np.ndarray) -> list[float]:
    """Root mean square over the predicted rows, of each joint."""
    counted = np.moveaxis(errors, 1, 0)[:, windows.predicted]
    return np.sqrt(np.mean(counted**2, axis=1)).tolist()


def _typical(windows: Windows, deviations: np.ndarray) -> list[float]:
    """Root mean square of the median window, of each joint.

    The median, because a joint on the verge of sticking has no linear answer to noise.
    """
    squares = np.where(windows.predicted[:, None, :], deviations**2, 0.0)
    means = squares.sum(axis=0) / windows.predicted.sum(axis=0)
    return np.sqrt(np.median(means, axis=1)).tolist()


def _by_recording(windows: Windows, predicted: np.ndarray, recordings: tuple[Recording, ...]) -> list[np.ndarray]:
    series = [np.full((len(r), predicted.shape[1]), np.nan) for r in recordings]
    for r in range(windows.count):
        rows = np.flatnonzero(windows.predicted[:, r])
        series[windows.recording[r]][windows.row[r] + rows] = predicted[rows, :, r]
    return series
