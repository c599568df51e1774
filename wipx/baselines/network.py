"""A learned acceleration: a small network as plain arrays, and its file.

Training is in `wipx.baselines.residual_network`; here is only what a prediction needs.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from wipx.core.errors import InputError


@dataclass(frozen=True)
class ResidualAcceleration:
    """Acceleration beyond the nominal model's, as a function of coordinates, rates and commands.

    A perceptron with two hidden layers (tanh). Inputs are held within what was seen in training: a network that
    is asked beyond it answers anything.

    Attributes:
        low: Smallest input seen, shape (features,) [m, rad, m/s, rad/s, N, N m].
        high: Largest.
        first: Weights (hidden, features + 1), biases in the last column.
        second: Weights (hidden, hidden + 1).
        last: Weights (joints, hidden + 1).
        scale: Size of the outputs, shape (joints,) [m/s^2, rad/s^2].
    """

    low: np.ndarray
    high: np.ndarray
    first: np.ndarray
    second: np.ndarray
    last: np.ndarray
    scale: np.ndarray

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """Accelerations (joints, ...) at inputs (features, ...)."""
        shape = features.shape[1:]
        flat = features.reshape(len(features), -1)
        low, high = self.low[:, None], self.high[:, None]
        layer = 2.0 * (np.clip(flat, low, high) - low) / (high - low) - 1.0
        for weights in (self.first, self.second):
            layer = np.tanh(weights[:, :-1] @ layer + weights[:, -1:])
        output = self.last[:, :-1] @ layer + self.last[:, -1:]
        return (self.scale[:, None] * output).reshape(-1, *shape)

    def write(self, path: Path) -> None:
        """Write the arrays; the file is complete or not there at all."""
        partial = path.with_name(f".{path.name}.part.npz")
        np.savez(partial, **{item.name: getattr(self, item.name) for item in fields(self)})
        partial.replace(path)


def read_network(path: Path, *, features: int, joints: int) -> ResidualAcceleration:
    """The network in a file; nothing in it is executed.

    Args:
        path: The file.
        features: Inputs that the plant has: coordinates, rates and commands.
        joints: Outputs that it has.

    Raises:
        InputError: the file is missing, no such file, or of another plant.
    """
    remedy = "give the residual.npz that task=baseline baseline=residual_network wrote"
    try:
        with np.load(path, allow_pickle=False) as content:
            network = ResidualAcceleration(**{item.name: content[item.name] for item in fields(ResidualAcceleration)})
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); {remedy}") from error
    except (ValueError, KeyError, AttributeError, TypeError, BadZipFile, EOFError) as error:
        raise InputError(f"{path}: no network; {remedy}") from error
    if len(network.low) != features or len(network.scale) != joints:
        raise InputError(
            f"{path}: a network of {len(network.low)} inputs and {len(network.scale)} accelerations, expected "
            f"{features} and {joints} for this plant; {remedy}"
        )
    return network
