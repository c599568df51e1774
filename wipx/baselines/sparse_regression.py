"""Sparse regression of the discrepancy in weak form, by PySINDy.

What the nominal model leaves of the accelerations is a sparse sum of candidate terms (SINDy: Brunton, Proctor, Kutz
2016, PNAS 113(15); discrepancy models: Kaheman et al. 2019, arXiv:1909.08574). In weak form (Reinbold, Gurevich,
Grigoriev 2020, PRE 101) terms are integrated over random stretches of time, so that no rate is differentiated.
"""

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pysindy as ps
from pysindy.utils import AxesArray
from scipy.integrate import cumulative_trapezoid

from wipx.baselines.candidates import Candidate, candidates
from wipx.baselines.case import Answer, Found, Problem, excluded
from wipx.baselines.torque import TorqueData
from wipx.baselines.torque_fit import TorqueFitter
from wipx.core.errors import check_positive
from wipx.identify.motion import motions

SEGMENT = 3.0  # [s] into which recordings are cut, since weak integrals need stretches of equal length
HALF_WIDTH = 0.25  # [s] of a stretch over which a term is integrated
PER_SEGMENT = 12  # stretches in a segment
FOLDS = 4
THRESHOLDS = tuple(np.geomspace(0.02, 1.0, 14).tolist())  # sizes of a term's contribution, shares of the discrepancy
RIDGE = 1e-2  # penalty on squared contributions, shares of the discrepancy's; terms much alike would cancel each other
TAKEN = 0.5  # share of a threshold's full effect from which it counts as there
NUDGE = 0.1  # standard deviations of an uncertain nominal number that make its column


