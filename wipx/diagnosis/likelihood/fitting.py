"""Maximum likelihood: the parameters with which a hypothesis explains recordings best.

Prediction-error method (Ljung 1999, System Identification, ch. 7): Levenberg-Marquardt steps on white errors, with
what makes them white held fixed. What the errors are is left to the evidence that is counted: `innovations` are those
of predictions of one row, `forecasts` those of predictions of up to half a second.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import numpy as np

from wipx.core.effect import Effect
from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import EvidenceRules, Rules
from wipx.effects.catalogue import alike
from wipx.sim.analytic import AnalyticSimulator

if TYPE_CHECKING:
    from wipx.diagnosis.likelihood.innovations import InnovationFitter

FIRST_STEP = 1e-4  # of the search interval, for the first slopes
LARGEST_STEP = 0.02
SECANT = 0.3  # standard deviations over which later slopes are taken
DAMPINGS = np.array([0.0, 0.03, 1.0, 30.0])  # relative; the first step is tried alone, the others together if it fails
TRUSTED = 0.5  # share of what a linear model expects that a step must gain (Nocedal, Wright 2006, ch. 4)
SETTLED = 0.05  # nats per step at which a refinement ends
NEARBY = 0.5  # nats to be gained by a step of one standard deviation; slopes hold as far as that
CONVERGED = 0.5  # nats at which alternating ends


class Noise(Protocol):
    """What makes errors white."""

    @property
    def log_likelihood(self) -> float:
        """Of the errors that it was fitted to, up to a constant that all hypotheses share."""
        ...

    @property
    def reported(self) -> float:
        """The part of it that is the reported forces'."""
        ...


@dataclass(frozen=True)
class Fit:
    """A hypothesis fitted to recordings.

    Attributes:
        hypothesis: With its best values.
        levels: What was held fixed: noise levels, or where predictions start.
        noise: Of its errors.
        white: Errors made white; of innovations, shape (R, m, K + 1), zero at rows that do not count.
        blocks: Number of the stretch of time to which each white error belongs, from 0 on, shape of `white`.
        rows: Number of errors that count as independent.
        jacobian: Slopes of `white` by the position in the cube, and of the priors, shape (N + priors, D).
        log_likelihood: Of the recordings, with the priors', up to a constant that all hypotheses share.
        odds: Logarithm of how likely its effects are beforehand, compared with those that nearly every machine has.
    """

    hypothesis: Hypothesis
    levels: Any
    noise: Any
    white: np.ndarray
    blocks: np.ndarray
    rows: int
    jacobian: np.ndarray
    log_likelihood: float
    odds: float

    @property
    def motion_likelihood(self) -> float:
        """Log-likelihood without that of forces which the drives report."""
        return self.log_likelihood - self.noise.reported

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
class Climb:
    """A fit on its way to the best values at its levels.

    Attributes:
        fit: As far as it has come.
        proposals: Positions in the cube to try next, one for each damping, the least damped first.
        expected: Gain of the first of them, if errors change in proportion [nats].
        close: Whether the slopes are taken too close to tell that nothing is to be gained.
        settled: Whether the last step gained next to nothing.
    """

    fit: Fit
    proposals: np.ndarray
    expected: float
    close: bool = False
    settled: bool = False

    @property
    def has_arrived(self) -> bool:
        """Whether a further step is worth nothing."""
        return self.settled or not len(self.fit.hypothesis.cube) or (self.expected < SETTLED and not self.close)


