"""Identification: nominal model, recordings and switched-on physics in, completed model out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from wipx.core.model import Model
from wipx.core.recording import RecordingSplit
from wipx.core.results import Estimate, FitErrors, SearchHistory, Trace
from wipx.effects.catalogue import check_together, effect_of
from wipx.identify.evaluation import Judge
from wipx.identify.intervals import intervals
from wipx.identify.noise import sensor_noise
from wipx.identify.objectives import FitData, Objective
from wipx.identify.optimizers.search import Minimum, Optimizer, Watcher, unwatched
from wipx.identify.parameter_space import ParameterSpace, parameter_space, scales_of
from wipx.identify.problem import WindowProblem
from wipx.identify.resolution import resolving
from wipx.sim.simulator import Simulator, StateFeedback

AT_BOUND = 1e-4  # of the search interval
ABSENT = 1e-6  # likewise, from the neutral value
WORSE = 1.01  # ratio of errors from which a model is called worse
UNEVEN = 1.5  # ratio of the signals' errors from which their weights are set anew


@dataclass(frozen=True)
class Request:
    """What is to be identified.

    Attributes:
        nominal: The model before.
        switched_on: Effects whose parameters are all free, as "site/kind".
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        free: Further numbers, with a relative standard deviation or None.
        bounds: Search intervals that replace the usual ones [SI].
        feedback: The controller that closed the loop, and its rate [Hz]; None if unknown.
    """

    nominal: Model
    switched_on: tuple[str, ...]
    uncertainty: Mapping[str, float]
    free: Mapping[str, float | None]
    bounds: Mapping[str, tuple[float, float]]
    feedback: tuple[StateFeedback, float] | None = None


@dataclass(frozen=True)
class Identified:
    """Result of an identification.

    Attributes:
        model: The completed model.
        estimates: The identified numbers.
        fit: Errors on the recordings that were fitted.
        held_out: Errors on the others; None where there are none.
        history: Course of the search.
        traces: Recordings beside predictions, held-out ones first.
        notes: What a reader must know.
    """

    model: Model
    estimates: tuple[Estimate, ...]
    fit: FitErrors
    held_out: FitErrors | None
    history: SearchHistory
    traces: tuple[Trace, ...]
    notes: tuple[str, ...]


@threadpool_limits.wrap(limits=1, user_api="blas")  # on small matrices further threads only wait
def identify(
    request: Request,
    split: RecordingSplit,
    simulator: Simulator,
    objective: Objective,
    optimizer: Optimizer,
    *,
    horizon: float,
    rng: np.random.Generator,
    watcher: Watcher = unwatched,
) -> Identified:
    """Identify the free numbers on one part of the recordings and judge the model on the other.

    Args:
        request: What is to be identified.
        split: Recordings to fit and to judge by.
        simulator: The engine.
        objective: What agreement means.
        optimizer: How to search.
        horizon: Length of the predictions by which the models are judged [s].
        rng: Source of random starts.
        watcher: Sees the progress.

    Raises:
        InputError: see `parameter_space`, `Windows` and the objective.
    """
    nominal = request.nominal
    check_together((*nominal.effects, *request.switched_on), nominal.plant)
    prepared = nominal.with_effects({n: effect_of(n, nominal.plant).neutral for n in request.switched_on})
    scales = scales_of(prepared, split.fit)
    space = parameter_space(prepared, request.switched_on, request.uncertainty, request.free, request.bounds, scales)
    noise = sensor_noise(split.fit, nominal.plant)
    simulator = resolving(simulator, prepared, split.fit, noise)
    speeds = tuple(scales[site].velocity for site in nominal.plant.joints)
    data = FitData(split.fit, nominal, simulator, noise, speeds, request.feedback)
    problem = objective.problem(data, space)
    if isinstance(problem, WindowProblem):
        problem = problem.tempered(space.neutral)
    minimum = optimizer.minimise(problem, rng, watcher)
    if isinstance(problem, WindowProblem):
        problem, minimum = _weighed_anew(problem, minimum, optimizer, rng, watcher)
    # The search keeps a hair's breadth inside its bounds; an effect that it does not want is absent.
    unwanted = np.abs(minimum.cube - problem.space.neutral) < ABSENT
    cube = np.where(unwanted, problem.space.neutral, minimum.cube)
    values = problem.space.to_values(cube)
    completed = space.model.with_values(dict(zip(space.names, values.tolist(), strict=True)))
    judge = Judge(simulator, noise, horizon)
    nominal, completed = judge.tuned(nominal, split.fit), judge.tuned(completed, split.fit)
    fit, fit_traces = judge.compare(nominal, completed, split.fit, held_out=False)
    unseen, traces = judge.compare(nominal, completed, split.held_out, held_out=True) if split.held_out else (None, ())
    ends = intervals(problem, cube)
    estimates = _estimates(problem.space, cube, ends)
    return Identified(
        completed,
        estimates,
        fit,
        unseen,
        minimum.history,
        (*traces, *fit_traces),
        _notes(estimates, fit, unseen, minimum),
    )


def _weighed_anew(
    problem: WindowProblem, minimum: Minimum, optimizer: Optimizer, rng: np.random.Generator, watcher: Watcher
) -> tuple[WindowProblem, Minimum]:
    """Search once more, signals and windows weighed by the errors that remained.

    Weights from the sensor noise are right for a perfect model only; where one signal or one
    window fits far worse than its noise it would drown the others.
    """
    weighed = problem.reweighted(minimum.cube).tempered(minimum.cube)
    signals = weighed.predictor.noise / problem.predictor.noise
    before, after = problem.weights, weighed.weights
    windows_alike = before is not None and after is not None and np.allclose(before, after, atol=0.2)
    if signals.max() / signals.min() < UNEVEN and windows_alike:
        return problem, minimum
    start = problem.space.to_values(minimum.cube)
    free = tuple(replace(p, start=float(v)) for p, v in zip(problem.space.free, start, strict=True))
    weighed = replace(weighed, space=replace(problem.space, free=free), near=True, short=None)
    again = optimizer.minimise(weighed, rng, watcher)
    return weighed, replace(again, history=_joined(minimum.history, again.history))


def _joined(first: SearchHistory, second: SearchHistory) -> SearchHistory:
    """Two searches one after the other; the losses of the second are in its own weights."""
    return SearchHistory(
        second.optimizer,
        np.concatenate([first.evaluations, first.evaluations[-1] + second.evaluations]),
        np.concatenate([first.seconds, first.seconds[-1] + second.seconds]),
        np.concatenate([first.best_loss, second.best_loss]),
        second.stopped,
    )


def _estimates(space: ParameterSpace, cube: np.ndarray, ends: np.ndarray) -> tuple[Estimate, ...]:
    values = space.to_values(cube)
    return tuple(
        Estimate(
            p.name,
            p.unit,
            p.neutral,
            float(values[i]),
            float(ends[i, 0]),
            float(ends[i, 1]),
            bool((cube[i] < AT_BOUND and p.low != p.neutral) or cube[i] > 1.0 - AT_BOUND),
            _meaning(space.model, p.name),
        )
        for i, p in enumerate(space.free)
    )


def _meaning(model: Model, name: str) -> str:
    if name in model.plant.parameters:
        return model.plant.parameters[name].meaning
    effect, _, symbol = name.rpartition(".")
    return next(p.meaning for p in effect_of(effect, model.plant).parameters if p.name == symbol)


def _notes(
    estimates: tuple[Estimate, ...], fit: FitErrors, held_out: FitErrors | None, minimum: Minimum
) -> tuple[str, ...]:
    notes = [
        f"{e.name} stopped at the end of its search interval, {e.value:.4g} {e.unit}; "
        f"set bounds={{{e.name}: [low, high]}} if it may lie beyond"
        for e in estimates
        if e.at_bound
    ]
    if held_out is None:
        notes.append("No recording was held out: the errors below are those of the fit itself.")
    else:
        notes += [
            f"{name}: the completed model predicts held-out recordings worse than the nominal one"
            for name in held_out.completed
            if held_out.completed[name] > WORSE * held_out.nominal[name]
        ]
    if minimum.failed:
        notes.append(f"{minimum.failed} of {minimum.history.evaluations[-1]} candidates diverged in every prediction.")
    return tuple(notes)
