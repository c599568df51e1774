"""Networks that estimate the equilibrium pitch: time of one answer in a control loop, and cost of training.

The paper's own network is left out unless it is asked for, since an epoch of it takes a minute:
python benchmarks/estimators.py lstm_paper
"""

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from kernel import BODY, RATE
from timing import Timing, interleaved, print_table

from wipx.config import build
from wipx.control.lqr import Lqr
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.learn.estimator import Workshop
from wipx.learn.onnx_model import VERSION, NetworkCard, NetworkEstimator, export
from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import TrainingSet
from wipx.sim.analytic import AnalyticSimulator

PRESETS = Path(__file__).resolve().parent.parent / "conf" / "estimator"
NETWORKS = ("cnn1d", "tcn", "transformer", "gru", "lstm")
LENGTH, PERIOD = 80, 0.015  # paper: 80 samples of about 1.2 s
TRAINING, VALIDATION = 1200, 150  # robots; paper, Sec. IV-B
ANSWERS = 100  # that are timed
EPOCHS = 3  # that are timed, after one that is not


def measure_estimators(names: tuple[str, ...] = NETWORKS) -> dict[str, dict[str, float]]:
    """Latency and cost of an epoch of every network, printed and returned by name; all on one thread."""
    import torch

    torch.set_num_threads(1)
    recipes = {name: preset(name) for name in names}
    sizes = {name: untrained(recipe) for name, recipe in recipes.items()}
    window = np.zeros((1, LENGTH, 2))
    latencies = interleaved({n: lambda e=e: e.estimate(window) for n, (e, _) in sizes.items()}, ANSWERS)
    results, lines = {}, []
    for name, recipe in recipes.items():
        latency, epoch, weights = latencies[name], _epoch(recipe), sizes[name][1]
        results[name] = {"latency_s": latency.median, "epoch_s": epoch.median, "weights": float(weights)}
        spread = f"{1e3 * latency.low:.3f} to {1e3 * latency.high:.3f}"
        lines.append((name, f"{weights / 1e6:.2f}", f"{1e3 * latency.median:.3f}", spread, f"{epoch.median:.2f}"))
    print_table(
        f"Estimators of the equilibrium pitch, windows of {LENGTH} samples, one thread; answers by onnxruntime, batch "
        f"1; epochs of {TRAINING} robots",
        ("network", "million weights", "ms/answer", "fastest to slowest", "processor s/epoch"),
        lines,
    )
    return results


def preset(name: str) -> NetworkRecipe:
    """The network of an option of `estimator`."""
    settings = yaml.safe_load((PRESETS / f"{name}.yaml").read_text(encoding="utf-8"))
    return build(settings, "estimator")


def untrained(recipe: NetworkRecipe) -> tuple[NetworkEstimator, int]:
    """An estimator as fast as a trained one, and the number of its weights."""
    from wipx.learn.networks.pitch_network import PitchNetwork

    network = PitchNetwork(recipe, LENGTH)
    with tempfile.TemporaryDirectory() as folder:
        card = NetworkCard(VERSION, type(recipe).__name__, LENGTH, PERIOD, 0.01, "")
        estimator = export(network, card, Path(folder, "estimator.onnx"))
    return estimator, sum(weights.numel() for weights in network.parameters())


def _epoch(recipe: NetworkRecipe) -> Timing:
    """Processor time of an epoch on windows of noise, which cost as much as any."""
    rng = np.random.default_rng(0)
    robots = TRAINING + VALIDATION
    part = np.repeat([0, 1], [TRAINING, VALIDATION])
    windows = rng.normal(size=(robots, LENGTH, 2)).astype(np.float32)
    training = TrainingSet(windows, rng.normal(size=robots), np.zeros((robots, 3)), part, PERIOD, {})
    plant = plant_of("wip")
    model = Model(plant, plant.complete(BODY, "benchmark"), {})
    moments: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        workshop = Workshop(
            training, model, AnalyticSimulator(threads=1), (Lqr().feedback(model), RATE), 0, Path(folder)
        )
        replace(recipe, epochs=EPOCHS + 1).prepare(workshop, lambda stage, share: moments.append(time.process_time()))
    spent = np.diff(moments)
    return Timing(float(np.median(spent)), float(spent.min()), float(spent.max()))


if __name__ == "__main__":
    measure_estimators(tuple(sys.argv[1:]) or NETWORKS)
