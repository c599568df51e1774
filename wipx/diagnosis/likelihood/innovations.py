"""Evidence of one row ahead: the likelihood of innovations, with the noise that suits a hypothesis best.

Levenberg-Marquardt steps with observer and noise model held fixed, in turn with a search over the noise levels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from wipx.core.effect import Effect
from wipx.core.model import Model, ModelBatch
from wipx.core.parameters import Scales
from wipx.diagnosis.likelihood import nonsmooth_search
from wipx.diagnosis.likelihood.fitting import CONVERGED, Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.noise_model import NoiseModel, noise_model_of, whitened
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import stretches
from wipx.diagnosis.rules import USUAL, EvidenceRules, Rules
from wipx.sim.analytic import AnalyticSimulator

LEVEL_STEPS = (1.5, 0.75, 0.375)  # of the noise levels' logarithms
LEVEL_RANGE = 14.0  # of the same, about the first guess
LEVEL_GAIN = 0.3  # nats at which a round of the search goes on
LOUDER = 30.0  # times the noise of the forces, from which a fit is searched once more


@dataclass(frozen=True)
class InnovationFitter(Fitter):
    """Fits hypotheses to innovations.

    Attributes:
        innovations_model: Of the recordings.
        rules: What decides.
        joints: Whose noise is searched for; empty for that of all joints.
    """

    steps = 5
    close_call = 60.0
    exchanges = 2

    innovations_model: InnovationsModel
    rules: Rules = USUAL
    joints: tuple[int, ...] = ()

    @property
    def own_rules(self) -> EvidenceRules:
        """Those of innovations."""
        return self.rules.innovations

    def looks_for(self, name: str, effect: Effect) -> bool:
        """Those of the contract."""
        return not effect.is_outside(self.data.plant)

    @property
    def data(self) -> RecordingBatch:
        """The recordings."""
        return self.innovations_model.data

    @property
    def simulator(self) -> AnalyticSimulator:
        """The engine."""
        return self.innovations_model.simulator

    @property
    def rows(self) -> int:
        """Rows that count."""
        return int(self.data.counted.sum())

    @cached_property
    def blocks(self) -> np.ndarray:
        """Number of the stretch of time of every innovation, shape (R, m, K + 1)."""
        return np.repeat(stretches(self.data)[:, None], self.data.signals, axis=1)

    @property
    def runs(self) -> np.ndarray:
        """Number of the recording of every innovation, shape (R, m, K + 1)."""
        return np.broadcast_to(np.arange(len(self.blocks))[:, None, None], self.blocks.shape)

    def refined(self) -> "InnovationFitter":
        """The same with half the step of the simulator."""
        finer = replace(self.simulator, step=0.5 * self.simulator.step)
        return replace(self, innovations_model=replace(self.innovations_model, simulator=finer))

    def without(self, *recordings: int) -> "InnovationFitter":
        """The same with recordings that do not count."""
        data = replace(self.data, left_out=recordings)
        return replace(self, innovations_model=replace(self.innovations_model, data=data))

    def without_reports(self) -> "InnovationFitter":
        """The same with logs in which no drive reports its force."""
        data = replace(self.data, reported=self.data.reported[:, :0])
        return replace(self, innovations_model=replace(self.innovations_model, data=data))

    def beside(self, setting: Setting) -> "InnovationFitter":
        """The same for one part of a robot: noise is searched for on its joint; on all joints if it has none."""
        own = (j for j, joint in enumerate(self.data.plant.joints) if setting.sites and joint in setting.sites)
        return replace(self, joints=tuple(own))

    def required_beyond_penalty(self, smaller: Fit, larger: Fit, explained: float) -> float:
        """So much that no search over many effects finds it by chance, and a share of what is explained."""
        added = [effect for effect in larger.effects if effect not in smaller.effects]
        rules = self.rules.selection
        share = rules.nonsmooth_share if nonsmooth_search.leaves_open(smaller, added) else rules.least_share
        return max(rules.least_gain, min(share * explained, rules.most_asked))

    def odds_of(self, effects: tuple[str, ...]) -> float:
        """Nothing: where laws hold, there is evidence enough."""
        return 0.0

    def holds(self, smaller: Fit, larger: Fit) -> bool:
        """Always: where laws hold, their likelihood says all."""
        return True

    def lead(self, fit: Fit, other: Fit, score: float) -> float:
        """The penalised evidence."""
        return score

    def separation(self, fit: Fit, rival: Fit, lead: float, overstated: float) -> float:
        """As if one number more made the difference: a likelihood ratio."""
        if self.are_alike(fit, rival):
            return 0.0
        return float(np.sqrt(max(2.0 * lead / overstated, 0.0)))

    def asks_for_force(self, force: np.ndarray, scales: Mapping[str, Scales]) -> np.ndarray:
        """On which joints the observer asks for forces beside those of all laws, shape (joints,).

        Args:
            force: Standard deviations of white forces that a fit leaves, shape (joints,), spectral.
            scales: Characteristic sizes by site.
        """
        usual = np.array([scales[site].force for site in self.data.plant.joints])
        return force > self.rules.trust.quiet * usual

    def foretold(self, fit: Fit) -> np.ndarray:
        """Share of the variance of each coordinate's innovations that earlier ones foretell, shape (joints,).

        What a right model leaves is white (Kailath 1968, IEEE Trans. Automatic Control 13(6)): hardly any.
        """
        model, channels = fit.hypothesis.model, np.flatnonzero(self.data.channels < self.data.joints)
        errors = self.errors_of(ModelBatch(model), fit.levels, model)[0][:, channels]  # (R, joints, K + 1)
        rows = self.data.counted.T[:, None]
        left = 1.0 / np.diag(fit.noise.whitening)[channels] ** 2
        return 1.0 - left * rows.sum() / np.maximum(np.sum(errors**2 * rows, axis=(0, 2)), 1e-300)

    def escape_levels(self, fit: Fit) -> NoiseLevels:
        """Forces that explain a misfit make it hard to leave: louder ones make the likelihood smoother."""
        joints = list(self.joints) or slice(None)
        force = fit.levels.force.copy()
        force[joints] *= LOUDER
        return replace(fit.levels, force=force)

    def seen_by_row(self, fit: Fit) -> "tuple[InnovationFitter, Fit]":
        """The fit itself."""
        return self, fit

    def sketched_by_row(self, fit: Fit) -> "tuple[InnovationFitter, Fit]":
        """The fit itself."""
        return self, fit

    def by_recording(self, fit: Fit, white: np.ndarray) -> np.ndarray:
        """Log-likelihood of each recording, shape (R,), for white innovations (R, m, K + 1)."""
        diagonal = np.einsum("krcc->rkc", self.innovations_model.gains(fit.levels, fit.hypothesis.model).whitening)
        counted = self.data.counted.T
        scale = np.where(counted, np.log(np.where(diagonal > 0.0, diagonal, 1.0)).sum(axis=2), 0.0)
        scale += counted * np.log(np.diag(fit.noise.whitening)).sum()
        return np.sum(scale - 0.5 * np.sum(white**2, axis=1), axis=1)

    def errors_of(self, batch: ModelBatch, levels: NoiseLevels, model: Model) -> np.ndarray:
        """Innovations, shape (P, R, m, K + 1)."""
        gains = self.innovations_model.gains(levels, model)
        return self.innovations_model.innovations(batch, (gains,), np.zeros(batch.size, dtype=np.int64))

    def noise_of(self, errors: np.ndarray, levels: NoiseLevels, model: Model) -> list[NoiseModel]:
        """The noise model of each model's innovations."""
        scale = _log_determinants(self.innovations_model.gains(levels, model).whitening, self.data)
        found = [noise_model_of(each, self.data) for each in errors]
        return [replace(noise_model, by_group=noise_model.by_group + scale) for noise_model in found]

    def whitened(self, errors: np.ndarray, noise: NoiseModel) -> np.ndarray:
        """White innovations, shape (P, R, m, K + 1)."""
        return whitened(errors, noise, self.data)

    def first_fit(self, hypothesis: Hypothesis, levels: NoiseLevels) -> Fit:
        """From noise levels of another fit on, which may be far off."""
        return self._alternated(self.fit(hypothesis, levels), afresh=True)

    def converged(self, fit: Fit, *, rounds: int = 4) -> Fit:
        """Noise levels and values in turn until neither gains more."""
        return self._alternated(fit, rounds)

    def _alternated(self, fit: Fit, rounds: int = 4, *, afresh: bool = False) -> Fit:
        for k in range(rounds):
            before = fit.log_likelihood
            steps = LEVEL_STEPS if k == 0 else LEVEL_STEPS[-1:]
            fit = self.refit(fit, self.levels_of(fit, steps, afresh=afresh and k == 0))
            if fit.log_likelihood - before < CONVERGED:
                break
        return fit

    def levels_of(self, fit: Fit, steps: Sequence[float] = LEVEL_STEPS, *, afresh: bool = False) -> NoiseLevels:
        """Noise levels that make the recordings likeliest, by a pattern search on their logarithms.

        Groups of channels are searched side by side: what a level does to the likelihood of another group is left
        aside in a step, but the step must make all of them likelier together. A common factor of a group's levels does
        not matter: the first sensor's is kept.

        Args:
            fit: Where to start.
            steps: Of the logarithms, the longest first.
            afresh: Whether the levels may be far off. Then they are also changed one by one where no step of all gains.
        """
        search = _LevelSearch(self, fit.hypothesis, fit.levels)
        centre = best = _logarithms(fit.levels)
        free = self._free_levels
        for step in steps:
            move = np.zeros_like(best)
            for _ in range(12):
                moves = _single_moves(free, step, len(best))
                if np.count_nonzero(move) > 1:
                    moves.append(move)
                trials = [np.clip(best + each, centre - LEVEL_RANGE, centre + LEVEL_RANGE) for each in moves]
                likelihoods = search.likelihoods([best, *trials])
                if len(free) == 1:
                    likelihoods = likelihoods.sum(axis=1, keepdims=True)
                gains = likelihoods[1:] - likelihoods[0]
                move = _joined(gains, moves, free)
                there = search.likelier([_best_of_each(gains, trials, best, free)], best)
                if there is None and afresh and len(free) > 1:
                    there = search.changed_alone(best, np.concatenate(free), step, centre)
                if there is None:
                    break
                best = there
        return fit.levels if best is centre else _levels(best, fit.levels)

    @cached_property
    def _free_levels(self) -> tuple[tuple[int, ...], ...]:
        """Which levels are searched for each group of channels: all of its joints and channels but the first sensor."""
        data, joints = self.data, self.data.joints
        forces = [[int(data.channels[c]) for c in group if data.channels[c] < joints] for group in data.groups]
        return tuple(
            (*own, *(joints + c for c in group[1:]))
            for own, group in zip(forces, data.groups, strict=True)
            if not self.joints or set(own) & set(self.joints)
        )

    def likelihoods_of(self, hypotheses: Sequence[Hypothesis], levels: NoiseLevels) -> np.ndarray:
        """Log-likelihoods of hypotheses of the same effects, as they are."""
        cubes = np.stack([hypothesis.cube for hypothesis in hypotheses])
        gains = [self.innovations_model.gains(levels, hypothesis.model) for hypothesis in hypotheses]
        alike = np.array([next(i for i, other in enumerate(gains) if other is own) for own in gains])
        different, group = np.unique(alike, return_inverse=True)
        observers = tuple(gains[i] for i in different)
        batch = hypotheses[0].space.batch(cubes)
        innovations = self.innovations_model.innovations(batch, observers, group)
        scales = [_log_determinants(observer.whitening, self.innovations_model.data).sum() for observer in observers]
        priors = 0.5 * np.sum(hypotheses[0].space.prior_residuals(cubes) ** 2, axis=1)
        data = self.innovations_model.data
        likelihoods = np.array([noise_model_of(each, data).log_likelihood for each in innovations]) - priors
        return likelihoods + np.array(scales)[group]

    def likelihoods(self, hypothesis: Hypothesis, levels: Sequence[NoiseLevels]) -> list[np.ndarray]:
        """Log-likelihoods of one model with several noise levels, of each group of channels, shape (G,) each.

        The first group bears those of priors and reported forces.
        """
        data = self.innovations_model.data
        gains = self.innovations_model.gains_of(levels, hypothesis.model)
        count = len(levels)
        batch = hypothesis.space.batch(np.repeat(hypothesis.cube[None], count, axis=0))
        innovations = self.innovations_model.innovations(batch, gains, np.arange(count))
        priors = hypothesis.space.prior_residuals(hypothesis.cube)[0]
        found = []
        for g, each in zip(gains, innovations, strict=True):
            noise_model = noise_model_of(each, data)
            found.append(_log_determinants(g.whitening, data) + noise_model.by_group)
            found[-1][0] += noise_model.reported - 0.5 * float(priors @ priors)
        return found


