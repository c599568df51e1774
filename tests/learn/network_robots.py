"""Simulated robots under random loads, and small networks, that the tests of the networks share."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from wipx.control.lqr import Lqr
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.learn.dataset import Watch, generate
from wipx.learn.estimator import PitchEstimate, Workshop
from wipx.learn.networks.cnn1d import Cnn1d
from wipx.learn.networks.recurrent import Gru, Lstm
from wipx.learn.networks.tcn import Tcn
from wipx.learn.networks.transformer import Transformer
from wipx.learn.onnx_model import NetworkEstimator
from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import PARTS, TrainingSet
from wipx.sim.analytic import AnalyticSimulator

LENGTH = 40
BODY = {"body_mass": 5.0, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.15}
WHEEL = {"wheel_inertia": 0.0023, "wheel_radius": 0.0625}
WIP = Model(plant_of("wip"), plant_of("wip").complete({**BODY, **WHEEL}, "test"), {})
REGULATOR = (Lqr().feedback(WIP), 650.0)
SIMULATOR = AnalyticSimulator(step=2e-3, threads=1)  # one step per row of the regulator
SMALL: dict[str, NetworkRecipe] = {
    "lstm": Lstm(width=16, layers=1, epochs=15, batch=32, learning_rate=1e-2),
    "gru": Gru(width=16, layers=1, epochs=15, batch=32, learning_rate=1e-2),
    "tcn": Tcn(width=16, layers=4, kernel=3, epochs=15, batch=32, learning_rate=3e-3),
    "transformer": Transformer(width=16, layers=1, heads=2, epochs=15, batch=32, learning_rate=3e-3),
    "cnn1d": Cnn1d(width=16, layers=2, kernel=5, epochs=15, batch=32, learning_rate=3e-3),
}


def robots(samples: int, seed: int) -> TrainingSet:
    """Robots with the paper's noise; two thirds for training, one third for validation."""
    made = generate(
        ModelBatch(WIP), REGULATOR, SIMULATOR, Watch(samples=samples, length=LENGTH), np.random.default_rng(seed)
    )
    return replace(made, part=np.where(np.arange(samples) % 3, PARTS.index("train"), PARTS.index("validation")))


def workshop(training: TrainingSet, folder: Path, seed: int = 0) -> Workshop:
    """All that a network is made of."""
    return Workshop(training, WIP, SIMULATOR, REGULATOR, seed, folder)


def prepared(recipe: NetworkRecipe, training: TrainingSet, folder: Path, seed: int = 0) -> NetworkEstimator:
    """Train without anybody watching."""
    return recipe.prepare(workshop(training, folder, seed), lambda stage, share: None)


def rmse(errors: np.ndarray) -> float:
    """Root mean square [rad]."""
    return float(np.sqrt(np.mean(errors**2)))


def coverage(estimate: PitchEstimate, pitch: np.ndarray) -> float:
    """Share of the true pitches that lie in their intervals."""
    return float(np.mean((estimate.low <= pitch) & (pitch <= estimate.high)))
