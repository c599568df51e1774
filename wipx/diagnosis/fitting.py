"""Maximum likelihood: the parameters and the noise with which a hypothesis explains recordings best.

Prediction-error method (Ljung 1999, System Identification, ch. 7): Levenberg-Marquardt steps on white
innovations with observer and colour held fixed, in turn with a search over the noise levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.follower import Follower
from wipx.diagnosis.hypothesis import Hypothesis
from wipx.diagnosis.observer import Gains, NoiseLevels
from wipx.diagnosis.whiteness import Colour, colour_of, whitened

FIRST_STEP = 1e-4  # of the search interval, for the first slopes
LARGEST_STEP = 0.02
SECANT = 0.3  # standard deviations over which later slopes are taken
DAMPINGS = np.array([0.0, 0.03, 1.0, 30.0])  # relative, tried at once
SETTLED = 0.05  # nats per step at which a refinement ends
LEVEL_STEPS = (1.5, 0.75, 0.375)  # of the noise levels' logarithms
LEVEL_RANGE = 14.0  # of the same, about the first guess
LEVEL_GAIN = 0.3  # nats at which a round of the search goes on
THRESHOLDS = ("dead_zone", "saturation", "speed_limit")  # answer to single commands, not to their mean
SPREAD = 1.15  # factor by which the spread of single commands is changed first, ever more as long as it gains
POLISHED = 0.5  # nats at which alternating ends


@dataclass(frozen=True)
class Fit:
    """A hypothesis fitted to recordings.

    Attributes:
        hypothesis: With its best values.
        levels: Noise levels.
        colour: Of its innovations.
        white: White innovations, shape (R, m, K + 1); zero at rows that do not count.
        rows: Number of rows that count.
        jacobian: Slopes of `white` by the position in the cube, and of the priors, shape (R m (K + 1) + priors, D).
        log_likelihood: Of the recordings, with the priors', up to a constant that all hypotheses share.
    """

    hypothesis: Hypothesis
    levels: NoiseLevels
    colour: Colour
    white: np.ndarray
    rows: int
    jacobian: np.ndarray
    log_likelihood: float

    @property
    def motion_likelihood(self) -> float:
        """Log-likelihood without that of forces which the drives report."""
        return self.log_likelihood - self.colour.reported

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects of the hypothesis."""
        return self.hypothesis.effects

    @cached_property
    def slope(self) -> np.ndarray:
        """Slope of the negative log-likelihood by the position in the cube, shape (D,)."""
        residual = np.concatenate([self.white.ravel(), self.hypothesis.space.prior_residuals(self.hypothesis.cube)[0]])
        return self.jacobian.T @ residual

    @property
    def free(self) -> np.ndarray:
        """Which numbers no bound keeps from better values, shape (D,)."""
        cube = self.hypothesis.cube
        return ~((cube <= 0.0) & (self.slope > 0.0) | (cube >= 1.0) & (self.slope < 0.0))

    @cached_property
    def information(self) -> np.ndarray:
        """Inverse covariance of the position in the cube, shape (D, D)."""
        return self.jacobian.T @ self.jacobian


