"""Does the answer transfer: every recording judged by a model that was fitted to others."""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import FitErrors, Trace
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.identify.evaluation import Judge

STEPS = 3  # of refining values that are nearly right
FOLDS = 8  # at most; more recordings are left out in turn by several at once


@dataclass(frozen=True)
class Transfer:
    """A fit repeated without each fold of recordings in turn.

    Attributes:
        models: Completed model of each recording's fold, one per recording.
        likelihoods: Log-likelihood of each recording under its fold's model, shape (R,).
    """

    models: tuple[Model, ...]
    likelihoods: np.ndarray


@dataclass(frozen=True)
class HeldOut:
    """Judges fits by predictions of recordings that they were not fitted to.

    Attributes:
        judge: Predicts recordings.
        recordings: Of the robot.
    """

    judge: Judge
    recordings: tuple[Recording, ...]

    def transfers(self, fitter: Fitter, smaller: Fit, larger: Fit) -> bool:
        """Whether a fit with more effects predicts held-out recordings about as well as one with fewer."""
        return self.gain(fitter, transfer(fitter, larger), smaller) > -fitter.rules.confirmation.tolerated

    def gain(self, fitter: Fitter, repeated: Transfer, reduced: Fit) -> float:
        """Share of the squared prediction error that an effect removes from recordings it was not fitted to.

        The fit without it knows these recordings. If it predicts them better, which may be for that reason, it is
        repeated without them too.

        Args:
            fitter: Of both.
            repeated: The fit with the effect.
            reduced: The fit without it.
        """
        after = self.error(repeated)
        before = self._squared_error(self.judge.predict(reduced.hypothesis.model, self.recordings), repeated)
        if after > before:
            before = self.error(transfer(fitter, reduced))
        return 1.0 - after / before if before > 0.0 else 0.0

    def error(self, repeated: Transfer) -> float:
        """Sum of the squared prediction errors, in units of the sensor noise, on recordings left out of the fit."""
        folds = zip(repeated.models, self.recordings, strict=True)
        predicted = [self.judge.predict(model, (recording,))[0] for model, recording in folds]
        return self._squared_error(predicted, repeated)

    def _squared_error(self, predicted: list[np.ndarray], repeated: Transfer) -> float:
        columns = repeated.models[0].plant.coordinates
        return sum(
            float(np.nansum(((coordinates - recording.stack(columns)) / self.judge.noise) ** 2))
            for recording, coordinates in zip(self.recordings, predicted, strict=True)
        )


def transfer(fitter: Fitter, fit: Fit) -> Transfer:
    """Leave out each recording, or folds of them; one alone is judged by the model that was fitted to it."""
    count = len(fitter.data.recordings)
    cubes = [fit.hypothesis.cube] * count
    if count > 1 and len(fit.hypothesis.cube):
        folds = [range(k, count, FOLDS) for k in range(min(FOLDS, count))]
        found = [fitter.without(*fold).fit(fit.hypothesis, fit.levels, steps=STEPS).hypothesis.cube for fold in folds]
        cubes = [found[r % FOLDS] for r in range(count)]
    space = fit.hypothesis.space
    batch = space.batch(np.stack(cubes))
    white = fitter.white_of(fit, batch).reshape(count, *fit.white.shape)
    likelihoods = np.array([fitter.by_recording(fit, each)[r] for r, each in enumerate(white)])
    return Transfer(tuple(fit.hypothesis.at(cube).model for cube in cubes), likelihoods)


def judged(
    judge: Judge, nominal: Model, models: tuple[Model, ...], recordings: tuple[Recording, ...]
) -> tuple[FitErrors, tuple[Trace, ...]]:
    """Prediction errors and traces of each recording, by the model of its fold."""
    if all(model == models[0] for model in models):
        return judge.compare(nominal, models[0], recordings, held_out=True)
    parts = [
        judge.compare(nominal, model, (recording,), held_out=True)
        for model, recording in zip(models, recordings, strict=True)
    ]
    return joined([errors for errors, _ in parts]), tuple(trace for _, traces in parts for trace in traces)


def joined(parts: list[FitErrors]) -> FitErrors:
    """Errors of several sets of windows together."""
    weights = np.array([part.windows for part in parts], dtype=float)

    def mean(which: str) -> dict[str, float]:
        values = [getattr(part, which) for part in parts]
        return {
            name: float(np.sqrt(np.average([value[name] ** 2 for value in values], weights=weights)))
            for name in values[0]
        }

    return FitErrors(parts[0].horizon, int(weights.sum()), mean("nominal"), mean("completed"), mean("noise_floor"))
