"""What a diagnosis of a dirty robot is measured by: its true effects, fitted at the horizon of the judging.

No law of a dirty robot holds exactly, so values other than the true ones predict best.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.identify.noise import sensor_noise
from wipx.identify.objectives import FitData, Windowed
from wipx.identify.optimizers.least_squares import LeastSquares
from wipx.identify.parameter_space import parameter_space, scales_of
from wipx.identify.problem import WindowProblem
from wipx.sim.simulator import Simulator

SEARCH = LeastSquares(starts=1, smoothing=(0.03, 0.003, 0.0), seconds=120.0)  # the true values are near the minimum


def best_fit(
    nominal: Model, effects: Mapping[str, Mapping[str, float]], recordings: tuple[Recording, ...], simulator: Simulator
) -> Model:
    """The nominal model with some effects, fitted to 0.5 s predictions of recordings.

    Args:
        nominal: The owner's model.
        effects: Values of the parameters to start from [SI], by "site/kind"; without any the nominal model is returned.
        recordings: Those that a diagnosis reads.
        simulator: The engine.
    """
    if not effects:
        return nominal
    model = nominal.with_effects(effects)
    scales = scales_of(model, recordings)
    space = parameter_space(model, tuple(effects), {}, {}, {}, scales)
    true = {f"{name}.{symbol}": value for name, values in effects.items() for symbol, value in values.items()}
    starts = {p.name: true.get(p.name, p.start) for p in space.free}
    free = tuple(
        replace(p, low=min(p.low, start), high=max(p.high, start), start=start)
        for p, start in zip(space.free, starts.values(), strict=True)
    )
    space = replace(space, model=space.model.with_values(starts), free=free)
    speeds = tuple(scales[site].velocity for site in nominal.plant.joints)
    data = FitData(recordings, nominal, simulator, sensor_noise(recordings, nominal.plant), speeds, None)
    problem = Windowed(HORIZON).problem(data, space)
    # first each signal and window gets its weight by the error that the true values leave
    problem = problem.reweighted(space.start).tempered(space.start)
    try:
        fitted = SEARCH.minimise(problem, np.random.default_rng(0))
    except (InputError, ArithmeticError, np.linalg.LinAlgError):
        return model
    return _better(problem, model, fitted.cube)


def _better(problem: WindowProblem, start: Model, cube: np.ndarray) -> Model:
    """The model at a position, or the one that the search began with where that predicts better."""
    space = problem.space
    before, after = problem.losses(np.stack([space.start, cube]))
    if not after < before:
        return start
    return space.model.with_values(dict(zip(space.names, space.to_values(cube).tolist(), strict=True)))