@dataclass(frozen=True)
class SparseRegression:
    """Sequentially thresholded least squares (STLSQ); the threshold by cross-validation.

    Attributes:
        seconds: Budget of time [s]; once it is spent only the largest term is refined.
        terms: Named at most.
    """

    of_trees: ClassVar[bool] = False

    seconds: float = 10.0
    terms: int = 4

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, terms=self.terms)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Screen one column per effect, fit all of them, keep the large ones."""
        deadline = time.monotonic() + self.seconds
        data = TorqueData(motions(case.recordings, case.nominal.plant, case.noise))
        fitter = TorqueFitter(case, data)
        discrepancy = data.residual(case.nominal)
        weights = np.std(discrepancy, axis=0)
        chosen = _best_column_each(candidates(case, data), discrepancy / weights, weights)
        nuisances = _nuisances(case, data, discrepancy)
        columns = np.stack([*(c.column for c in chosen), *nuisances], axis=-1) / weights[:, None]
        weak = _weak_form(data, discrepancy / weights, columns, rng)
        shares = -_cross_validated(weak.scaled, rng)
        terms = _sensible(case, chosen, shares, weak.sizes, self.terms if time.monotonic() < deadline else 1)
        fit = fitter.nameable(fitter.fit(terms))
        needed = [name for name, loss in fitter.losses_without(fit).items() if loss > np.log(fit.independent)]
        fit = fitter.only(fit, needed)
        found = tuple(Found(name, fit.model.effects[name], loss) for name, loss in fitter.losses_without(fit).items())
        return Answer(fit.model, found, bool(found))


def _best_column_each(pool: tuple[Candidate, ...], target: np.ndarray, weights: np.ndarray) -> list[Candidate]:
    """Of each effect the column that is most like the discrepancy."""
    best: dict[str, tuple[float, Candidate]] = {}
    for candidate in pool:
        column = candidate.column / weights
        likeness = float(np.sum(column * target) ** 2 / np.sum(column**2))
        if likeness > best.get(candidate.name, (-1.0, candidate))[0]:
            best[candidate.name] = likeness, candidate
    return [candidate for _, candidate in best.values()]


def _nuisances(case: Problem, data: TorqueData, discrepancy: np.ndarray) -> list[np.ndarray]:
    """Columns of the uncertain nominal numbers."""
    moved = (
        case.nominal.with_values({name: case.nominal.value(name) * (1.0 + NUDGE * deviation)})
        for name, deviation in case.uncertainty.items()
    )
    return [data.residual(model) - discrepancy for model in moved]


@dataclass(frozen=True)
class WeakForm:
    """The regression in weak form.

    Attributes:
        terms: Integrals of the candidate terms, shape (segments, stretches, terms).
        target: Integrals of the discrepancy, shape (segments, stretches).
    """

    terms: np.ndarray
    target: np.ndarray

    @property
    def sizes(self) -> np.ndarray:
        """Root mean square of each term over that of the discrepancy, shape (terms,)."""
        return np.maximum(np.sqrt(np.mean(self.terms**2, axis=(0, 1)) / np.mean(self.target**2)), 1e-12)

    @property
    def scaled(self) -> "WeakForm":
        """Terms and discrepancy of unit size each."""
        size = np.sqrt(np.mean(self.target**2))
        return WeakForm(self.terms / (self.sizes * size), self.target / size)

    def fit(self, threshold: float, segments: np.ndarray) -> np.ndarray:
        """Coefficients of some segments, shape (terms,)."""
        rows = self.terms[segments].reshape(-1, self.terms.shape[-1])
        optimizer = ps.STLSQ(threshold=threshold, alpha=RIDGE * len(rows), max_iter=20, unbias=False)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that nothing is left is an answer like others
            optimizer.fit(rows, self.target[segments].reshape(-1, 1))
        return np.asarray(optimizer.coef_)[0]

    def error(self, coefficients: np.ndarray, segments: np.ndarray) -> np.ndarray:
        """Mean squared error of each of some segments, shape (segments,)."""
        return np.mean((self.target[segments] - self.terms[segments] @ coefficients) ** 2, axis=1)


def _weak_form(data: TorqueData, target: np.ndarray, columns: np.ndarray, rng: np.random.Generator) -> WeakForm:
    """Every joint of every segment is a trajectory of its own; all share the coefficients.

    Args:
        data: Smoothed recordings.
        target: Discrepancy, shape (rows, joints).
        columns: Terms, shape (rows, joints, terms).
        rng: Draws the stretches.
    """
    step = data.motions[0].step * (data.motions[0].kept.step or 1)
    rows = min(round(SEGMENT / step), *(len(m.t[m.kept]) for m in data.motions))
    t = np.arange(rows) * step
    state = np.random.get_state()  # PySINDy draws from numpy's global state
    np.random.seed(int(rng.integers(2**31)))
    library = ps.WeakPDELibrary(
        function_library=ps.IdentityLibrary(), spatiotemporal_grid=t, K=PER_SEGMENT, H_xt=min(HALF_WIDTH, 0.4 * t[-1])
    )
    terms, targets = [], []
    for first in _segments(data, rows):
        for j in range(target.shape[1]):
            part = slice(first, first + rows)
            drift = cumulative_trapezoid(target[part, j], dx=step, initial=0.0)
            series = AxesArray(np.column_stack([drift, columns[part, j]]), {"ax_time": 0, "ax_coord": 1})
            if not terms:
                library.fit([series])
            terms.append(np.asarray(library.transform([series])[0])[:, 1:])
            targets.append(np.asarray(library.convert_u_dot_integral(series))[:, 0])
    np.random.set_state(state)
    return WeakForm(np.stack(terms), np.stack(targets))


def _segments(data: TorqueData, rows: int) -> list[int]:
    """First rows of the segments among the kept rows of all recordings."""
    starts, begin = [], 0
    for motion in data.motions:
        length = len(motion.t[motion.kept])
        starts += [begin + k * rows for k in range(length // rows)]
        begin += length
    return starts


def _cross_validated(weak: WeakForm, rng: np.random.Generator) -> np.ndarray:
    """Coefficients at the highest threshold whose held-out error is within one standard error of the least."""
    everything = np.arange(len(weak.target))
    folds = np.array_split(rng.permutation(everything), min(FOLDS, len(everything)))
    errors = np.array(
        [
            np.concatenate([weak.error(weak.fit(level, np.setdiff1d(everything, fold)), fold) for fold in folds])
            for level in THRESHOLDS
        ]
    )
    best = int(np.argmin(errors.mean(axis=1)))
    doubt = (errors - errors[best]).std(axis=1) / np.sqrt(errors.shape[1])
    good = errors.mean(axis=1) <= errors[best].mean() + np.maximum(doubt, 1e-12)
    return weak.fit(THRESHOLDS[int(np.flatnonzero(good)[-1])], everything)


def _sensible(
    case: Problem, chosen: list[Candidate], shares: np.ndarray, sizes: np.ndarray, most: int
) -> dict[str, Mapping[str, float]]:
    """The terms that make physical sense, the largest first: their values by name.

    Args:
        case: The case.
        chosen: The effects' columns.
        shares: Contribution of each term, shape (terms,), those of uncertain nominal numbers last.
        sizes: That of a term's full dose.
        most: Number of terms.
    """
    terms: dict[str, Mapping[str, float]] = {}
    for i in np.argsort(-np.abs(shares[: len(chosen)])):
        candidate, size = chosen[i], float(shares[i] / sizes[i])
        there = size > TAKEN if not candidate.linear else size != 0.0 and (candidate.signed or size > 0.0)
        present = (*case.nominal.effects, *terms)
        if there and len(terms) < most and not excluded(candidate.name, present, case.nominal.plant):
            terms[candidate.name] = candidate.sized(size) if candidate.linear else candidate.values
    return terms
