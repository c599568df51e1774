"""Inverse dynamics with instrumental variables: the way in which robot arms are identified in the literature.

Janot, Vandanjon, Gautier 2014, A generic instrumental variable approach for industrial robot identification, IEEE TCST
22(1). Forces of the drives are regressed on friction, rotor inertias, offsets and what links may carry. Noise in the
positions makes least squares wrong; instruments are the same regressors, evaluated at the motion that the model
simulates. Effects are chosen one by one by the Bayesian information criterion.
"""

import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from wipx.baselines.case import Answer, Found, Problem
from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.effects.catalogue import effect_of
from wipx.identify.inverse_dynamics import Signals, missing, regressor, signals_of, weight_of
from wipx.identify.motion import Motion, independent_rows, motions
from wipx.identify.prediction import Predictor
from wipx.identify.windows import cut

ROUNDS = 4  # of simulating instruments anew; the paper's stop after two to four
STEPS = 4  # of Gauss and Newton in each: only a payload's place is not linear
SLOPE = 1e-3  # of the search interval, for slopes
CERTAIN = 4.0  # standard deviations from neutral by which an effect must differ to be named
LEAD = 0.1  # [s] before a simulation from which its state is estimated
SECONDS = 0.5  # of a simulation
MOST = 5  # effects of each joint
NAMED = {  # kinds that are fitted, by class of site
    "joint": ("viscous", "coulomb", "rotor_inertia"),
    "drive": ("offset", "gain"),
    "link": ("payload", "com_offset", "inertia"),
}


@dataclass(frozen=True)
class InstrumentalVariables:
    """Forward selection by least squares, estimates by instrumental variables.

    Attributes:
        seconds: Budget of time [s], for each joint.
    """

    of_trees: ClassVar[bool] = True

    seconds: float = 10.0

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Choose effects, estimate them, and name those that differ from neutral for certain.

        Raises:
            InputError: the robot is not from a model file.
        """
        if case.nominal.plant.tree is None:
            raise InputError("baseline=instrumental_variables is for robots from model files; use baseline=regression")
        deadline = time.monotonic() + case.budget(self.seconds)
        data = _Data.of(case)
        model, chosen = data.selected(deadline)
        found = data.estimated(model, chosen, deadline)
        while chosen and found.least_certain < CERTAIN:
            chosen = tuple(name for name in chosen if name != found.weakest)
            model = replace(found.model, effects={n: v for n, v in found.model.effects.items() if n != found.weakest})
            found = data.estimated(model, chosen, deadline)
        effects = tuple(Found(name, found.model.effects[name], found.certainty[name] ** 2) for name in chosen)
        return Answer(found.model, effects, bool(effects))


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Effects with values.

    Attributes:
        model: With them.
        certainty: Standard deviations from neutral, by effect.
    """

    model: Model
    certainty: dict[str, float]

    @property
    def weakest(self) -> str:
        """The effect that differs least from neutral."""
        return min(self.certainty, key=lambda name: self.certainty[name])

    @property
    def least_certain(self) -> float:
        """Its certainty."""
        return min(self.certainty.values(), default=np.inf)