@dataclass(frozen=True)
class Fitter:
    """Fits hypotheses to the recordings of a follower."""

    follower: Follower

    def fit(self, hypothesis: Hypothesis, levels: NoiseLevels, *, steps: int = 6) -> Fit:
        """The best values at given noise levels, from the hypothesis' own values on.

        Args:
            hypothesis: Where to start.
            levels: Noise.
            steps: Levenberg-Marquardt steps at most.
        """
        here = self._started(hypothesis, levels)
        if not len(hypothesis.cube):
            return here
        for _ in range(steps):
            deviations = 1.0 / np.sqrt(np.maximum(np.sum(here.jacobian**2, axis=0), 1e-12))
            there = self._best_of(here, self._proposals(here))
            gain = there.log_likelihood - here.log_likelihood
            here = self._resloped(there if gain > 0.0 else here, np.clip(SECANT * deviations, 1e-6, LARGEST_STEP))
            if gain < SETTLED:
                break
        return here

    def polished(self, fit: Fit, *, rounds: int = 4) -> Fit:
        """Noise levels and values in turn until neither gains more."""
        for _ in range(rounds):
            before = fit.log_likelihood
            fit = self._with_best_spread(self.fit(fit.hypothesis, self.levels_of(fit)))
            if fit.log_likelihood - before < POLISHED:
                break
        return fit

    def levels_of(self, fit: Fit) -> NoiseLevels:
        """Noise levels that make the recordings likeliest, by a pattern search on their logarithms.

        The levels' common factor does not matter: the first sensor's level is kept.

        Args:
            fit: Where to start.
        """
        fixed = len(fit.levels.force)
        levels = self.spread_for(fit.hypothesis.model, fit.levels)
        search = _LevelSearch(self, fit.hypothesis, levels)
        centre = best = _logarithms(levels)
        free = [i for i in range(len(best)) if i != fixed]
        for step in LEVEL_STEPS:
            move = np.zeros_like(best)
            for _ in range(12):
                trials = [best + sign * step * np.eye(len(best))[i] for i in free for sign in (-1.0, 1.0)]
                if np.count_nonzero(move) > 1:
                    trials.append(best + move)
                trials = [np.clip(trial, centre - LEVEL_RANGE, centre + LEVEL_RANGE) for trial in trials]
                likelihoods = search.likelihoods([best, *trials])
                gains = likelihoods[1:] - likelihoods[0]
                move = _joined(gains[: 2 * len(free)], step, free, len(best))
                if gains.max() <= LEVEL_GAIN:
                    break
                best = trials[int(gains.argmax())]
        return _levels(best, levels)

    def spread_for(self, model: Model, levels: NoiseLevels) -> NoiseLevels:
        """Levels for a model, with a first guess of the spread of single commands where its drive has a threshold."""
        kinds = {name.partition("/")[2] for name in model.effects}
        matters = self.follower.log.has_means and not kinds.isdisjoint(THRESHOLDS)
        if matters == (levels.spread > 0.0):
            return levels
        return replace(levels, spread=1.0 if matters else 0.0)

    def _with_best_spread(self, fit: Fit) -> Fit:
        """A fit with the spread of single commands that suits it best, where it has one.

        Thresholds are tied to the spread, so the values follow it at every try.
        """
        for factor in (SPREAD, 1.0 / SPREAD) if fit.levels.spread > 0.0 else ():
            change = factor
            while True:
                there = self._at_spread(fit, change)
                if there.log_likelihood > fit.log_likelihood + LEVEL_GAIN:
                    fit, change = there, change**2
                elif change != factor:
                    change = factor
                else:
                    break
        return fit

    def _at_spread(self, fit: Fit, change: float) -> Fit:
        levels = replace(fit.levels, spread=change * fit.levels.spread)
        return self.fit(fit.hypothesis, levels, steps=3)

    def white_of(self, fit: Fit, batch: ModelBatch) -> np.ndarray:
        """White innovations of other models, with observer and colour of a fit, shape (P, R m (K + 1))."""
        gains = self.follower.gains(fit.levels, fit.hypothesis.model)
        innovations = self._followed(batch, gains, fit.levels)
        return whitened(innovations, fit.colour, self.follower.log).reshape(batch.size, -1)

    def _started(self, hypothesis: Hypothesis, levels: NoiseLevels) -> Fit:
        """The values of a hypothesis as they are, with first slopes."""
        cubes = _around(hypothesis.cube, np.full(len(hypothesis.cube), FIRST_STEP))
        innovations = self._innovations(hypothesis, cubes, levels)
        return self._with_slopes(self._likeliest(hypothesis, levels, cubes[:1], innovations[:1]), cubes, innovations)

    def _resloped(self, fit: Fit, size: np.ndarray) -> Fit:
        """A fit with slopes over steps of the position in the cube, shape (D,)."""
        cubes = _around(fit.hypothesis.cube, size)
        return self._with_slopes(fit, cubes, self._innovations(fit.hypothesis, cubes, fit.levels))

    def _with_slopes(self, fit: Fit, cubes: np.ndarray, innovations: np.ndarray) -> Fit:
        """A fit with slopes of white innovations and priors, from the positions around it and their innovations."""
        white = whitened(innovations, fit.colour, self.follower.log).reshape(len(cubes), -1)
        rows = np.concatenate([white, fit.hypothesis.space.prior_residuals(cubes)], axis=1)
        return replace(fit, jacobian=((rows[1:] - rows[0]) / np.diag(cubes[1:] - cubes[0])[:, None]).T)

    def _best_of(self, fit: Fit, cubes: np.ndarray) -> Fit:
        """The likeliest of several positions in the cube, without slopes."""
        innovations = self._innovations(fit.hypothesis, cubes, fit.levels)
        return self._likeliest(fit.hypothesis, fit.levels, cubes, innovations)

    def _likeliest(
        self, hypothesis: Hypothesis, levels: NoiseLevels, cubes: np.ndarray, innovations: np.ndarray
    ) -> Fit:
        """The likeliest of several positions in the cube by their innovations (P, R, m, K + 1), without slopes."""
        log = self.follower.log
        colours = [colour_of(each, log) for each in innovations]
        priors = hypothesis.space.prior_residuals(cubes)
        scale = _log_determinant(self.follower.gains(levels, hypothesis.model).whitening, log)
        likelihoods = [scale + c.log_likelihood - 0.5 * float(p @ p) for c, p in zip(colours, priors, strict=True)]
        i = int(np.argmax(likelihoods))
        white = whitened(innovations[i : i + 1], colours[i], log)[0]
        slopes = np.zeros((white.size + priors.shape[1], cubes.shape[1]))
        best = hypothesis.at(cubes[i])
        return Fit(best, levels, colours[i], white, int(log.counted.sum()), slopes, likelihoods[i])

    def likeliest(self, hypotheses: Sequence[Hypothesis], levels: NoiseLevels, count: int) -> list[Hypothesis]:
        """The likeliest few of hypotheses of the same effects, as they are."""
        return [hypotheses[i] for i in np.argsort(-self.likelihoods_of(hypotheses, levels))[:count]]

    def likelihoods_of(self, hypotheses: Sequence[Hypothesis], levels: NoiseLevels) -> np.ndarray:
        """Log-likelihoods of hypotheses of the same effects, as they are."""
        cubes = np.stack([hypothesis.cube for hypothesis in hypotheses])
        gains = [self.follower.gains(levels, hypothesis.model) for hypothesis in hypotheses]
        alike = np.array([next(i for i, other in enumerate(gains) if other is own) for own in gains])
        different, group = np.unique(alike, return_inverse=True)
        observers = tuple(gains[i] for i in different)
        batch = hypotheses[0].space.batch(cubes)
        innovations = self.follower.innovations(batch, observers, group, np.full(batch.size, levels.spread))
        scales = [_log_determinant(observer.whitening, self.follower.log) for observer in observers]
        priors = 0.5 * np.sum(hypotheses[0].space.prior_residuals(cubes) ** 2, axis=1)
        log = self.follower.log
        likelihoods = np.array([colour_of(each, log).log_likelihood for each in innovations]) - priors
        return likelihoods + np.array(scales)[group]

    def _innovations(self, hypothesis: Hypothesis, cubes: np.ndarray, levels: NoiseLevels) -> np.ndarray:
        gains = self.follower.gains(levels, hypothesis.model)
        return self._followed(hypothesis.space.batch(cubes), gains, levels)

    def _followed(self, batch: ModelBatch, gains: Gains, levels: NoiseLevels) -> np.ndarray:
        same = np.zeros(batch.size, dtype=np.int64)
        return self.follower.innovations(batch, (gains,), same, np.full(batch.size, levels.spread))

    def _proposals(self, fit: Fit) -> np.ndarray:
        """Positions to try next, one for each damping, within the cube."""
        cube = fit.hypothesis.cube
        free = np.flatnonzero(fit.free)
        proposals = np.repeat(cube[None], len(DAMPINGS), axis=0)
        if not len(free):
            return proposals[:1]
        normal = fit.information[np.ix_(free, free)]
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
        scaled = normal / np.outer(scale, scale)
        for i, damping in enumerate(DAMPINGS):
            step = np.linalg.solve(scaled + (damping + 1e-9) * np.eye(len(free)), fit.slope[free] / scale) / scale
            proposals[i, free] -= step
        return np.clip(proposals, 0.0, 1.0)

    def likelihoods(self, hypothesis: Hypothesis, levels: Sequence[NoiseLevels]) -> list[float]:
        """Log-likelihoods of one model with several noise levels."""
        log = self.follower.log
        gains = self.follower.gains_of(levels, hypothesis.model)
        count = len(levels)
        batch = hypothesis.space.batch(np.repeat(hypothesis.cube[None], count, axis=0))
        spread = np.array([level.spread for level in levels])
        innovations = self.follower.innovations(batch, gains, np.arange(count), spread)
        priors = hypothesis.space.prior_residuals(hypothesis.cube)[0]
        return [
            _log_determinant(g.whitening, log) + colour_of(each, log).log_likelihood - 0.5 * float(priors @ priors)
            for g, each in zip(gains, innovations, strict=True)
        ]


