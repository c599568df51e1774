"""Numbers of a diagnosis: estimates with 95 % intervals, and bounds of what was not found."""

from collections.abc import Mapping

import numpy as np

from wipx.core.diagnosis import Bound
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.results import NINETY_FIVE, Estimate
from wipx.diagnosis.candidates.screening import Candidate
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.nonsmooth_search import alike
from wipx.diagnosis.likelihood.sandwich import robust_deviations
from wipx.diagnosis.likelihood.variation_between_runs import Scatter, scatter_of
from wipx.effects.catalogue import effect_of
from wipx.identify.parameter_space import ParameterSpace


def estimates(fitter: Fitter, fit: Fit, nominal: Fit) -> tuple[Estimate, ...]:
    """Every number of a fit with its 95 % interval."""
    space, cube = fit.hypothesis.space, fit.hypothesis.cube
    values = space.to_values(cube)
    moving = scatter_of(fit, fitter.runs, fitter.rules.answer.moves)
    deviation = np.hypot(deviations(fitter, fit, nominal), _between_runs(fitter, fit, moving))
    as_good = alike(fitter, fit, _explained(fit, nominal))
    low = space.to_values(np.maximum(np.minimum(cube - NINETY_FIVE * deviation, as_good.min(axis=0)), 0.0))
    high = space.to_values(np.minimum(np.maximum(cube + NINETY_FIVE * deviation, as_good.max(axis=0)), 1.0))
    # A number without any influence may be anything.
    blind = np.sqrt(np.diag(fit.information)) < fitter.rules.answer.unfelt if len(cube) else np.zeros(0, dtype=bool)
    return tuple(
        Estimate(
            p.name,
            p.unit,
            p.neutral,
            float(values[i]) - turns,
            (p.low if blind[i] else float(low[i])) - turns,
            (p.high if blind[i] else float(high[i])) - turns,
            bool(cube[i] <= 0.0 or cube[i] >= 1.0),
            _meaning(space.model, p.name),
            _ends(space, cube, i, moving[i]) if i in moving else None,
        )
        for i, p in enumerate(space.free)
        for turns in [_whole_turns(p.name, float(values[i]))]
    )


def _between_runs(fitter: Fitter, fit: Fit, moving: Mapping[int, Scatter]) -> np.ndarray:
    """Standard deviations of sizes from run to run in the cube, shape (D,).

    The larger of what runs show and what is usual where no law holds exactly, divided by the root of their number.
    """
    space, cube = fit.hypothesis.space, fit.hypothesis.cube
    sizes = np.array([_is_size(p.name, space.model) for p in space.free])
    values, neutral = space.to_values(cube), space.to_values(space.neutral)
    less = values - fitter.own_rules.unsteady * (values - neutral)
    usual = np.where(sizes, np.abs(space.to_cube(less) - cube), 0.0)
    shown = np.array([moving[i].deviation if i in moving else 0.0 for i in range(len(cube))])
    return np.maximum(shown, usual / np.sqrt(fitter.runs.max() + 1))


def _is_size(name: str, model: Model) -> bool:
    """Whether a number is one "site/kind.symbol" to which an effect is proportional."""
    effect, _, symbol = name.rpartition(".")
    return name not in model.plant.parameters and symbol in effect_of(effect, model.plant).linear_in


def _ends(space: ParameterSpace, cube: np.ndarray, index: int, moving: Scatter) -> tuple[float, float]:
    """Least and largest value of a number that moves from run to run."""
    low, high = (
        float(space.to_values(np.where(np.arange(len(cube)) == index, end, cube))[index])
        for end in (moving.low, moving.high)
    )
    return low, high


def deviations(fitter: Fitter, fit: Fit, nominal: Fit) -> np.ndarray:
    """Standard deviations of the position in the cube, with all that is in doubt beside chance, shape (D,)."""
    if not len(fit.hypothesis.cube):
        return np.zeros(0)
    # A law is an approximation too: its misfit is let to be worth a small share of what it explains.
    wider = np.sqrt(1.0 + 2.0 * fitter.rules.answer.law_misfit * _explained(fit, nominal))
    chance = wider * robust_deviations(fit)
    return np.sqrt(chance**2 + shift_by_step(fitter, fit) ** 2 + doubt_of_laws(fit) ** 2)


def _explained(fit: Fit, nominal: Fit) -> float:
    return max(fit.log_likelihood - nominal.log_likelihood, 0.0)


def bounds(looked_at: list[Candidate], plant: Plant) -> tuple[Bound, ...]:
    """How large effects that were not found could be: from the sharpest look at each."""
    sharpest: dict[str, tuple[float, Bound]] = {}
    for candidate in looked_at:
        first, value = next(iter(candidate.values)), candidate.estimate
        if not np.isfinite(candidate.deviation):
            continue
        spec = effect_of(candidate.effect, plant).parameters[0]
        unit = spec.unit(angular=plant.is_angular(candidate.effect.partition("/")[0]))
        reach = NINETY_FIVE * candidate.deviation
        low = max(value - reach, spec.neutral) if spec.low >= spec.neutral else value - reach
        known = sharpest.get(candidate.effect)
        if known is None or candidate.deviation < known[0]:
            sharpest[candidate.effect] = (candidate.deviation, Bound(first, low, max(value + reach, low), unit))
    return tuple(bound for _, bound in sharpest.values())


def is_wide(p: Estimate, wide: float) -> bool:
    """Whether the half width of a number's interval is more than a share `wide` of the number itself."""
    return 0.5 * (p.high - p.low) > wide * max(abs(p.value), abs(p.value - p.nominal) if p.nominal < 1e6 else 0.0)


def _whole_turns(name: str, value: float) -> float:
    """The whole turns in a phase [rad]; nothing for other numbers."""
    return 2.0 * np.pi * round(value / (2.0 * np.pi)) if name.endswith(".phase") else 0.0


def shift_by_step(fitter: Fitter, fit: Fit) -> np.ndarray:
    """How far the position in the cube moves when the simulator halves its step, shape (D,).

    One Gauss-Newton step: the error of the integrator, and how rough the likelihood is where joints stick and slip
    between two steps.
    """
    if not len(fit.hypothesis.cube):
        return np.zeros(0)
    change = fitter.error_of_steps(fit)
    return np.abs(np.linalg.pinv(fit.information) @ (fit.jacobian[: change.size].T @ change))


def doubt_of_laws(fit: Fit) -> np.ndarray:
    """What laws leave open, in standard deviations in the cube, shape (D,)."""
    space, plant = fit.hypothesis.space, fit.hypothesis.model.plant
    share = np.zeros(len(space.free))
    for effect in fit.effects:
        law = effect_of(effect, plant)
        share[space.names.index(f"{effect}.{law.parameters[0].name}")] = law.doubt
    values = space.to_values(fit.hypothesis.cube)
    return np.abs(space.to_cube((1.0 + share) * values) - fit.hypothesis.cube)


def _meaning(model: Model, name: str) -> str:
    if name in model.plant.parameters:
        return model.plant.parameters[name].meaning
    effect, _, symbol = name.rpartition(".")
    return next(p.meaning for p in effect_of(effect, model.plant).parameters if p.name == symbol)
