"""Pendulums that hang and are driven by sums of sines: stable, so that no controller is needed."""

from collections.abc import Mapping

import numpy as np

from wipx.baselines.case import Problem
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

SIMULATOR = AnalyticSimulator(threads=1)
BODY = {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037}
NOISE = 3e-4  # [rad]
RATE = 200.0  # [Hz]
COULOMB = {"pitch/coulomb": {"F_c": 0.15}}
VISCOUS = {"pitch/viscous": {"sigma": 0.08}}
Effects = Mapping[str, Mapping[str, float]]


def pendulum(effects: Effects) -> Model:
    plant = plant_of("pendulum")
    return Model(plant, plant.complete(BODY, "test"), effects)


def record(
    effects: Effects, rng: np.random.Generator, *, count: int = 3, noise: float = NOISE, drive: float = 0.4
) -> tuple[Recording, ...]:
    inputs = Inputs.regular(8.0, RATE, 1, count)
    t = inputs.t[:-1, 0]
    frequencies, phases = rng.uniform(0.2, 1.5, (4, count)), rng.uniform(0.0, 6.28, (4, count))
    command = drive * np.sin(6.28 * t[:, None, None] * frequencies + phases).sum(axis=1)
    driven = Inputs(inputs.t, command[:, None], inputs.first, inputs.last)
    initial = np.stack([np.full((1, count), np.pi), np.zeros((1, count))])
    theta = SIMULATOR.replay(ModelBatch(pendulum(effects)), driven, initial).coordinates[:-1, 0, 0]
    theta = theta + noise * rng.standard_normal(theta.shape)
    return tuple(Recording(f"r{r}.csv", {"t": t, "theta": theta[:, r], "u": command[:, r]}) for r in range(count))


def case(effects: Effects, rng: np.random.Generator, noise: float = NOISE) -> Problem:
    return Problem(record(effects, rng, noise=noise), pendulum({}), {}, SIMULATOR)
