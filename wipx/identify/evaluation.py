"""Judging a model: prediction errors over windows, and the predictions themselves."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.results import FitErrors, Trace
from wipx.identify.noise import LastingNoise
from wipx.identify.prediction import DIVERGED
from wipx.identify.smoothing import BANDWIDTHS, Smoother
from wipx.identify.starts import Starts, starts_of
from wipx.identify.windows import LEAD, LOOK_AHEAD, Windows, cut
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import Simulator

TRIAL = 0.25  # [s] between the predictions by which filters are compared
RIGHT = 3.0  # [rad/s] bandwidth of the filter that follows a right model
LEARNT = 1.5  # [s] of trials before which no filter is preferred to the usual one
USUAL = 3  # filter from which a prediction starts before any trial, among `BANDWIDTHS`
COURSES = 30  # of noise that lasts, by which its part of a floor is simulated
REMEMBERED = 8  # answers that may be asked for again

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Judge:
    """Predicts recordings window by window, contract section 4.

    The start of a prediction depends on how far the model is trusted (`Smoother`). If the model has no bandwidths of
    its own, they are learned along the recording: each prediction starts from the filter whose own predictions have
    erred least in the rows that it may see.

    Attributes:
        simulator: The engine.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        horizon: Length of a prediction [s].
        bandwidths: Of the filter for models that have none of their own, by coordinate [rad/s]; None for those that
            learn it.
        lasting: Noise of the sensors that lasts, beside the white one; None for none.
    """

    simulator: Simulator
    noise: np.ndarray
    horizon: float
    bandwidths: Mapping[str, float] | None = None
    lasting: LastingNoise | None = None
    _smoothers: list[Smoother] = field(default_factory=list, compare=False, repr=False)
    _answers: list[tuple[Any, Any]] = field(default_factory=list, compare=False, repr=False)

    def predict(self, model: Model, recordings: tuple[Recording, ...]) -> list[np.ndarray]:
        """Predicted coordinates of each recording, shape (rows, joints); NaN before the first window."""
        starts = self._starts(model, recordings)
        return _by_recording(starts.windows, self._predicted(model, starts), recordings)

    def from_same_states(self, model: Model, recordings: tuple[Recording, ...]) -> "FromSameStates":
        """Predictions by other simulators, each from the coordinates and rates that this model smooths."""
        starts = replace(self._starts(model, recordings), carried=None)
        return FromSameStates(self, model, starts, recordings)

    def compare(
        self, nominal: Model, completed: Model, recordings: tuple[Recording, ...], *, held_out: bool
    ) -> tuple[FitErrors, tuple[Trace, ...]]:
        """Errors of two models on the same windows, and what they predicted."""

        def compared() -> tuple[FitErrors, tuple[Trace, ...]]:
            return self._compared(nominal, completed, recordings, held_out=held_out)

        return self._once(compared, recordings, nominal, completed, held_out)

    def _once(self, answer: Callable[[], Answer], recordings: tuple[Recording, ...], *question: Any) -> Answer:
        """An answer about recordings, computed unless it is one of the latest."""
        self._smoother(question[0], recordings)  # keeps the recordings: their identities stay theirs
        asked = (
            self.simulator,
            self.horizon,
            self.bandwidths,
            self.lasting,
            [id(recording) for recording in recordings],
            *question,
        )
        known = next((found for other, found in self._answers if other == asked), None)
        if known is None:
            known = answer()
            self._answers.append((asked, known))
            del self._answers[:-REMEMBERED]
        return known

    def _compared(
        self, nominal: Model, completed: Model, recordings: tuple[Recording, ...], *, held_out: bool
    ) -> tuple[FitErrors, tuple[Trace, ...]]:
        plant = nominal.plant
        starts = self._starts(completed, recordings)
        windows = starts.windows
        before = self._predicted(nominal, self._starts(nominal, recordings))
        after = self._predicted(completed, starts)
        floor = self._floor(completed, starts, recordings)
        names = plant.coordinates
        errors = FitErrors(
            self.horizon,
            windows.count,
            dict(zip(names, _rms(windows, before - windows.recorded), strict=True)),
            dict(zip(names, _rms(windows, after - windows.recorded), strict=True)),
            dict(zip(names, _typical(windows, floor), strict=True)),
        )
        predicted = [_by_recording(windows, prediction, recordings) for prediction in (before, after)]
        traces = [
            self._trace(plant, recordings[i], windows, i, predicted[0][i], predicted[1][i], held_out=held_out)
            for i in range(len(recordings))
        ]
        return errors, tuple(traces)

    def tuned(self, model: Model, recordings: tuple[Recording, ...]) -> Model:
        """A model with the bandwidths of the filter from whose states it predicts recordings best."""
        return self._once(lambda: self._tuned(model, recordings), recordings, model)

    def _tuned(self, model: Model, recordings: tuple[Recording, ...]) -> Model:
        joints = len(self.noise)
        best = self._best_of(model, recordings, [np.full(joints, bandwidth) for bandwidth in BANDWIDTHS])
        for j in range(joints if joints > 1 else 0):
            others = [np.where(np.arange(joints) == j, bandwidth, best) for bandwidth in BANDWIDTHS]
            best = self._best_of(model, recordings, others)
        return replace(model, bandwidths=dict(zip(model.plant.coordinates, best.tolist(), strict=True)))

    def _best_of(self, model: Model, recordings: tuple[Recording, ...], bandwidths: list[np.ndarray]) -> np.ndarray:
        """The bandwidths of the least squared error."""
        windows = cut(recordings, model.plant, horizon=self.horizon, lead=LEAD)
        starts = starts_of(self._smoother(model, recordings), windows, model, bandwidths)
        errors = self._squares(self._replayed(model, starts, len(bandwidths)), windows)
        return bandwidths[int(np.argmin(errors[windows.predicted].sum(axis=0)))]

    def _smoother(self, model: Model, recordings: tuple[Recording, ...]) -> Smoother:
        for known in self._smoothers:
            same = len(known.recordings) == len(recordings)
            if same and all(one is other for one, other in zip(known.recordings, recordings, strict=True)):
                return known
        self._smoothers.append(Smoother(AnalyticSimulator(self.simulator.step), model.plant, recordings, self.noise))
        return self._smoothers[-1]

    def _starts(self, model: Model, recordings: tuple[Recording, ...]) -> Starts:
        """Windows of the recordings, each with the states of the filter that it starts from."""
        smoother = self._smoother(model, recordings)
        windows = cut(recordings, model.plant, horizon=self.horizon, lead=LEAD)
        bandwidths = model.bandwidths or self.bandwidths
        if bandwidths:
            known = np.array([bandwidths[name] for name in model.plant.coordinates])
            return starts_of(smoother, windows, model, [known])
        filters = [np.full(len(self.noise), bandwidth) for bandwidth in BANDWIDTHS]
        trials = cut(recordings, model.plant, horizon=self.horizon, lead=LEAD, stride=TRIAL)
        tried = starts_of(smoother, trials, model, filters)
        starts = starts_of(smoother, windows, model, filters)
        return starts.of(self._choice(model, tried, starts, len(filters)))

    def _choice(self, model: Model, tried: Starts, starts: Starts, count: int) -> np.ndarray:
        """Filter from which each window starts: that of the least error in the rows of trials that it may see."""
        errors = self._squares(self._replayed(model, tried, count), tried.windows)
        t, recording = tried.windows.inputs.t, tried.windows.recording
        chosen = np.full(len(starts.until), USUAL)
        for r, start in enumerate(starts.windows.starts):
            here = recording == starts.windows.recording[r]
            seen = (t <= start + LOOK_AHEAD) & here & tried.windows.predicted
            if start > tried.windows.starts[here].min() + LEARNT:
                chosen[r] = int(np.argmin(errors[seen].sum(axis=0)))
        return chosen

    def _squares(self, shown: np.ndarray, windows: Windows) -> np.ndarray:
        """Squared errors by the spread of each signal, the joints added, shape (K + 1, R, P)."""
        errors = shown - windows.recorded[:, :, None]
        sizes = np.ptp(np.moveaxis(windows.recorded, 1, 0)[:, windows.predicted], axis=1) + 1e-12
        scaled = np.nan_to_num(errors / sizes[:, None, None], nan=1.0, posinf=1.0, neginf=-1.0)
        return np.moveaxis(np.sum(np.clip(scaled, -1.0, 1.0) ** 2, axis=1), 1, 2)

    def _predicted(self, model: Model, starts: Starts) -> np.ndarray:
        """Predicted coordinates, shape (K + 1, joints, R); what fell over is held within bounds."""
        return self.bounded(self._replayed(model, starts, 1)[:, :, 0], starts.windows)

    def bounded(self, shown: np.ndarray, windows: Windows) -> np.ndarray:
        """Coordinates (K + 1, joints, R) no further from the recorded ones than a prediction that fell over counts."""
        recorded = windows.recorded
        rows = np.moveaxis(recorded, 1, 0)[:, windows.predicted]
        largest = (DIVERGED * np.ptp(rows, axis=1) + 1e3 * self.noise)[:, None]
        return recorded + np.clip(np.nan_to_num(shown - recorded, nan=np.inf), -largest, largest)

    def _replayed(self, model: Model, starts: Starts, count: int) -> np.ndarray:
        """Coordinates that a model shows from `count` starts of each window, shape (K + 1, joints, count, R)."""
        batch = ModelBatch(model, (), np.zeros((count, 0)))
        path = starts.path(batch)
        return self.simulator.replay(batch, starts.windows.inputs, path.states[0], path).coordinates

    def _floor(self, model: Model, starts: Starts, recordings: tuple[Recording, ...]) -> np.ndarray:
        """Deviation that sensor noise alone gives a right model's predictions, shape (K + 1, joints, R).

        A right model is followed by a slow filter, whose memory is a third of a second.
        """
        smoother = self._smoother(model, recordings)
        windows = starts.windows
        rows = windows.row + starts.until
        bandwidth = np.full(len(self.noise), RIGHT)
        places = smoother.places(rows, windows.recording, rows)
        followed = smoother.filtered(model, bandwidth)
        covariance, variance = followed.spread(places), self.noise**2
        if self.lasting is not None:
            drawn = smoother.drawn(self.lasting, COURSES) / followed.scale[:, None]
            covariance += followed.spread_by(drawn, places)
            variance = variance + np.square(self.lasting.deviations)
        factors = np.linalg.cholesky(covariance + 1e-18 * np.eye(covariance.shape[1]))
        base = self._replayed(model, starts, 1)
        variance = np.zeros_like(base[:, :, 0]) + variance[:, None]
        for i in range(factors.shape[2]):
            states = starts.states.copy()
            states[starts.until, :, 0, np.arange(windows.count)] += factors[:, :, i]
            moved = self._replayed(model, replace(starts, states=states), 1)
            variance += (moved - base)[:, :, 0] ** 2
        return np.sqrt(variance)

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


@dataclass(frozen=True)
class FromSameStates:
    """Windows of recordings that several simulators predict from one state each.

    Attributes:
        judge: Says what a window is.
        model: That smoothed the states.
        starts: Of all windows.
        recordings: What is predicted.
    """

    judge: Judge
    model: Model
    starts: Starts
    recordings: tuple[Recording, ...]

    def predicted(self, model: Model, simulator: Simulator) -> np.ndarray:
        """Coordinates that a model shows in a simulator, shape (K + 1, joints, R); what fell over is held in bounds."""
        path = self.starts.path(ModelBatch(self.model, (), np.zeros((1, 0))))
        shown = simulator.replay(ModelBatch(model), self.starts.windows.inputs, path.states[0], path).coordinates
        return self.judge.bounded(shown[:, :, 0], self.starts.windows)

    def errors(self, predicted: np.ndarray) -> dict[str, float]:
        """Root mean square errors by coordinate."""
        windows = self.starts.windows
        return dict(zip(self.model.plant.coordinates, _rms(windows, predicted - windows.recorded), strict=True))

    def floor(self) -> dict[str, float]:
        """Errors that a right model would have from the noise of the sensors alone."""
        deviations = self.judge._floor(self.model, self.starts, self.recordings)
        return dict(zip(self.model.plant.coordinates, _typical(self.starts.windows, deviations), strict=True))

    def by_recording(self, predicted: np.ndarray) -> list[np.ndarray]:
        """Predicted coordinates of each recording, shape (rows, joints); NaN before the first window."""
        return _by_recording(self.starts.windows, predicted, self.recordings)


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