class Fitter(ABC):
    """Fits hypotheses to recordings, by one kind of evidence.

    Attributes:
        steps: Levenberg-Marquardt steps from each start of an effect.
        close_call: Evidence within which a rival of an effect is fitted to the end [nats].
        exchanges: Times that the parts of a robot of many joints exchange their effects for better ones, at most.
    """

    steps: ClassVar[int]
    close_call: ClassVar[float]
    exchanges: ClassVar[int]

    @property
    @abstractmethod
    def rules(self) -> Rules:
        """What decides."""

    @property
    @abstractmethod
    def own_rules(self) -> EvidenceRules:
        """Those of this kind of evidence."""

    @abstractmethod
    def looks_for(self, name: str, effect: Effect) -> bool:
        """Whether an effect "site/kind" is one of those that may be named by this evidence."""

    @property
    @abstractmethod
    def data(self) -> RecordingBatch:
        """The recordings."""

    @cached_property
    def alike(self) -> dict[str, tuple[str, ...]]:
        """Effects that no recording tells apart, by each of them."""
        return alike(self.data.plant)

    def are_alike(self, fit: Fit, other: Fit) -> bool:
        """Whether fits differ by one effect only, in whose place no recording tells them apart."""
        exchanged = sorted(set(fit.effects) ^ set(other.effects))
        return len(exchanged) == 2 and exchanged[1] in self.alike.get(exchanged[0], ())

    @property
    @abstractmethod
    def simulator(self) -> AnalyticSimulator:
        """The engine."""

    @property
    @abstractmethod
    def rows(self) -> int:
        """Number of errors that count as independent."""

    @property
    @abstractmethod
    def blocks(self) -> np.ndarray:
        """Number of the stretch of time to which each white error belongs, from 0 on, shape of `Fit.white`."""

    @property
    @abstractmethod
    def runs(self) -> np.ndarray:
        """Number of the recording to which each white error belongs, shape of `Fit.white`."""

    @abstractmethod
    def converged(self, fit: Fit, *, rounds: int = 4) -> Fit:
        """Values, and what is else held fixed, in turn until neither gains more."""

    @abstractmethod
    def required_beyond_penalty(self, smaller: Fit, larger: Fit, explained: float) -> float:
        """Evidence that what a fit has beside a smaller one must gain beyond its penalty [nats].

        Args:
            smaller: The smaller fit.
            larger: The larger fit.
            explained: What the smaller one explains already [nats].
        """

    @abstractmethod
    def odds_of(self, effects: tuple[str, ...]) -> float:
        """Logarithm of how likely effects are beforehand, compared with those that nearly every machine has."""

    @abstractmethod
    def holds(self, smaller: Fit, larger: Fit) -> bool:
        """Whether what a fit has beside a smaller one shows in recordings that it was not fitted to."""

    @abstractmethod
    def lead(self, fit: Fit, other: Fit, score: float) -> float:
        """By how much a fit is better than one of other effects [nats].

        Args:
            fit: The fit.
            other: The other one.
            score: Penalised evidence that the fit has beyond the other one [nats].
        """

    @abstractmethod
    def separation(self, fit: Fit, rival: Fit, lead: float, overstated: float) -> float:
        """By how many standard deviations a fit explains the recordings better than a rival.

        Args:
            fit: The fit.
            rival: Another one with as many numbers, or nearly.
            lead: Evidence that the fit has beyond the rival [nats].
            overstated: By how much evidence is, see `robust.inflation`.
        """

    @abstractmethod
    def escape_levels(self, fit: Fit) -> Any:
        """Levels from which a fit sees less of a misfit that it got stuck in."""

    @abstractmethod
    def refined(self) -> Self:
        """The same with half the step of the simulator."""

    def error_of_steps(self, fit: Fit) -> np.ndarray:
        """How the white innovations of a fit change if the simulator halves its step."""
        return self.refined().white_of(fit, ModelBatch(fit.hypothesis.model))[0] - fit.white.ravel()

    @abstractmethod
    def first_fit(self, hypothesis: Hypothesis, levels: Any) -> Fit:
        """The fit of a hypothesis that is far from what has been fitted so far."""

    @abstractmethod
    def without(self, *recordings: int) -> Self:
        """The same with recordings that do not count."""

    @abstractmethod
    def beside(self, setting: Setting) -> Self:
        """The same for a part of the robot, the rest of which is given."""

    @abstractmethod
    def seen_by_row(self, fit: Fit) -> "tuple[InnovationFitter, Fit]":
        """A fit as its innovations show it, and what fits by innovations."""

    @abstractmethod
    def sketched_by_row(self, fit: Fit) -> "tuple[InnovationFitter, Fit]":
        """The same with noise that need not suit it best: enough for first guesses."""

    @abstractmethod
    def by_recording(self, fit: Fit, white: np.ndarray) -> np.ndarray:
        """Log-likelihood of each recording, shape (R,), for white errors of the shape of `Fit.white`."""

    @abstractmethod
    def errors_of(self, batch: ModelBatch, levels: Any, model: Model) -> np.ndarray:
        """Errors of P models, shape (P, ...).

        Args:
            batch: The models.
            levels: What is held fixed.
            model: Whose sensors the errors are seen with.
        """

    @abstractmethod
    def noise_of(self, errors: np.ndarray, levels: Any, model: Model) -> Sequence[Noise]:
        """What makes the errors of each of P models white; arguments as `errors_of` has them."""

    @abstractmethod
    def whitened(self, errors: np.ndarray, noise: Noise) -> np.ndarray:
        """Errors (P, ...) made white, of the shape (P, *white)."""

    def fit(self, hypothesis: Hypothesis, levels: Any, *, steps: int = 6, near: Fit | None = None) -> Fit:
        """The best values at given levels, from the hypothesis' own values on.

        Args:
            hypothesis: Where to start.
            levels: What is held fixed.
            steps: Levenberg-Marquardt steps at most.
            near: A fit that tells how far its numbers may be off; None where nothing is known of that.
        """
        return self._climbed(self.begun(hypothesis, levels, near=near), steps)

    def refit(self, fit: Fit, levels: Any, *, steps: int = 6) -> Fit:
        """The best values at other levels than those of a fit, from its values on; arguments as `fit` has them."""
        here = fit if levels is fit.levels else self._sloped(fit.hypothesis, levels, _secants(fit))
        return self._climbed(self._climb(here), steps)

    def begun(self, hypothesis: Hypothesis, levels: Any, *, near: Fit | None = None) -> Climb:
        """A fit on its way, at the hypothesis' own values; arguments as `fit` has them."""
        known = dict(zip(near.hypothesis.space.names, _secants(near), strict=True)) if near else {}
        names = hypothesis.space.names
        sloped = self._sloped(hypothesis, levels, np.array([known.get(name, FIRST_STEP) for name in names]))
        return self._climb(sloped, close=not known.keys() >= set(names))

    def stepped(self, climb: Climb) -> Climb:
        """A fit on its way, one Levenberg-Marquardt step further."""
        here = climb.fit
        secants = _secants(here)
        straight, *damped = climb.proposals
        nearby = climb.expected < NEARBY and not climb.close
        if nearby:
            there = replace(self._best_of(here, straight[None]), jacobian=here.jacobian)
        else:
            there = self._sloped(here.hypothesis.at(straight), here.levels, secants)
        if damped and there.log_likelihood - here.log_likelihood < TRUSTED * climb.expected:
            other = self._best_of(here, np.stack(damped))
            if other.log_likelihood > max(there.log_likelihood, here.log_likelihood):
                there = self._sloped(other.hypothesis, here.levels, secants)
        gain = there.log_likelihood - here.log_likelihood
        if gain <= 0.0:
            there = here if nearby else self._sloped(here.hypothesis, here.levels, secants)
        return replace(self._climb(there), settled=gain < SETTLED)

    def _climbed(self, climb: Climb, steps: int) -> Fit:
        """The best values that some steps lead to."""
        for _ in range(steps):
            if climb.has_arrived:
                break
            climb = self.stepped(climb)
        return climb.fit

    def _climb(self, fit: Fit, *, close: bool = False) -> Climb:
        proposals = self._proposals(fit)
        return Climb(fit, proposals, _expected_gain(fit, proposals[0]), close)

    def white_of(self, fit: Fit, batch: ModelBatch) -> np.ndarray:
        """White errors of other models, with levels and noise of a fit, shape (P, N)."""
        errors = self.errors_of(batch, fit.levels, fit.hypothesis.model)
        return self.whitened(errors, fit.noise).reshape(batch.size, -1)

    def ranked(self, hypotheses: Sequence[Hypothesis], levels: Any) -> list[Hypothesis]:
        """Hypotheses of the same effects as they are, the likeliest first."""
        return [hypotheses[i] for i in np.argsort(-self.likelihoods_of(hypotheses, levels))]

    def likelihoods_of(self, hypotheses: Sequence[Hypothesis], levels: Any) -> np.ndarray:
        """Log-likelihoods of hypotheses of the same effects, as they are."""
        cubes = np.stack([hypothesis.cube for hypothesis in hypotheses])
        space, model = hypotheses[0].space, hypotheses[0].model
        noise = self.noise_of(self.errors_of(space.batch(cubes), levels, model), levels, model)
        return np.array([each.log_likelihood for each in noise]) - 0.5 * np.sum(
            space.prior_residuals(cubes) ** 2, axis=1
        )

    def _sloped(self, hypothesis: Hypothesis, levels: Any, size: np.ndarray) -> Fit:
        """The values of a hypothesis as they are, with slopes over steps of the position in the cube, shape (D,)."""
        cubes = _around(hypothesis.cube, size)
        errors = self._errors(hypothesis, cubes, levels)
        fit = self._likeliest(hypothesis, levels, cubes[:1], errors[:1])
        white = self.whitened(errors, fit.noise).reshape(len(cubes), -1)
        rows = np.concatenate([white, hypothesis.space.prior_residuals(cubes)], axis=1)
        return replace(fit, jacobian=((rows[1:] - rows[0]) / np.diag(cubes[1:] - cubes[0])[:, None]).T)

    def _best_of(self, fit: Fit, cubes: np.ndarray) -> Fit:
        """The likeliest of several positions in the cube, without slopes."""
        errors = self._errors(fit.hypothesis, cubes, fit.levels)
        return self._likeliest(fit.hypothesis, fit.levels, cubes, errors)

    def _errors(self, hypothesis: Hypothesis, cubes: np.ndarray, levels: Any) -> np.ndarray:
        return self.errors_of(hypothesis.space.batch(cubes), levels, hypothesis.model)

    def _likeliest(self, hypothesis: Hypothesis, levels: Any, cubes: np.ndarray, errors: np.ndarray) -> Fit:
        """The likeliest of several positions in the cube by their errors (P, ...), without slopes."""
        noise = self.noise_of(errors, levels, hypothesis.model)
        priors = hypothesis.space.prior_residuals(cubes)
        likelihoods = [each.log_likelihood - 0.5 * float(p @ p) for each, p in zip(noise, priors, strict=True)]
        i = int(np.argmax(likelihoods))
        white = self.whitened(errors[i : i + 1], noise[i])[0]
        slopes = np.zeros((white.size + priors.shape[1], cubes.shape[1]))
        odds = self.odds_of(hypothesis.effects)
        best = hypothesis.at(cubes[i])
        return Fit(best, levels, noise[i], white, self.blocks, self.rows, slopes, likelihoods[i], odds)

    def _proposals(self, fit: Fit) -> np.ndarray:
        """Positions to try next, one for each damping, within the cube."""
        cube = fit.hypothesis.cube
        free = np.flatnonzero(fit.free)
        proposals = np.repeat(cube[None], len(DAMPINGS), axis=0)
        if not len(free):
            return proposals[:1]
        for i, damping in enumerate(DAMPINGS):
            proposals[i, free] += damped_step(fit.information[np.ix_(free, free)], fit.slope[free], damping)
        return np.clip(proposals, 0.0, 1.0)


