"""The recipe of a network that estimates the equilibrium pitch: kind, sizes and training as plain settings."""

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from wipx.core.errors import InputError
from wipx.learn.architecture import Architecture, Kind
from wipx.learn.conformal import half_width, rank
from wipx.learn.dataset_file import digest_of
from wipx.learn.estimator import COVERAGE, Watcher, Workshop
from wipx.learn.onnx_model import VERSION, NetworkCard, NetworkEstimator, export
from wipx.learn.training_plan import TrainingPlan
from wipx.learn.training_set import PARTS, TrainingSet

FEWEST = 10  # robots to learn from, one of which decides when to stop


@dataclass(frozen=True)
class NetworkRecipe:
    """A network, trained on Lightning, with a conformal interval; as long as the training set's windows.

    Attributes:
        kind: Of the network.
        width: Hidden size, channels or model dimension.
        layers: How many of them are stacked.
        epochs: At most.
        kernel: Samples that a convolution spans; of tcn and cnn1d.
        heads: Of the attention; of a transformer.
        patience: Epochs without progress on robots that are not learned from, after which training stops.
        batch: Windows per step.
        learning_rate: Of Adam, at the start.
        weight_decay: Of Adam.
        annealed: Whether the learning rate falls to zero along half a cosine over `epochs`.
        seconds: Budget of the training; where it ends a training, the same seed need not give the same network.
    """

    kind: Kind
    width: int
    layers: int
    epochs: int
    kernel: int | None = None
    heads: int | None = None
    patience: int = 15
    batch: int = 64
    learning_rate: float = 1e-3
    weight_decay: float = 1e-5
    annealed: bool = True
    seconds: float = 600.0

    def __post_init__(self) -> None:
        # Each checks its settings.
        _ = self.architecture, self.plan

    @property
    def architecture(self) -> Architecture:
        """Kind and sizes."""
        return Architecture(self.kind, self.width, self.layers, self.kernel, self.heads)

    @property
    def plan(self) -> TrainingPlan:
        """How long and how fast it is trained."""
        return TrainingPlan(
            self.epochs,
            self.patience,
            self.batch,
            self.learning_rate,
            self.weight_decay,
            annealed=self.annealed,
            seconds=self.seconds,
        )

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

        trained = train(self.architecture, self.plan, workshop, watcher)
        network = trained.network
        error = half_width(network.predict(calibration.windows) - calibration.pitch, COVERAGE)
        card = NetworkCard(
            VERSION, self.kind, network.length, workshop.training.period, error, digest_of(workshop.training)
        )
        write_network(workshop.folder / "estimator.npz", network)
        return export(network, card, workshop.folder / "estimator.onnx")


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
