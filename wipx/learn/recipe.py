"""The recipe of a network that estimates the equilibrium pitch: how it is trained, as plain settings.

Each network is a subclass in `wipx.learn.networks`, with its sizes and with its layers in PyTorch.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from wipx.core.errors import InputError, check_positive
from wipx.learn.conformal import half_width, rank
from wipx.learn.dataset_file import digest_of
from wipx.learn.estimator import COVERAGE, Watcher, Workshop
from wipx.learn.onnx_model import VERSION, NetworkCard, NetworkEstimator, export
from wipx.learn.training_set import PARTS, TrainingSet

if TYPE_CHECKING:
    from torch import nn

FEWEST = 10  # robots to learn from, one of which decides when to stop


@dataclass(frozen=True, kw_only=True)
class NetworkRecipe(ABC):
    """A network, trained on Lightning, with a conformal interval; as long as the training set's windows.

    Attributes:
        epochs: At most.
        patience: Epochs without progress on robots that are not learned from, after which training stops.
        batch: Windows per step.
        learning_rate: Of Adam, at the start.
        weight_decay: Of Adam.
        annealed: Whether the learning rate falls to zero along half a cosine over `epochs`; constant if not.
        seconds: Budget of the training, looked at after every epoch; where it ends a training, the same seed need not
            give the same network.
    """

    epochs: int
    patience: int = 15
    batch: int = 64
    learning_rate: float = 1e-3
    weight_decay: float = 1e-5
    annealed: bool = True
    seconds: float = 600.0

    def __post_init__(self) -> None:
        numbers = {item.name: getattr(self, item.name) for item in fields(self) if item.type in (int, float)}
        decay = numbers.pop("weight_decay")
        check_positive(**{f"estimator.{name}": value for name, value in numbers.items()})
        if not decay >= 0.0:
            raise InputError(f"estimator.weight_decay is {decay:g}, expected zero or more")

    @abstractmethod
    def body(self, length: int) -> "nn.Module":
        """The layers: from normalised windows, shape (N, length, 2), to numbers, shape (N, 1)."""

    def prepare(self, workshop: Workshop, watcher: Watcher) -> NetworkEstimator:
        """Train, calibrate and export; `estimator.onnx` and `estimator.npz` are written to the workshop's folder.

        Args:
            workshop: Robots, seed and folder.
            watcher: Told the stage and the share that is done.

        Raises:
            InputError: the training set has too few robots to learn from or to calibrate the interval, or values
                that are not finite; a package is not installed; the training diverges.
        """
        calibration = workshop.training.of("validation")
        _check(workshop.training, calibration)
        from wipx.learn.checkpoint import write_network
        from wipx.learn.training import train

        trained = train(self, workshop, watcher)
        network = trained.network
        error = half_width(network.predict(calibration.windows) - calibration.pitch, COVERAGE)
        card = NetworkCard(
            VERSION,
            type(self).__name__,
            network.length,
            workshop.training.period,
            error,
            digest_of(workshop.training),
        )
        write_network(workshop.folder / "estimator.npz", network)
        return export(network, card, workshop.folder / "estimator.onnx")


def check_odd(kernel: int) -> None:
    """Refuse a convolution that has no sample in its middle."""
    if kernel % 2 == 0:
        raise InputError(f"estimator.kernel is {kernel}, expected an odd number of samples")


def _check(robots: TrainingSet, calibration: TrainingSet) -> None:
    """Refuse at once what would fail later."""
    for package in ("torch", "lightning"):
        if find_spec(package) is None:
            raise InputError(f"estimator: networks need the package {package}; pip install 'wipx[network]'")
    rank(len(calibration.pitch), COVERAGE)
    learning = int(np.sum(robots.part == PARTS.index("train")))
    if learning < FEWEST:
        raise InputError(
            f"estimator: {learning} robots to learn from, expected {FEWEST} at least; make a larger training set"
        )
    for name, values in (("windows", robots.windows), ("pitch", robots.pitch)):
        if not np.isfinite(values).all():
            robot = int(np.argwhere(~np.isfinite(values))[0][0])
            raise InputError(
                f"estimator: {name} of robot {robot} of the training set has values that are not finite; "
                f"leave out robots that fell over"
            )
