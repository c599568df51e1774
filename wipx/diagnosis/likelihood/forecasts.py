"""Evidence of several horizons: the likelihood of predictions of one row to half a second.

No law of a real machine holds exactly, and what a slightly wrong one misses row by row is taken for noise by whatever
models the noise. What decides a prediction of half a second is slow. So errors at several horizons count side by side,
each weighed by what it is at its horizon and by how it goes with the others: a composite likelihood (Varin, Vidoni
2005, Biometrika 92(3)), divided by how often a row is predicted. Errors have heavy tails (multivariate t: Lange,
Little, Taylor 1989, J. Am. Stat. Assoc. 84), since single predictions fall over.

Predictions start from smoothed states (`wipx.identify.smoothing`). These depend on the model, as the filter of any
hypothesis does, and are estimated anew when values have moved.
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
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.diagnosis.likelihood.fitting import CONVERGED, Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import EvidenceRules, Rules
from wipx.effects.catalogue import kind_of, vocabulary
from wipx.identify.kalman import Filter
from wipx.identify.smoothing import BANDWIDTHS, Smoother
from wipx.identify.starts import leads_of, starts_by
from wipx.identify.windows import LOOK_AHEAD, Windows, cut
from wipx.sim.analytic import AnalyticSimulator

HORIZONS = (0.0, 0.05, 0.15, HORIZON - LOOK_AHEAD)  # [s] after the rows that a start is estimated from; 0 for one row
SPACING = 0.005  # [s] of the rows of condensed logs, about
STRIDE = 0.25  # [s] from one start to the next
SHARE = STRIDE / HORIZON  # of a prediction that counts as independent of its neighbours
LEAD = 0.1  # [s] of smoothed states before a start
BLOCK = 1.0  # [s] of the stretches whose errors count as independent of each other
TAILS = 5.0  # degrees of freedom of the errors' distribution
ROUNDS = 12  # of the search for their covariance
DOUBTS = 2  # steps by which numbers in doubt, which move by a few per cent, are fitted
PARTS = 6  # of the stretches, each predicted by numbers that suit the others
DAMPED = 1e-3  # relative, of the step to these numbers
STEPS = (1.0, 0.3)  # shares of it that are tried; none of it where neither is an improvement
LARGEST_CALL = 6_000_000  # numbers of one batch of rollouts, about 48 MB
STEP = 2.0  # times the simulator's usual step, exact enough where no law is
TOO_FAR = 5.0  # ranges of the recorded motion; what a prediction that fell over counts


@dataclass(frozen=True)
class PredictionStarts:
    """Where predictions start.

    Attributes:
        bandwidths: Of the filter that estimates the states, shape (joints,) [rad/s].
        filter: Itself; the states follow each model.
        spread: Of single commands about their mean: none.
    """

    bandwidths: np.ndarray
    filter: Filter
    spread: float = 0.0


@dataclass(frozen=True)
class Errors:
    """How errors of N predictions at H horizons are distributed.

    Attributes:
        whitening: Inverse Cholesky factor of their scale matrix, shape (H joints, H joints).
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

    considered = 12
    steps = 3
    close_call = 20.0
    sweeps = 1  # where no law holds, a second one finds what stands in for others
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
        """Those of contract section 3, and those of section 6 whose numbers are none of section 3."""
        site, machines = name.partition("/")[0], effect.on_machines
        return not effect.is_outside(self.data.plant) or bool(machines and machines(site, self.data.plant))

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
        return max(int(self._counted.sum() * SHARE), 2)

    @cached_property
    def blocks(self) -> np.ndarray:
        """Number of the stretch of time of every error, shape (N, H joints)."""
        number = np.floor(self.windows.starts / BLOCK).astype(np.int64) + 1_000_000 * self.windows.recording
        dense = np.unique(number, return_inverse=True)[1]
        return np.repeat(dense[:, None], self._sampled.shape[0] * self.data.joints, axis=1)

    @property
    def runs(self) -> np.ndarray:
        """Number of the recording of every error, shape (N, H joints)."""
        return np.broadcast_to(self.windows.recording[:, None], self.blocks.shape)

    @cached_property
    def _recordings(self) -> tuple[Recording, ...]:
        return tuple(condensed(recording, self.data.plant.commands) for recording in self.data.recordings)

    @cached_property
    def windows(self) -> Windows:
        """The predictions."""
        return cut(self._recordings, self.data.plant, horizon=HORIZON, lead=LEAD, stride=STRIDE)

    @cached_property
    def _sampled(self) -> np.ndarray:
        """Row of each window at each horizon, shape (H, N)."""
        t, windows = self.windows.inputs.t, self.windows
        seen = np.sum(t <= windows.starts + LOOK_AHEAD + 1e-6, axis=0)
        wanted = [np.sum(t < windows.starts + LOOK_AHEAD + horizon - 1e-6, axis=0) for horizon in self.horizons]
        rows = np.stack([np.minimum(np.maximum(row, seen), windows.inputs.last) for row in wanted])
        apart = np.concatenate([[True], np.median(np.diff(rows, axis=0), axis=1) > 0.0])
        return rows[apart]

    @cached_property
    def _counted(self) -> np.ndarray:
        """Predictions that count: whole ones, of recordings that do, shape (N,)."""
        windows = self.windows
        last = windows.inputs.t[windows.inputs.last, np.arange(windows.count)]
        interval = max(float(np.median(np.diff(recording.t))) for recording in self._recordings)
        whole = last >= windows.starts + HORIZON - 1.5 * interval - 1e-6
        return whole & ~np.isin(windows.recording, self.data.left_out)

    @property
    def is_possible(self) -> bool:
        """Whether recordings are long enough to compare stretches of time."""
        return len(np.unique(self._stretch[self._counted])) > 1

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
        kept = self._by_stretch(self._held_out(larger) - self._held_out(smaller))
        picked_from = 1 if all(map(self._is_likely, set(larger.effects) - set(smaller.effects))) else self.looked_at
        reach = -float(ndtri(min(self.rules.forecasts.level / picked_from, 0.5)))
        chance = reach * float(np.sqrt(len(kept)) * np.std(kept, ddof=1))
        least = self.rules.selection.least_gain - float(np.log(self.looked_at / picked_from))
        return float(kept.sum()) >= max(least, chance)

    def removed(self, smaller: Fit, larger: Fit) -> float:
        """Squared error over the longest horizon that the further effects of a fit remove at some joint, over the rest.

        Args:
            smaller: Without these effects.
            larger: With them.
        """
        without, stays = (self._squared_errors(fit) for fit in (smaller, larger))
        return float(np.max(without / stays)) - 1.0

    def _squared_errors(self, fit: Fit) -> np.ndarray:
        """Mean squared error of each joint over the longest horizon, by numbers that suit other stretches, (joints,).

        In units of its noise.
        """
        batch = fit.hypothesis.space.batch(self._judged_by_others(fit)[0])
        errors = self.errors_of(batch, fit.levels, fit.hypothesis.model)[:, :, -self.data.joints :]
        own = errors[self._part, np.arange(self.windows.count)]
        return np.mean(own[self._counted] ** 2, axis=0)

    def odds_of(self, effects: tuple[str, ...]) -> float:
        """Those of picking an effect from all that are looked for, unless it is likely."""
        return -float(np.log(self.looked_at)) * sum(not self._is_likely(effect) for effect in effects)

    def _is_likely(self, effect: str) -> bool:
        """Whether nearly every machine has an effect, or recorded forces ask for it."""
        return kind_of(effect).usual or self.doubted.expects(effect)

    @cached_property
    def looked_at(self) -> int:
        """How many effects are looked for."""
        return sum(self.looks_for(name, effect) for name, effect in vocabulary(self.data.plant).items())

    def _by_stretch(self, values: np.ndarray) -> np.ndarray:
        """Sums of what predictions have (N,), over each stretch of time in which any counts."""
        return np.bincount(self._stretch, values)[np.bincount(self._stretch, self._counted) > 0]

    @property
    def _stretch(self) -> np.ndarray:
        """Number of the stretch of time in which each prediction starts, shape (N,)."""
        return self.blocks[:, 0]

    def _held_out(self, fit: Fit) -> np.ndarray:
        """Log-likelihood of each prediction by the numbers that suit other stretches, shape (N,).

        All of them bear what it costs to move numbers that are in doubt.
        """
        key = _key(fit)
        if key not in self._doubts:
            begun = Hypothesis.of(self.doubted, fit.effects, fit.hypothesis.values)
            moved = self.fit(begun, fit.levels, steps=DOUBTS)
            cost = 0.5 * np.sum(moved.hypothesis.space.prior_residuals(moved.hypothesis.cube) ** 2)
            self._doubts[key] = self._judged_by_others(moved)[1] - cost * self._counted / self._counted.sum()
        return self._doubts[key]

    def _judged_by_others(self, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
        """Numbers that suit the other parts than each, and the likelihoods of its predictions by them.

        A step from the fit leads there, as long as the others agree with it.

        Returns:
            cubes: Positions in the cube, shape (PARTS, D).
            likelihoods: Shape (N,).
        """
        steps = np.stack([self._by_others(fit, self._part == k) for k in range(PARTS)]) - fit.hypothesis.cube
        tried = fit.hypothesis.cube + np.concatenate([share * steps for share in (*STEPS, 0.0)])
        white = self.white_of(fit, fit.hypothesis.space.batch(tried)).reshape(len(tried), *fit.white.shape)
        by_window = np.stack([self._likelihoods(replace(fit, white=each)) for each in white])
        cubes, likelihoods = np.empty_like(steps), np.zeros(self.windows.count)
        for k in range(PARTS):
            own = self._part == k
            best = max(range(k, len(tried), PARTS), key=lambda i: float(by_window[i, ~own].sum()))
            cubes[k], likelihoods[own] = tried[best], by_window[best, own]
        return cubes, likelihoods

    @property
    def _part(self) -> np.ndarray:
        """Number of the part to which each prediction belongs, shape (N,)."""
        return self._stretch % PARTS

    def _by_others(self, fit: Fit, left_out: np.ndarray) -> np.ndarray:
        """Position in the cube that suits all predictions but some (N,), by one Gauss-Newton step, shape (D,)."""
        cube = fit.hypothesis.cube
        here = np.flatnonzero(np.repeat(left_out, fit.white.shape[1]))
        jacobian = fit.jacobian[here]
        scale = np.sqrt(np.maximum(np.diag(fit.information), 1e-12))
        slope = fit.slope - jacobian.T @ fit.white.ravel()[here]
        normal = (fit.information - jacobian.T @ jacobian) / np.outer(scale, scale) + DAMPED * np.eye(len(cube))
        step = -np.linalg.solve(normal, slope / scale) / scale
        return np.clip(cube + np.where(fit.free, step, 0.0), 0.0, 1.0)

    def _likelihoods(self, fit: Fit) -> np.ndarray:
        """Log-likelihood of each prediction, shape (N,)."""
        scale = SHARE * float(np.log(np.diag(fit.noise.whitening)).sum())
        return np.where(self._counted, scale - 0.5 * np.sum(fit.white**2, axis=1), 0.0)

    def lead(self, fit: Fit, other: Fit, score: float) -> float:
        """Its lead on held-out stretches, beside numbers in doubt, and in the odds that it has beforehand."""
        return float(np.sum(self._held_out(fit) - self._held_out(other))) + fit.odds - other.odds

    def separation(self, fit: Fit, rival: Fit, lead: float, overstated: float) -> float:
        """As stretches of time agree on it (Vuong 1989): where no law holds, one predicts this better, another that.

        Numbers that a fit has more than the rival cost it their penalty.
        """
        differences = self._by_stretch(self._likelihoods(fit) - self._likelihoods(rival))
        lead -= 0.5 * max(len(fit.hypothesis.cube) - len(rival.hypothesis.cube), 0) * float(np.log(self.rows))
        return float(max(lead, 0.0) / max(np.sqrt(len(differences)) * np.std(differences, ddof=1), 1e-12))

    def escape_levels(self, fit: Fit) -> PredictionStarts:
        """Starts by the fit itself, of the best filter near its own."""
        return self.prediction_starts(fit.hypothesis.model, self._near(fit))

    def spread_for(self, model: Model, levels: PredictionStarts) -> PredictionStarts:
        """The same starts: commands are taken as the log has them."""
        return levels

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
        filters = [self._smoother.filtered(model, bandwidth, leads_of(self.windows)) for bandwidth in tried]
        if len(tried) == 1:
            return PredictionStarts(tried[0], filters[0])
        errors = self._errors_from(ModelBatch(model, (), np.zeros((len(tried), 0))), filters)
        best = int(np.argmax([each.log_likelihood for each in self.noise_of(errors, None, model)]))
        return PredictionStarts(tried[best], filters[best])

    @cached_property
    def _smoother(self) -> Smoother:
        return Smoother(self.simulator, self.data.plant, self._recordings, self.noise)

    def converged(self, fit: Fit, *, rounds: int = 2) -> Fit:
        """Starts and values in turn until neither gains more."""
        for _ in range(rounds):
            again = self.fit(fit.hypothesis, self.prediction_starts(fit.hypothesis.model, [fit.levels.bandwidths]))
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
        """Errors in units of the sensor noise, shape (P, N, H joints); zero where a prediction does not count."""
        return self._errors_from(batch, [levels.filter])

    def _errors_from(self, batch: ModelBatch, filters: Sequence[Filter]) -> np.ndarray:
        windows, sampled = self.windows, self._sampled
        joints, count = self.data.joints, windows.count
        found = np.empty((batch.size, count, len(sampled) * joints))
        size = max(1, LARGEST_CALL // (len(windows.inputs.t) * 4 * count))
        recorded = windows.recorded[sampled, :, np.arange(count)]  # (H, N, joints)
        for begin in range(0, batch.size, size):
            part = np.arange(begin, min(begin + size, batch.size))
            some = ModelBatch(batch.model, batch.names, None if batch.values is None else batch.values[part])
            own = filters if len(filters) == 1 else filters[part[0] : part[-1] + 1]
            path = starts_by(self._smoother, windows, some, own).path(some)
            shown = self.simulator.replay(some, windows.inputs, path.states[0], path).coordinates
            at = np.stack([shown[rows, :, :, np.arange(count)] for rows in sampled])  # (H, N, joints, P)
            errors = at - recorded[..., None]
            errors = np.clip(np.nan_to_num(errors, nan=np.inf), -self._largest[:, None], self._largest[:, None])
            errors = errors / self.noise[:, None] * self._counted[None, :, None, None]
            found[part] = np.transpose(errors, (3, 1, 0, 2)).reshape(len(part), count, -1)
        return found

    @cached_property
    def _largest(self) -> np.ndarray:
        rows = np.moveaxis(self.windows.recorded, 1, 0)[:, self.windows.predicted]
        return TOO_FAR * np.ptp(rows, axis=1) + 1e3 * self.noise

    def noise_of(self, errors: np.ndarray, levels: PredictionStarts | None, model: Model) -> list[Errors]:
        """How each model's errors are distributed, those of each group of joints by themselves."""
        some = errors[:, self._counted]
        whitening = np.zeros((len(some), some.shape[2], some.shape[2]))
        likelihoods = np.zeros(len(some))
        for group in self._groups:
            own, gained = self._distributed(some[:, :, group])
            whitening[:, group[:, None], group] = own
            likelihoods += gained
        return [Errors(w, float(value)) for w, value in zip(whitening, likelihoods, strict=True)]

    @cached_property
    def _groups(self) -> tuple[np.ndarray, ...]:
        """Which of the H joints errors of a prediction go with each other, indices."""
        joints, channels = self.data.joints, self.data.channels
        first = np.arange(len(self._sampled))[:, None] * joints
        own = [[channels[c] for c in group if channels[c] < joints] for group in self.data.groups]
        return tuple((first + np.array(coordinates)).ravel() for coordinates in own)

    @staticmethod
    def _distributed(some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whitening (P, E, E) and log-likelihood (P,) of E errors of predictions, by expectation and maximisation."""
        count, size = some.shape[1:]
        weights = np.ones(some.shape[:2])
        prior = size + 1.0  # errors' worth of what is known of correlations beforehand: nothing
        for _ in range(ROUNDS):
            scale = np.einsum("pna,pnb->pab", some * weights[..., None], some) / count
            diagonal = np.einsum("paa->pa", scale)
            scale = scale * count / (count + prior)
            scale[:, np.arange(size), np.arange(size)] = np.maximum(diagonal, 1e-12)
            whitening = np.linalg.inv(np.linalg.cholesky(scale))
            squares = np.sum(np.einsum("pab,pnb->pna", whitening, some) ** 2, axis=2)
            weights = (TAILS + size) / (TAILS + squares)
        determinants = np.log(np.einsum("paa->pa", whitening)).sum(axis=1)
        sums = 0.5 * (TAILS + size) * np.log1p(squares / TAILS).sum(axis=1)
        return whitening, SHARE * (count * determinants - sums)

    def whitened(self, errors: np.ndarray, noise: Errors) -> np.ndarray:
        """White errors, shape (P, N, H joints), half of whose sum of squares is the loss of likelihood."""
        white = errors @ noise.whitening.T
        for group in self._groups:
            own = white[:, :, group]
            squares = np.maximum(np.sum(own**2, axis=2, keepdims=True), 1e-12)
            worth = SHARE * (TAILS + len(group)) * np.log1p(squares / TAILS)
            white[:, :, group] = own * np.sqrt(worth / squares)
        return white

    def by_recording(self, fit: Fit, white: np.ndarray) -> np.ndarray:
        """Log-likelihood of each recording, shape (R,), for white errors (N, H joints)."""
        values = self._likelihoods(replace(fit, white=white))
        return np.bincount(self.windows.recording, values, minlength=len(self.data.recordings))


def condensed(recording: Recording, commands: tuple[str, ...]) -> Recording:
    """Means of an odd number of rows each, at the time of the middle one; commands as they act from there on.

    Many more rows than a joint's motion needs cost time and tell little more of half a second.
    """
    every = 1 + 2 * round(0.5 * max(SPACING * recording.rate - 1.0, 0.0))
    kept = len(recording) // every - 1
    if every == 1 or kept < 2:
        return recording

    def means(values: np.ndarray, first: int) -> np.ndarray:
        return values[first : first + kept * every].reshape(kept, every).mean(axis=1)

    middle = every // 2
    columns = {name: means(values, middle if name in commands else 0) for name, values in recording.columns.items()}
    times = {"t": recording.t[middle : middle + kept * every : every]}
    return Recording(recording.name, {**columns, **times}, recording.source, recording.periods)


def _key(fit: Fit) -> tuple[tuple[str, ...], bytes]:
    """What tells fits of the same recordings apart."""
    return fit.hypothesis.space.names, fit.hypothesis.cube.tobytes()
