"""Supervised training on Lightning: mean squared error, early stopping, the best weights kept.

PyTorch takes as many threads as the processor has cores, or as OMP_NUM_THREADS says, and a graphics processor where
there is one.
"""

import logging
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from lightning.pytorch.callbacks import EarlyStopping
from torch import Tensor
from torch.nn.functional import mse_loss
from torch.optim.lr_scheduler import CosineAnnealingLR
from torch.utils.data import BatchSampler, DataLoader, RandomSampler, SequentialSampler, TensorDataset

from wipx.core.errors import InputError
from wipx.learn.estimator import Watcher, Workshop
from wipx.learn.networks.pitch_network import PitchNetwork
from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import TrainingSet

STOPPING = "stopping_loss"  # name that Lightning logs it under
HELD_BACK = 10  # one in so many training robots decides when to stop


@dataclass(frozen=True)
class Trained:
    """A network at its best epoch, on the processor.

    Attributes:
        network: In evaluation mode.
        epochs: Done.
        best_epoch: Whose weights were kept, counted from 1.
        stopping_rmse: On the robots that decide when to stop [rad].
    """

    network: PitchNetwork
    epochs: int
    best_epoch: int
    stopping_rmse: float


@dataclass(frozen=True)
class Division:
    """A training part, divided.

    Attributes:
        learning: Robots whose errors the weights follow.
        stopping: One in ten, which decide when to stop. They are not taken from the validation part: errors on
            robots that have chosen the weights are too small to calibrate an interval, and the interval's coverage
            scatters the less the more robots calibrate it.
    """

    learning: TrainingSet
    stopping: TrainingSet


def divided(training: TrainingSet) -> Division:
    """Divide a training part."""
    stops = np.arange(len(training.pitch)) % HELD_BACK == 0
    return Division(_chosen(training, ~stops), _chosen(training, stops))


def train(recipe: NetworkRecipe, workshop: Workshop, watcher: Watcher) -> Trained:
    """Fit a network to the training part of a training set.

    Args:
        recipe: The network, how long and how fast it is trained.
        workshop: Robots and seed; nothing is left in its folder.
        watcher: Told the share of the epochs that is done.

    Raises:
        InputError: the weights grow without bound from the first epoch on.
    """
    robots = divided(workshop.training.of("train"))
    learning = robots.learning
    keeper = _BestWeights(recipe.seconds, lambda epochs: watcher("training", epochs / recipe.epochs))
    with _quiet_and_repeatable(workshop.seed):
        network = PitchNetwork(recipe, learning.windows.shape[1])
        network.normalise_to(learning.windows, learning.pitch)
        trainer = Trainer(
            max_epochs=recipe.epochs,
            callbacks=[EarlyStopping(STOPPING, patience=recipe.patience), keeper],
            accelerator="auto",
            devices=1,
            deterministic=True,
            logger=False,
            enable_checkpointing=False,
            enable_progress_bar=False,
            enable_model_summary=False,
            num_sanity_val_steps=0,
            default_root_dir=workshop.folder,
        )
        order = torch.Generator().manual_seed(workshop.seed)
        batches = _batches(learning, recipe.batch, order)
        trainer.fit(_Regression(network), batches, _batches(robots.stopping, recipe.batch))
    if not isfinite(keeper.loss):
        raise InputError(f"estimator: training diverges at learning_rate {recipe.learning_rate:g}; make it smaller")
    network.cpu().load_state_dict(keeper.weights)
    return Trained(network.eval(), keeper.epochs, keeper.best, keeper.loss**0.5)


class _Regression(LightningModule):
    """What Lightning needs to know of a training: the loss and the optimiser."""

    def __init__(self, network: PitchNetwork) -> None:
        super().__init__()
        self.network = network

    def training_step(self, batch: list[Tensor]) -> Tensor:
        """The mean squared error of a batch, in units of the pitches' variance, which the learning rate fits."""
        windows, pitch = batch
        return mse_loss(self.network(windows), pitch) / self.network.pitch_scale**2

    def validation_step(self, batch: list[Tensor]) -> None:
        """Log the loss of robots that are not learned from, in rad^2."""
        windows, pitch = batch
        self.log(STOPPING, mse_loss(self.network(windows), pitch), batch_size=len(pitch))

    def configure_optimizers(self):
        """Adam (paper, Sec. IV-B), and the schedule of the learning rate."""
        recipe = self.network.recipe
        optimizer = torch.optim.Adam(
            self.network.parameters(), lr=recipe.learning_rate, weight_decay=recipe.weight_decay
        )
        return ([optimizer], [CosineAnnealingLR(optimizer, recipe.epochs)]) if recipe.annealed else optimizer


class _BestWeights(Callback):
    """Keeps in memory the weights of the epoch after which the stopping loss was smallest; holds the budget of time."""

    def __init__(self, seconds: float, watcher: Callable[[int], None]) -> None:
        self.deadline = time.monotonic() + seconds
        self.watcher = watcher
        self.weights: dict[str, Tensor] = {}
        self.epochs = 0
        self.best = 0
        self.loss = float("inf")

    def on_train_epoch_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Compare this epoch with the best one; Lightning has validated it by now."""
        self.epochs += 1
        loss = float(trainer.callback_metrics[STOPPING])
        if loss < self.loss or not self.weights:
            state = pl_module.get_submodule("network").state_dict()
            self.weights = {name: value.detach().cpu().clone() for name, value in state.items()}
            self.best, self.loss = self.epochs, loss
        # Lightning's own limit of time would stop within an epoch, before any weights are kept if it is short.
        trainer.should_stop = trainer.should_stop or time.monotonic() > self.deadline
        self.watcher(self.epochs)


def _chosen(robots: TrainingSet, which: np.ndarray) -> TrainingSet:
    return replace(
        robots,
        windows=robots.windows[which],
        pitch=robots.pitch[which],
        loads=robots.loads[which],
        part=robots.part[which],
    )


def _batches(robots: TrainingSet, batch: int, order: torch.Generator | None = None) -> DataLoader:
    """Batches cut from whole arrays: collecting 1200 windows one by one costs more than a small network."""
    data = TensorDataset(
        torch.as_tensor(robots.windows, dtype=torch.float32), torch.as_tensor(robots.pitch, dtype=torch.float32)
    )
    sampler = SequentialSampler(data) if order is None else RandomSampler(data, generator=order)
    return DataLoader(data, sampler=BatchSampler(sampler, batch, drop_last=False), batch_size=None)


@contextmanager
def _quiet_and_repeatable(seed: int) -> Iterator[None]:
    """Silence Lightning's advice; leave the random numbers and switches of the process as they were."""
    logger = logging.getLogger("lightning.pytorch")
    level, deterministic = logger.level, torch.are_deterministic_algorithms_enabled()
    logger.setLevel(logging.ERROR)
    try:
        with torch.random.fork_rng(), warnings.catch_warnings():
            torch.manual_seed(seed)
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
        torch.use_deterministic_algorithms(deterministic)