@dataclass(frozen=True)
class _LevelSearch:
    """Likelihoods of one model by the logarithms of noise levels, each asked for once."""

    fitter: Fitter
    hypothesis: Hypothesis
    levels: NoiseLevels
    known: dict[tuple[float, ...], float] = field(default_factory=dict)

    def likelihoods(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Log-likelihoods of points; those that are not known yet are simulated at once."""
        fresh = {_key(point): point for point in points if _key(point) not in self.known}
        if fresh:
            levels = [_levels(point, self.levels) for point in fresh.values()]
            self.known.update(zip(fresh, self.fitter.likelihoods(self.hypothesis, levels), strict=True))
        return np.array([self.known[_key(point)] for point in points])


def _key(point: np.ndarray) -> tuple[float, ...]:
    """Logarithms of levels, free of rounding."""
    return tuple(np.round(point, 6).tolist())


def _around(cube: np.ndarray, size: np.ndarray) -> np.ndarray:
    """A position in the cube, and a step from it along each axis away from the nearer bound, shape (D + 1, D)."""
    return np.concatenate([cube[None], cube + np.diag(np.where(cube > 0.5, -size, size))])


def _logarithms(levels: NoiseLevels) -> np.ndarray:
    return np.log(np.concatenate([levels.force, levels.sensor]))


def _levels(logarithms: np.ndarray, like: NoiseLevels) -> NoiseLevels:
    values = np.exp(logarithms)
    joints = len(like.force)
    return NoiseLevels(values[:joints], values[joints:], like.spread)


def _joined(gains: np.ndarray, step: float, free: list[int], count: int) -> np.ndarray:
    """All single moves that gained, made at once; gains in pairs (-, +) for each free level."""
    move = np.zeros(count)
    for i, index in enumerate(free):
        down, up = gains[2 * i], gains[2 * i + 1]
        if max(down, up) > 0.0:
            move[index] = step if up > down else -step
    return move


def _log_determinant(whitening: np.ndarray, log) -> float:
    """Sum of log det of the whitening over the rows that count."""
    diagonal = np.einsum("krcc->krc", whitening)[log.counted]
    return float(np.log(diagonal.prod(axis=1)).sum())
