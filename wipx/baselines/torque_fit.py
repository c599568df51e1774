"""Least squares on the torque residual: all parameters of some effects, and the uncertain nominal ones."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from wipx.baselines.case import Problem
from wipx.baselines.torque import TorqueData
from wipx.core.model import Model
from wipx.identify.motion import independent_rows
from wipx.identify.parameter_space import ParameterSpace, parameter_space

SECANT = 1e-3  # finite-difference step in the unit cube
INSIDE = 1e-6  # of the cube, from its faces
SLOWEST = 3.0  # times the speed that noise feigns: Stribeck velocities below it cannot be seen
STEPS = 12  # of the least-squares search, at most


@dataclass(frozen=True)
class TorqueFit:
    """A model that was fitted to the torque residual.

    Attributes:
        effects: Those that were added to the nominal model.
        model: With the fitted values.
        residual: What it leaves unexplained, shape (rows, joints) [m/s^2, rad/s^2].
        slopes: Change of the residual with each fitted number in the unit cube, shape (D, rows, joints).
        independent: Rows that are worth as much as all of them, had they no colour.
        prior: Squared distance of the uncertain numbers from the owner's, in standard deviations.
    """

    effects: tuple[str, ...]
    model: Model
    residual: np.ndarray
    slopes: np.ndarray
    independent: float
    prior: float

    @cached_property
    def deviation(self) -> np.ndarray:
        """Size of the residual of each joint, shape (joints,) [m/s^2, rad/s^2]."""
        return np.sqrt(np.mean(self.residual**2, axis=0))

    @property
    def log_likelihood(self) -> float:
        """With the deviations at their best values, and priors, in nats."""
        return -self.independent * float(np.sum(np.log(self.deviation))) - 0.5 * self.prior

    def gain(self, other: "TorqueFit") -> float:
        """Log-likelihood by which this fit is better than another, in nats; rows count as in this one."""
        return self.log_likelihood - replace(other, independent=self.independent).log_likelihood

    def criterion(self, parameters: int) -> float:
        """Bayesian information criterion of a model with so many numbers, in nats; the higher the better."""
        return self.log_likelihood - 0.5 * parameters * np.log(self.independent)


@dataclass(frozen=True)
class TorqueFitter:
    """Fits models of a case.

    Attributes:
        case: The case.
        data: Its smoothed recordings.
    """

    case: Problem
    data: TorqueData

    def fit(self, effects: Mapping[str, Mapping[str, float]], weights: np.ndarray | None = None) -> TorqueFit:
        """The nominal model with some effects, fitted.

        Args:
            effects: Values from which each begins [SI].
            weights: Deviation of each joint's residual, shape (joints,); None for that of the nominal model.
        """
        nominal = self.case.nominal.with_effects(effects)
        size = np.std(self.data.residual(self.case.nominal), axis=0) if weights is None else weights
        if not (effects or self.case.uncertainty):
            residual = self.data.residual(nominal)
            return TorqueFit((), nominal, residual, np.zeros((0, *residual.shape)), independent_rows(residual), 0.0)
        space = self._space(nominal, effects)

        def model_at(cube: np.ndarray) -> Model:
            return nominal.with_values(dict(zip(space.names, space.to_values(cube).tolist(), strict=True)))

        def residuals(cube: np.ndarray) -> np.ndarray:
            scaled = self.data.residual(model_at(cube)) / size
            return np.concatenate([scaled.ravel(), space.prior_residuals(cube)[0]])

        start = np.clip(space.start, INSIDE, 1.0 - INSIDE)
        found = least_squares(residuals, start, bounds=(0.0, 1.0), diff_step=SECANT, max_nfev=STEPS, x_scale="jac")
        priors = space.prior_residuals(found.x)[0]
        model = model_at(found.x)
        residual = self.data.residual(model)
        rows = found.jac[: residual.size].T.reshape(-1, *residual.shape)
        independent = independent_rows(residual)
        return TorqueFit(tuple(effects), model, residual, rows * size, independent, float(np.sum(priors**2)))

    def only(self, fit: TorqueFit, names: Collection[str]) -> TorqueFit:
        """A fit with some of a fit's effects, fitted anew where that is fewer."""
        kept = {name: fit.model.effects[name] for name in fit.effects if name in names}
        return fit if len(kept) == len(fit.effects) else self.fit(kept, fit.deviation)

    def nameable(self, fit: TorqueFit) -> TorqueFit:
        """A fit without delays and lags that are too short for the log."""
        shortest = self.data.shortest_delay
        return self.only(fit, [name for name in fit.effects if fit.model.effects[name].get("tau", np.inf) > shortest])

    def without_each(self, fit: TorqueFit) -> dict[str, TorqueFit]:
        """Fits without one of a fit's effects each, the others fitted anew, by the effect's name."""
        return {name: self.only(fit, [other for other in fit.effects if other != name]) for name in fit.effects}

    def losses_without(self, fit: TorqueFit) -> dict[str, float]:
        """Log-likelihood that is lost without each of a fit's effects, in nats."""
        return {name: max(fit.gain(trial), 0.0) for name, trial in self.without_each(fit).items()}

    def _space(self, nominal: Model, effects: Mapping[str, Mapping[str, float]]) -> ParameterSpace:
        space = parameter_space(
            nominal, tuple(effects), self.case.uncertainty, {}, self._seen(effects), self.case.scales
        )
        begun = [replace(p, start=float(np.clip(nominal.value(p.name), p.low, p.high))) for p in space.free]
        return ParameterSpace(space.model, tuple(begun))

    def _seen(self, effects: Mapping[str, Mapping[str, float]]) -> dict[str, tuple[float, float]]:
        """Intervals of Stribeck velocities that smoothed rates can show [m/s or rad/s]."""
        plant = self.case.nominal.plant
        slowest = dict(zip(plant.joints, SLOWEST * self.data.motions[0].rest_speeds, strict=True))
        return {
            f"{name}.v_s": (float(slowest[site]), 2.0 * max(self.case.scales[site].velocity, float(slowest[site])))
            for name in effects
            for site, _, kind in [name.partition("/")]
            if kind == "stribeck"
        }
