"""How short the integrator's steps must be for what the sensors of a robot can see."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.identify.evaluation import Judge
from wipx.identify.smoothing import BANDWIDTHS
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import Simulator

Engine = TypeVar("Engine", bound=Simulator)

FINEST = 0.25  # of the usual step
AHEAD = 0.1  # [s] of prediction: longer ones of a wrong model fall over in many ways


def resolving(simulator: Engine, model: Model, recordings: tuple[Recording, ...], noise: np.ndarray) -> Engine:
    """A simulator with steps so short that halving them changes short predictions less than the sensors' noise does.

    A robot from a model file may have drives whose own loops are faster than the usual step. Other plants have none.
    Predictions start from states that hardly trust the model, so that they move as the robot does, however wrong it is.

    Args:
        simulator: With the usual step.
        model: Whose predictions count.
        recordings: What they predict.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
    """
    if model.plant.tree is None or not isinstance(simulator, AnalyticSimulator):
        return simulator
    shortest = FINEST * simulator.step
    judge = Judge(simulator, noise, AHEAD, dict.fromkeys(model.plant.coordinates, BANDWIDTHS[-1]))
    same = judge.from_same_states(model, recordings)
    predicted = np.broadcast_to(same.starts.windows.predicted[:, None], same.starts.windows.recorded.shape)
    shown = same.predicted(model, simulator)
    while simulator.step > shortest:
        finer = replace(simulator, step=0.5 * simulator.step)
        better = same.predicted(model, finer)
        if np.all(np.mean((better - shown) ** 2, axis=(0, 2), where=predicted) <= noise**2):
            break
        simulator, shown = finer, better
    return simulator
