"""A black box beside the model: a small network learns the acceleration that the nominal model lacks.

Residual learning of dynamics (Saveriano et al. 2017, ICRA; Golemo et al. 2018, CoRL). It names nothing: all it can
say is whether a recording that it was not trained on becomes more predictable. Trained with PyTorch, which is an
extra of this package; predictions need numpy only.
"""

import importlib
import time
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from wipx.baselines.case import Answer, Problem
from wipx.baselines.learned_simulator import learned_simulator
from wipx.baselines.network import ResidualAcceleration
from wipx.baselines.torque import TorqueData
from wipx.core.errors import InputError, check_positive
from wipx.identify.evaluation import Judge
from wipx.identify.motion import Motion, motions

EXPLAINED = 0.1  # share of the squared residual acceleration of unseen rows from which the model is called wrong
RATE = 3e-3  # of Adam, falls to a hundredth
BATCH = 512
DECAY = 1e-4  # of the weights
ALL_EPOCHS = 400
PATIENCE = 40  # epochs without a better result on unseen rows


@dataclass(frozen=True)
class ResidualNetwork:
    """A perceptron with two hidden layers on coordinates, rates and commands.

    Attributes:
        seconds: Budget of time [s].
        hidden: Neurons of a layer.
    """

    of_trees: ClassVar[bool] = False

    seconds: float = 10.0
    hidden: int = 24

    def __post_init__(self) -> None:
        check_positive(seconds=self.seconds, hidden=self.hidden)

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Train on two thirds of every recording, stop by the last third."""
        torch = _torch()
        data = TorqueData(motions(case.recordings, case.nominal.plant, case.noise))
        targets = data.residual(case.nominal)
        features = np.concatenate([_features(motion) for motion in data.motions])
        unseen = np.concatenate([_last_third(motion) for motion in data.motions])
        network, explained = self._trained(torch, features, targets, unseen, rng)
        wrong = explained > EXPLAINED
        useful = wrong and _predicts_better(case, network)
        note = (
            f"The network explains {100.0 * explained:.0f} % of the residual acceleration that it was not trained on."
        )
        return Answer(case.nominal, (), wrong, network if useful else None, (note,))

    def _trained(
        self, torch: Any, features: np.ndarray, targets: np.ndarray, unseen: np.ndarray, rng: np.random.Generator
    ) -> tuple[ResidualAcceleration, float]:
        """The network at its best epoch, and the share of unseen squared residuals that it explains."""
        deadline = time.monotonic() + self.seconds
        torch.manual_seed(int(rng.integers(2**31)))
        torch.set_num_threads(1)
        low, high = features.min(axis=0), np.maximum(features.max(axis=0), features.min(axis=0) + 1e-9)
        scale = np.std(targets, axis=0)
        inputs = torch.as_tensor(2.0 * (features - low) / (high - low) - 1.0, dtype=torch.float32)
        outputs = torch.as_tensor(targets / scale, dtype=torch.float32)
        held = torch.as_tensor(unseen)
        net = torch.nn.Sequential(
            torch.nn.Linear(features.shape[1], self.hidden),
            torch.nn.Tanh(),
            torch.nn.Linear(self.hidden, self.hidden),
            torch.nn.Tanh(),
            torch.nn.Linear(self.hidden, targets.shape[1]),
        )
        optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, ALL_EPOCHS, eta_min=0.01 * RATE)
        train = torch.nonzero(~held)[:, 0]
        lowest, best, since = float("inf"), _layers(net), 0
        for _ in range(ALL_EPOCHS):
            for rows in train[torch.randperm(len(train))].split(BATCH):
                optimizer.zero_grad()
                torch.mean((net(inputs[rows]) - outputs[rows]) ** 2).backward()
                optimizer.step()
            schedule.step()
            with torch.no_grad():
                error = float(torch.mean((net(inputs[held]) - outputs[held]) ** 2))
            since += 1
            if error < lowest:
                lowest, best, since = error, _layers(net), 0
            if since > PATIENCE or time.monotonic() > deadline:
                break
        explained = 1.0 - lowest / float(torch.mean(outputs[held] ** 2))
        first, second, last = best
        return ResidualAcceleration(low, high, first, second, last, scale), explained


def _predicts_better(case: Problem, network: ResidualAcceleration) -> bool:
    """Whether 0.5 s predictions of the last recording gain; a good acceleration can still fall over in a rollout."""
    judge = Judge(case.simulator, case.noise, 0.5)
    learned = replace(judge, simulator=learned_simulator(network, case.noise))
    before, after = (
        j.compare(case.nominal, case.nominal, case.recordings[-1:], held_out=True)[0].completed
        for j in (judge, learned)
    )
    return sum((after[name] / before[name]) ** 2 for name in before) < len(before)


def _torch() -> Any:
    try:
        return importlib.import_module("torch")
    except ModuleNotFoundError as error:
        raise InputError("baseline=residual_network needs PyTorch; pip install torch==2.13.0") from error


def _features(motion: Motion) -> np.ndarray:
    """Coordinates, rates and filtered commands at the kept rows, shape (rows, features)."""
    signals = [motion.coordinates, motion.rates, motion.filtered(motion.commands())]
    return np.concatenate(signals, axis=1)[motion.kept]


def _last_third(motion: Motion) -> np.ndarray:
    """Which of the kept rows belong to the last third of the recording."""
    rows = len(motion.t[motion.kept])
    return np.arange(rows) >= (2 * rows) // 3


def _layers(net: Any) -> tuple[np.ndarray, ...]:
    """Weights of the three layers, biases in the last column."""
    linear = [layer for layer in net if hasattr(layer, "weight")]
    return tuple(
        np.column_stack([layer.weight.detach().double().numpy(), layer.bias.detach().double().numpy()])
        for layer in linear
    )
