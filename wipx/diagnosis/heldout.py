"""Does the answer transfer: every recording judged by a model that was fitted to the others."""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import FitErrors, Trace
from wipx.diagnosis.fitting import Fit, Fitter
from wipx.identify.evaluation import Judge

STEPS = 3  # of refining values that are nearly right


@dataclass(frozen=True)
class Transfer:
    """A fit repeated without each recording in turn.

    Attributes:
        models: Completed model of each fold, one per recording.
        likelihoods: Log-likelihood of each recording under its fold's model, shape (R,).
    """

    models: tuple[Model, ...]
    likelihoods: np.ndarray


def transfer(fitter: Fitter, fit: Fit) -> Transfer:
    """Leave out each recording; one alone is judged by the model that was fitted to it."""
    log = fitter.follower.log
    count = len(log.recordings)
    cubes = [fit.hypothesis.cube] * count
    if count > 1 and len(fit.hypothesis.cube):
        cubes = [_without(fitter, fit, r) for r in range(count)]
    space = fit.hypothesis.space
    batch = space.batch(np.stack(cubes))
    white = fitter.white_of(fit, batch).reshape(count, *fit.white.shape)
    own = np.stack([white[r, r] for r in range(count)])
    models = tuple(fit.hypothesis.at(cube).model for cube in cubes)
    return Transfer(models, row_likelihoods(fitter, fit, own).sum(axis=1))


def row_likelihoods(fitter: Fitter, fit: Fit, white: np.ndarray) -> np.ndarray:
    """Log-likelihood of every row, shape (R, K + 1), for white innovations (R, m, K + 1) of a fit's observer."""
    log = fitter.follower.log
    gains = fitter.follower.gains(fit.levels, fit.hypothesis.model)
    diagonal = np.einsum("krcc->rkc", gains.whitening)
    scale = np.where(log.counted.T, np.log(np.where(diagonal > 0.0, diagonal, 1.0)).sum(axis=2), 0.0)
    scale += log.counted.T * np.log(np.diag(fit.colour.whitening)).sum()
    return scale - 0.5 * np.sum(white**2, axis=1)


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


def _without(fitter: Fitter, fit: Fit, recording: int) -> np.ndarray:
    """Best position in the cube without one recording, shape (D,)."""
    follower = fitter.follower
    others = Fitter(replace(follower, log=replace(follower.log, left_out=recording)))
    return others.fit(fit.hypothesis, fit.levels, steps=STEPS).hypothesis.cube