def damped_step(information: np.ndarray, slope: np.ndarray, damping: float = 0.0) -> np.ndarray:
    """The step to where a parabola is least, shortened by a relative damping (Levenberg-Marquardt).

    Args:
        information: Curvature, shape (D, D).
        slope: Shape (D,), or (D, K) for K steps at once.
        damping: Relative to the curvature along each axis; a little is always there, for numbers that do the same.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled = information / np.outer(scale, scale) + (damping + 1e-9) * np.eye(len(scale))
    return -(np.linalg.solve(scaled, (slope.T / scale).T).T / scale).T


def _secants(fit: Fit) -> np.ndarray:
    """Steps of the position in the cube over which slopes near a fit are taken, shape (D,)."""
    deviations = 1.0 / np.sqrt(np.maximum(np.sum(fit.jacobian**2, axis=0), 1e-12))
    return np.clip(SECANT * deviations, 1e-6, LARGEST_STEP)


def _expected_gain(fit: Fit, cube: np.ndarray) -> float:
    """Log-likelihood that a fit gains at another position in the cube if its errors change in proportion [nats]."""
    moved = cube - fit.hypothesis.cube
    return float(-fit.slope @ moved - 0.5 * moved @ fit.information @ moved)


def _around(cube: np.ndarray, size: np.ndarray) -> np.ndarray:
    """A position in the cube, and a step from it along each axis away from the nearer bound, shape (D + 1, D)."""
    return np.concatenate([cube[None], cube + np.diag(np.where(cube > 0.5, -size, size))])