@dataclass(frozen=True)
class _LevelSearch:
    """Likelihoods of one model by the logarithms of noise levels, each asked for once."""

    fitter: InnovationFitter
    hypothesis: Hypothesis
    levels: NoiseLevels
    known: dict[tuple[float, ...], np.ndarray] = field(default_factory=dict)

    def likelihoods(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """Log-likelihoods of points by group, (points, G); those that are not known yet are simulated at once."""
        fresh = {_key(point): point for point in points if _key(point) not in self.known}
        if fresh:
            levels = [_levels(point, self.levels) for point in fresh.values()]
            self.known.update(zip(fresh, self.fitter.likelihoods(self.hypothesis, levels), strict=True))
        return np.array([self.known[_key(point)] for point in points])

    def likelier(self, points: Sequence[np.ndarray], base: np.ndarray) -> np.ndarray | None:
        """The likeliest of points, if it is so by more than `LEVEL_GAIN` than a base."""
        totals = self.likelihoods([base, *points]).sum(axis=1)
        i = int(totals[1:].argmax())
        return points[i] if totals[1 + i] > totals[0] + LEVEL_GAIN else None

    def changed_alone(self, base: np.ndarray, free: np.ndarray, step: float, centre: np.ndarray) -> np.ndarray | None:
        """A base with the levels changed that gain alone: all of them or the best; None where none does."""
        points = np.repeat(base[None], 2 * len(free), axis=0)
        points[np.arange(len(points)), np.repeat(free, 2)] += np.tile([-step, step], len(free))
        points = np.clip(points, centre - LEVEL_RANGE, centre + LEVEL_RANGE)
        totals = self.likelihoods([base, *points]).sum(axis=1)
        gains = (totals[1:] - totals[0]).reshape(-1, 2)  # of each level, down and up
        moves = (points - base).reshape(len(free), 2, -1)[np.arange(len(free)), gains.argmax(axis=1)]
        most = gains.max(axis=1)
        return self.likelier([base + moves[most > 0.0].sum(axis=0), base + moves[most.argmax()]], base)


def _key(point: np.ndarray) -> tuple[float, ...]:
    """Logarithms of levels, free of rounding."""
    return tuple(np.round(point, 6).tolist())


def _logarithms(levels: NoiseLevels) -> np.ndarray:
    return np.log(np.concatenate([levels.force, levels.sensor]))


def _levels(logarithms: np.ndarray, like: NoiseLevels) -> NoiseLevels:
    values = np.exp(logarithms)
    joints = len(like.force)
    return NoiseLevels(values[:joints], values[joints:])


def _single_moves(free: Sequence[Sequence[int]], step: float, count: int) -> list[np.ndarray]:
    """Moves of one level of every group, down and up, for the first levels, then the second ones, and so on."""
    moves = []
    for place in range(max(len(levels) for levels in free)):
        for sign in (-1.0, 1.0):
            moves.append(np.zeros(count))
            moves[-1][[levels[place] for levels in free if place < len(levels)]] = sign * step
    return moves


def _joined(gains: np.ndarray, moves: Sequence[np.ndarray], free: Sequence[Sequence[int]]) -> np.ndarray:
    """All single moves that gained, made at once; gains (moves, G), those of single moves in pairs (-, +)."""
    joined = np.zeros_like(moves[0])
    for g, levels in enumerate(free):
        for place, index in enumerate(levels):
            down, up = 2 * place, 2 * place + 1
            if max(gains[down, g], gains[up, g]) > 0.0:
                joined[index] = moves[up if gains[up, g] > gains[down, g] else down][index]
    return joined


def _best_of_each(
    gains: np.ndarray, trials: Sequence[np.ndarray], best: np.ndarray, free: Sequence[Sequence[int]]
) -> np.ndarray:
    """The levels of every group from the trial in which it gained most, where any did."""
    found = best.copy()
    for g, levels in enumerate(free):
        i = int(gains[:, g].argmax())
        if gains[i, g] > 0.0:
            found[list(levels)] = trials[i][list(levels)]
    return found


def _log_determinants(whitening: np.ndarray, data: RecordingBatch) -> np.ndarray:
    """Sums of the logarithms of the whitening's diagonal over the rows that count, of each group, shape (G,)."""
    diagonal = np.log(np.einsum("krcc->krc", whitening)[data.counted]).sum(axis=0)
    return np.array([diagonal[list(group)].sum() for group in data.groups])
