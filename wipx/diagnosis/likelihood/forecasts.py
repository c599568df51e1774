"""Evidence of several horizons: the likelihood of predictions of one row to half a second.

No law of a real machine holds exactly, and what a slightly wrong one misses row by row is taken for noise by whatever
models the noise. What decides a prediction of half a second is slow. So errors at several horizons count side by side,
each weighed by what it is at its horizon and by how it goes with the others: a composite likelihood (Varin, Vidoni
2005, Biometrika 92(3)), divided by how often a row is predicted. Errors have heavy tails (`heavy_tails`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import ClassVar

import numpy as np
from scipy.special import ndtri

from wipx.core.effect import Effect
from wipx.core.model import Model, ModelBatch
from wipx.core.results import HORIZON
from wipx.diagnosis.likelihood.fitting import CONVERGED, Fit, Fitter
from wipx.diagnosis.likelihood.heavy_tails import fitted_whitening, shrunk
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.predictions import HORIZONS, STRIDE, Predictions
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.stretches import PARTS, Stretches, step_to_others
from wipx.diagnosis.likelihood.tolerances import tolerances
from wipx.diagnosis.rules import EvidenceRules, Rules
from wipx.effects.catalogue import kind_of, vocabulary
from wipx.identify.kalman import Filter
from wipx.identify.smoothing import BANDWIDTHS
from wipx.sim.analytic import AnalyticSimulator

SHARE = STRIDE / HORIZON  # of a prediction that counts as independent of its neighbours
DOUBTS = 2  # steps by which numbers in doubt, which move by a few per cent, are fitted
STEPS = (1.0, 0.3, 0.0)  # shares of the step to numbers that suit others, of which the best is taken
STEP = 2.0  # times the simulator's usual step, exact enough where no law is


@dataclass(frozen=True)
class PredictionStarts:
    """Where predictions start.

    Attributes:
        bandwidths: Of the filter that estimates the states, shape (joints,) [rad/s].
        filter: Itself; the states follow each model.
    """

    bandwidths: np.ndarray
    filter: Filter


@dataclass(frozen=True)
class Errors:
    """How the E errors of a prediction are distributed.

    Attributes:
        whitening: Inverse Cholesky factor of their scale matrix, shape (E, E).
        log_likelihood: Of the errors that it was fitted to, up to a constant.
        reported: Nothing; reported forces are no part of it.
    """

    whitening: np.ndarray
    log_likelihood: float
    reported: float = 0.0


@dataclass(frozen=True)
class ForecastFitter(Fitter):
    """Fits hypotheses to predictions at several horizons.

    Attributes:
        horizons: After the rows that a start is estimated from [s]; 0 for one row.
        by_row: Fits the same recordings by innovations.
        first_levels: A first guess of the noise, as innovations have it.
        levels_by_row: The noise of what innovations chose.
        doubted: The robot, none of whose numbers is quite exact; an effect must hold beside that.
    """

    steps = 3
    close_call = 20.0
    exchanges = 1
    horizons: ClassVar[tuple[float, ...]] = HORIZONS

    by_row: InnovationFitter
    first_levels: NoiseLevels
    levels_by_row: NoiseLevels
    doubted: Setting
    _doubts: dict[tuple[tuple[str, ...], bytes], np.ndarray] = field(default_factory=dict, compare=False, repr=False)
    _seen: dict[tuple[tuple[str, ...], bytes], Fit] = field(default_factory=dict, compare=False, repr=False)

    @property
    def rules(self) -> Rules:
        """What decides."""
        return self.by_row.rules

    @property
    def own_rules(self) -> EvidenceRules:
        """Those of forecasts."""
        return self.rules.forecasts

    def looks_for(self, name: str, effect: Effect) -> bool:
        """Those of contract section 3, and those of section 6 whose numbers are none of section 3.

        Where no law holds exactly, a usual law beside a constant force is likelier than one law in the place of both.
        """
        site, machines = name.partition("/")[0], effect.on_machines
        known = not effect.is_outside(self.data.plant) or bool(machines and machines(site, self.data.plant))
        return known and effect.with_constant is None

    @property
    def data(self) -> RecordingBatch:
        """The recordings."""
        return self.by_row.data

    @cached_property
    def simulator(self) -> AnalyticSimulator:
        """The engine, with longer steps."""
        by_row = self.by_row.simulator
        return by_row if self.data.plant.tree is not None else replace(by_row, step=by_row.step * STEP)

    @property
    def noise(self) -> np.ndarray:
        """Sensor noise of each coordinate, shape (joints,) [m or rad]."""
        return self.first_levels.sensor[: self.data.joints]

    @property
    def rows(self) -> int:
        """Predictions that do not overlap."""
        return max(int(self.predictions.counted.sum() * SHARE), 2)

    @cached_property
    def predictions(self) -> Predictions:
        """All predictions."""
        doubt = self.rules.forecasts.undeclared
        return Predictions(self.simulator, self.data, self.noise, doubt, self.horizons)

    @cached_property
    def stretches(self) -> Stretches:
        """The stretches of time in which they start."""
        return Stretches.of(self.predictions)

    @property
    def blocks(self) -> np.ndarray:
        """Number of the stretch of time of every error, shape (N, E)."""
        return self._for_every_error(self.stretches.number)

    @property
    def runs(self) -> np.ndarray:
        """Number of the recording of every error, shape (N, E)."""
        return self._for_every_error(self.predictions.recording)

    def _for_every_error(self, values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(values[:, None], (len(values), self.predictions.size))

    @property
    def is_possible(self) -> bool:
        """Whether recordings are long enough to compare stretches of time."""
        return self.stretches.count > 1

    def refined(self) -> "ForecastFitter":
        """The same with half the step of the simulator."""
        return replace(self, by_row=self.by_row.refined(), _doubts={}, _seen={})

    def without(self, *recordings: int) -> "ForecastFitter":
        """The same with recordings that do not count."""
        return replace(self, by_row=self.by_row.without(*recordings), _doubts={}, _seen={})

    def beside(self, setting: Setting) -> "ForecastFitter":
        """The same, with doubt of the part's own numbers."""
        return replace(self, doubted=setting.doubted(self.rules.forecasts.undeclared), _doubts={}, _seen={})

    def first_fit(self, hypothesis: Hypothesis, levels: PredictionStarts | None = None) -> Fit:
        """From starts of its own."""
        return self.converged(self.fit(hypothesis, self.prediction_starts(hypothesis.model)))

    def required_beyond_penalty(self, smaller: Fit, larger: Fit, explained: float) -> float:
        """Nothing: `holds` asks."""
        return 0.0

    def holds(self, smaller: Fit, larger: Fit) -> bool:
        """Whether stretches of time agree that the larger one predicts recordings better that it was not fitted to.

        Vuong's test on the differences of their likelihoods (1989, Econometrica 57(2)), at a level for all effects that
        are looked at together; likely ones were not picked from so many.
        """
        added = set(larger.effects) - set(smaller.effects)
        return self._predicts_better(smaller, larger, max(map(self._picked_from, added), default=1))

    def is_likely(self, smaller: Fit, larger: Fit) -> bool:
        """The same, as if nothing else had been looked at."""
        return self._predicts_better(smaller, larger, 1)

    def completes(self, smaller: Fit, larger: Fit) -> bool:
        """Whether stretches of time agree that a law which every machine follows a little belongs to the model."""
        gains = self._judged_by_others(larger)[1] - self._judged_by_others(smaller)[1]
        return self._agree_on(gains, 1)

    def _predicts_better(self, smaller: Fit, larger: Fit, picked_from: int) -> bool:
        """Whether stretches of time agree that the larger one predicts others, beside doubts."""
        return self._agree_on(self._held_out(larger) - self._held_out(smaller), picked_from)

    def _agree_on(self, gains: np.ndarray, picked_from: int) -> bool:
        """Whether what predictions gain, shape (N,), is no chance."""
        reach = -float(ndtri(min(self.rules.forecasts.level / picked_from, 0.5)))
        least = self.rules.selection.least_gain - float(np.log(self.looked_at / picked_from))
        return float(gains.sum()) >= max(least, reach * self.stretches.chance(gains))

    def squared_scales(self, fit: Fit) -> np.ndarray:
        """Squared scale of each joint's errors over the longest horizon, by numbers that suit other stretches.

        Errors have heavy tails here as in the likelihood: a few predictions that fell over decide nothing.

        Returns:
            Shape (joints,), in units of the squared noise.
        """
        batch = fit.hypothesis.space.batch(self._judged_by_others(fit)[0])
        longest = (len(self.predictions.sampled) - 1) * self.data.joints + np.arange(self.data.joints)
        errors = self.errors_of(batch, fit.levels, fit.hypothesis.model)[:, :, longest]
        own = errors[self.stretches.part, np.arange(self.predictions.count)][self.predictions.counted]
        return np.ravel(fitted_whitening(own.T[:, :, None])[0]) ** -2.0

    def odds_of(self, effects: tuple[str, ...]) -> float:
        """Those of picking each effect from all that are as likely beforehand."""
        return -sum(float(np.log(self._picked_from(effect))) for effect in effects)

    def _picked_from(self, effect: str) -> int:
        """How many effects are as likely beforehand; one where nearly every machine has it, or recorded forces ask.

        What nearly every machine has may follow a richer law, one of a few.
        """
        if kind_of(effect).usual or self.doubted.expects(effect):
            return 1
        if _takes_the_place_of_a_usual_one(effect):
            site = effect.partition("/")[0]
            return sum(
                name.partition("/")[0] == site and _takes_the_place_of_a_usual_one(name) for name in self.searched
            )
        return self.looked_at

    @property
    def looked_at(self) -> int:
        """How many effects are looked for."""
        return len(self.searched)

    @cached_property
    def searched(self) -> tuple[str, ...]:
        """Effects that are looked for."""
        return tuple(name for name, effect in vocabulary(self.data.plant).items() if self.looks_for(name, effect))

    def _held_out(self, fit: Fit) -> np.ndarray:
        """Log-likelihood of each prediction by the numbers that suit other stretches, shape (N,).

        All of them bear what it costs to move numbers that are in doubt.
        """
        key = _key(fit)
        if key not in self._doubts:
            moved = self.in_doubt(fit)
            cost = 0.5 * np.sum(moved.hypothesis.space.prior_residuals(moved.hypothesis.cube) ** 2)
            self._doubts[key] = (
                self._judged_by_others(moved)[1] - cost * self.predictions.counted / self.predictions.counted.sum()
            )
        return self._doubts[key]

    def in_doubt(self, fit: Fit) -> Fit:
        """A fit of the same effects, beside numbers that are not exact and what every machine has a little of."""
        small = tolerances(self.doubted, self, self.predictions, fit)
        doubted = replace(self.doubted, tolerances=small, everywhere=True)
        return self.fit(Hypothesis.of(doubted, fit.effects, fit.hypothesis.values), fit.levels, steps=DOUBTS)

    def _judged_by_others(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Numbers that suit the other parts than each, and the likelihoods of its predictions by them.

        A step from the fit leads there, as long as the others agree with it.

        Returns:
            cubes: Positions in the cube, shape (PARTS, D).
            likelihoods: Shape (N,).
        """
        part = self.stretches.part
        steps = np.stack([step_to_others(fit, part == k) for k in range(PARTS)])
        tried = fit.hypothesis.cube + np.concatenate([share * steps for share in STEPS])
        white = self.white_of(fit, fit.hypothesis.space.batch(tried)).reshape(len(tried), *fit.white.shape)
        by_window = np.stack([self._likelihoods(replace(fit, white=each)) for each in white])
        cubes, likelihoods = np.empty_like(steps), np.zeros(self.predictions.count)
        for k in range(PARTS):
            own = part == k
            best = max(range(k, len(tried), PARTS), key=lambda i: float(by_window[i, ~own].sum()))
            cubes[k], likelihoods[own] = tried[best], by_window[best, own]
        return cubes, likelihoods

    def _likelihoods(self, fit: Fit) -> np.ndarray:
        """Log-likelihood of each prediction, shape (N,)."""
        scale = SHARE * float(np.log(np.diag(fit.noise.whitening)).sum())
        return np.where(self.predictions.counted, scale - 0.5 * np.sum(fit.white**2, axis=1), 0.0)

    def lead(self, fit: Fit, other: Fit, score: float) -> float:
        """Its lead on held-out stretches, beside numbers in doubt, and in the odds that it has beforehand."""
        return float(np.sum(self._held_out(fit) - self._held_out(other))) + fit.odds - other.odds

    def separation(self, fit: Fit, rival: Fit, lead: float, overstated: float) -> float:
        """As stretches of time agree on it (Vuong 1989): where no law holds, one predicts this better, another that.

        Numbers that a fit has more than the rival cost it their penalty. Forecasts of a late sensor end earlier in a
        motion than those of a late drive, and err less for that reason alone.
        """
        if self.are_alike(fit, rival):
            return 0.0
        differences = self._likelihoods(fit) - self._likelihoods(rival)
        lead -= 0.5 * max(len(fit.hypothesis.cube) - len(rival.hypothesis.cube), 0) * float(np.log(self.rows))
        return max(lead, 0.0) / max(self.stretches.chance(differences), 1e-12)

    def escape_levels(self, fit: Fit) -> PredictionStarts:
        """Starts by the fit itself, of the best filter near its own."""
        return self.prediction_starts(fit.hypothesis.model, self._near(fit))

    def seen_by_row(self, fit: Fit) -> tuple[InnovationFitter, Fit]:
        """A fit as its innovations show it."""
        key = _key(fit)
        if key not in self._seen:
            begun = self.sketched_by_row(fit)[1]
            self._seen[key] = self.by_row.fit(fit.hypothesis, self.by_row.levels_of(begun), steps=0)
        return self.by_row, self._seen[key]

    def sketched_by_row(self, fit: Fit) -> tuple[InnovationFitter, Fit]:
        """The same with the noise of what innovations chose."""
        return self.by_row, self.by_row.fit(fit.hypothesis, self.levels_by_row, steps=0)

    def seen_ahead(self, fit: Fit) -> Fit:
        """A fit by innovations as its forecasts show it."""
        return self.fit(fit.hypothesis, self.prediction_starts(fit.hypothesis.model), steps=0)

    def prediction_starts(self, model: Model, bandwidths: Sequence[np.ndarray] | None = None) -> PredictionStarts:
        """Starts by the model, of the filter from which its predictions are likeliest."""
        tried = list(bandwidths) if bandwidths is not None else [np.full(self.data.joints, b) for b in BANDWIDTHS]
        filters = self.predictions.filters(model, tried)
        if len(tried) == 1:
            return PredictionStarts(tried[0], filters[0])
        errors = self.predictions.errors(ModelBatch(model, (), np.zeros((len(tried), 0))), filters)
        best = int(np.argmax([each.log_likelihood for each in self.noise_of(errors, None, model)]))
        return PredictionStarts(tried[best], filters[best])

    def converged(self, fit: Fit, *, rounds: int = 2) -> Fit:
        """Starts and values in turn until neither gains more."""
        for _ in range(rounds):
            again = self.refit(fit, self.prediction_starts(fit.hypothesis.model, [fit.levels.bandwidths]))
            if again.log_likelihood < fit.log_likelihood + CONVERGED:
                return max(fit, again, key=lambda each: each.log_likelihood)
            fit = again
        return fit

    def _near(self, fit: Fit) -> list[np.ndarray]:
        """Bandwidths of a fit, and those three times larger or smaller in some joints."""
        best = fit.levels.bandwidths
        if self.data.plant.tree is None:
            factors = np.array(list(product((1.0 / 3.0, 1.0, 3.0), repeat=len(best))))
        else:
            factors = np.concatenate([1.0 + (factor - 1.0) * np.eye(len(best)) for factor in (1.0 / 3.0, 1.0, 3.0)])
        return list(np.unique(np.clip(best * factors, BANDWIDTHS[0], BANDWIDTHS[-1]), axis=0))

    def errors_of(self, batch: ModelBatch, levels: PredictionStarts, model: Model) -> np.ndarray:
        """Errors in units of the sensor noise, shape (P, N, E); zero where a prediction does not count."""
        return self.predictions.errors(batch, [levels.filter])

    def noise_of(self, errors: np.ndarray, levels: PredictionStarts | None, model: Model) -> list[Errors]:
        """How each model's errors are distributed, those of each group of joints by themselves."""
        some = errors[:, self.predictions.counted]
        whitening = np.zeros((len(some), some.shape[2], some.shape[2]))
        likelihoods = np.zeros(len(some))
        for group in self.predictions.groups:
            own, gained = fitted_whitening(some[:, :, group])
            whitening[:, group[:, None], group] = own
            likelihoods += SHARE * gained
        return [Errors(w, float(value)) for w, value in zip(whitening, likelihoods, strict=True)]

    def whitened(self, errors: np.ndarray, noise: Errors) -> np.ndarray:
        """White errors, shape (P, N, E), half of whose sum of squares is the loss of likelihood."""
        white = errors @ noise.whitening.T
        for group in self.predictions.groups:
            white[:, :, group] = np.sqrt(SHARE) * shrunk(white[:, :, group])
        return white

    def by_recording(self, fit: Fit, white: np.ndarray) -> np.ndarray:
        """Log-likelihood of each recording, shape (R,), for white errors (N, E)."""
        values = self._likelihoods(replace(fit, white=white))
        return np.bincount(self.predictions.recording, values, minlength=len(self.data.recordings))


def _key(fit: Fit) -> tuple[tuple[str, ...], bytes]:
    """What tells fits of the same recordings apart."""
    return fit.hypothesis.space.names, fit.hypothesis.cube.tobytes()


def _takes_the_place_of_a_usual_one(effect: str) -> bool:
    """Whether an effect "site/kind" takes the place of a simpler one that nearly every machine has."""
    kind, site = kind_of(effect), effect.partition("/")[0]
    simple = kind.contains.kind if kind.contains is not None else ""
    return simple in kind.excludes and kind_of(f"{site}/{simple}").usual