@dataclass(frozen=True, eq=False)
class _Data:
    """Smoothed recordings of a case.

    Attributes:
        case: The case.
        motions: One for each recording.
        signals: All kept rows.
        carried: Their regressor.
        size: Deviation of each joint's missing force with the owner's model, shape (joints,).
    """

    case: Problem
    motions: tuple[Motion, ...]
    signals: Signals
    carried: np.ndarray
    size: np.ndarray

    @classmethod
    def of(cls, case: Problem) -> "_Data":
        """Smooth the recordings of a case."""
        plant = case.nominal.plant
        assert plant.tree is not None
        smoothed = motions(case.recordings, plant, case.noise)
        signals = signals_of(case.nominal, smoothed)
        carried = regressor(plant.tree, signals, weight_of(case.nominal))
        size = np.std(missing(case.nominal, signals, carried), axis=0)
        return cls(case, smoothed, signals, carried, np.maximum(size, 1e-9))

    def selected(self, deadline: float) -> tuple[Model, tuple[str, ...]]:
        """Effects chosen one by one by least squares, as long as the criterion falls."""
        plant, model = self.case.nominal.plant, self.case.nominal
        pool = [
            n for n in self.case.vocabulary if n.partition("/")[2] in NAMED.get(plant.class_of(n.partition("/")[0]), ())
        ]
        chosen: list[str] = []
        size = self.size
        while pool and len(chosen) < MOST * len(plant.joints) and time.monotonic() < deadline:
            rest = missing(model, self.signals, self.carried) / size
            own = self._columns(model, chosen, size)
            basis = np.linalg.qr(own)[0] if own.size else np.zeros((rest.size, 0))
            gains = {name: self._gain(model, name, rest.ravel(), basis, size) for name in pool}
            best = max(gains, key=lambda name: gains[name])
            if gains[best] <= 0.0:
                break
            chosen.append(best)
            pool.remove(best)
            model = self._fitted(model, chosen, size)
            size = np.maximum(np.std(missing(model, self.signals, self.carried), axis=0), 1e-9)
        return model, tuple(chosen)

    def _gain(self, model: Model, name: str, rest: np.ndarray, basis: np.ndarray, size: np.ndarray) -> float:
        """Gain of log-likelihood by an effect, less its price."""
        columns = self._columns(model, [name], size)
        columns = columns - basis @ (basis.T @ columns)
        strong = np.linalg.norm(columns, axis=0) > 0.0
        if not strong.any():
            return -np.inf
        free, sizes, _ = np.linalg.svd(columns[:, strong], full_matrices=False)
        free = free[:, sizes > 1e-4 * sizes[0]]
        explained = float(np.sum((free.T @ rest) ** 2))
        rows = independent_rows(rest.reshape(self.signals.rates.shape))
        before = float(rest @ rest)
        price = 0.5 * free.shape[1] * np.log(max(rows, 2.0))
        return 0.5 * rows * float(np.log(before / max(before - explained, 1e-12 * before))) - price

    def _fitted(self, model: Model, names: list[str], size: np.ndarray) -> Model:
        """Least squares over all chosen effects."""
        model = _with(model, names, self.case)
        for _ in range(STEPS):
            columns = self._columns(model, names, size)
            rest = (missing(model, self.signals, self.carried) / size).ravel()
            model = _moved(model, names, -np.linalg.lstsq(columns, rest, rcond=1e-8)[0])
        return model

    def estimated(self, model: Model, names: tuple[str, ...], deadline: float) -> _Estimate:
        """Estimates by instrumental variables, and how certain they are."""
        size = np.maximum(np.std(missing(model, self.signals, self.carried), axis=0), 1e-9)
        listed = list(names)
        if not listed:
            return _Estimate(model, {})
        instruments, covariance = None, np.zeros((0, 0))
        for number in range(ROUNDS):
            simulated = self._simulated(model) if number == 0 or time.monotonic() < deadline else None
            columns = self._columns(model, listed, size)
            if simulated is not None:
                instruments = self._columns(model, listed, size, simulated)
            z = columns if instruments is None else instruments
            rest = (missing(model, self.signals, self.carried) / size).ravel()
            inverse = np.linalg.pinv(z.T @ columns, rcond=1e-9)
            moved = _moved(model, listed, -inverse @ (z.T @ rest))
            after = missing(moved, self.signals, self.carried) / size
            if not np.sum(after**2) < 2.0 * np.sum(rest**2):
                break
            model = moved
            rows = independent_rows(after)
            spread = float(np.mean(after**2)) * after.shape[0] / rows
            covariance = spread * inverse @ (z.T @ z) @ inverse.T
        return _Estimate(model, _certainty(model, listed, covariance))

    def _columns(self, model: Model, names: list[str], size: np.ndarray, signals: Signals | None = None) -> np.ndarray:
        """Slopes of the missing force, in deviations, by the parameters of some effects, shape (rows joints, P)."""
        plant = self.case.nominal.plant
        assert plant.tree is not None
        seen = self.signals if signals is None else signals
        carried = self.carried if signals is None else regressor(plant.tree, seen, weight_of(model))
        model = _with(model, names, self.case)
        base, found = missing(model, seen, carried), []
        for name, symbol in _numbers(model, names):
            step = SLOPE * _scale(name, symbol, self.case)
            more = model.with_values({f"{name}.{symbol}": model.effects[name][symbol] + step})
            found.append(((missing(more, seen, carried) - base) / step / size).ravel())
        return np.stack(found, axis=1) if found else np.zeros((base.size, 0))

    def _simulated(self, model: Model) -> Signals:
        """The motion that the model predicts, on the same rows as `signals`."""
        case = self.case
        windows = cut(case.recordings, case.nominal.plant, horizon=SECONDS, lead=LEAD)
        predicted = Predictor(case.simulator, windows, case.noise).predict(ModelBatch(model)).coordinates[:, :, 0]
        moved = []
        for number, recording in enumerate(case.recordings):
            columns = {name: recording[name].copy() for name in case.nominal.plant.coordinates}
            for r in np.flatnonzero(windows.recording == number):
                rows = np.flatnonzero(windows.predicted[:, r])
                place = windows.row[r] + rows
                for j, name in enumerate(columns):
                    columns[name][place] = np.nan_to_num(predicted[rows, j, r], nan=float(np.mean(columns[name])))
            moved.append(Recording(recording.name, {**recording.columns, **columns}, periods=recording.periods))
        again = motions(tuple(moved), case.nominal.plant, case.noise)
        return signals_of(case.nominal, again)


