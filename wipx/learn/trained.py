"""A network that was trained before, as a member of the group `estimator`."""

from dataclasses import dataclass
from pathlib import Path

from wipx.learn.estimator import Watcher, Workshop
from wipx.learn.onnx_model import NetworkEstimator, read_estimator


@dataclass(frozen=True)
class Trained:
    """The network in a file.

    Attributes:
        path: `estimator.onnx` of task=train.
    """

    path: str

    def prepare(self, workshop: Workshop, watcher: Watcher) -> NetworkEstimator:
        """Read the network; the workshop says what windows it must know, and keeps a copy.

        Raises:
            InputError: the file is missing or at fault, or its network is for other windows.
        """
        training = workshop.training
        watcher("reading", 0.0)
        estimator = read_estimator(Path(self.path), length=training.windows.shape[1], period=training.period)
        (workshop.folder / "estimator.onnx").write_bytes(estimator.graph)
        return estimator