def _with(model: Model, names: list[str], case: Problem) -> Model:
    """The model with the effects that it lacks: neutral, but with a little of a payload, whose place shows then."""
    plant = case.nominal.plant
    added = {}
    for name in names:
        if name not in model.effects:
            added[name] = dict(effect_of(name, plant).neutral)
            if name.endswith("/payload"):
                added[name]["mass"] = 0.02 * case.scales[name.partition("/")[0]].mass
    return model.with_effects(added)


def _numbers(model: Model, names: list[str]) -> list[tuple[str, str]]:
    return [(name, symbol) for name in names for symbol in model.effects[name]]


def _scale(name: str, symbol: str, case: Problem) -> float:
    parameter = next(p for p in effect_of(name, case.nominal.plant).parameters if p.name == symbol)
    return case.scales[name.partition("/")[0]].of(parameter.dimension)


def _moved(model: Model, names: list[str], change: np.ndarray) -> Model:
    """The model after a change of its parameters; those for one sign alone stay on their side."""
    plant: Plant = model.plant
    values = {}
    for (name, symbol), step in zip(_numbers(model, names), change, strict=True):
        parameter = next(p for p in effect_of(name, plant).parameters if p.name == symbol)
        value = model.effects[name][symbol] + float(step)
        if parameter.low >= 0.0:
            value = max(value, 0.05 if parameter.low > 0.0 else 1e-9)
        values[f"{name}.{symbol}"] = value
    return model.with_values(values)


def _certainty(model: Model, names: list[str], covariance: np.ndarray) -> dict[str, float]:
    """Distance of each effect from neutral in standard deviations (Wald), per number of it."""
    found, where = {}, [name for name, _ in _numbers(model, names)]
    for name in names:
        neutral = effect_of(name, model.plant).neutral
        at = [i for i, other in enumerate(where) if other == name]
        symbols = list(model.effects[name])
        if name.endswith("/payload"):  # its place has no neutral value
            at, symbols = at[:1], symbols[:1]
        away = np.array([model.effects[name][symbol] - neutral[symbol] for symbol in symbols])
        own = covariance[np.ix_(at, at)] if covariance.size else np.eye(len(at))
        found[name] = float(np.sqrt(max(away @ np.linalg.pinv(own) @ away, 0.0) / len(at)))
    return found
