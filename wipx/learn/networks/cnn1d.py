"""Strided convolutions over the window."""

from dataclasses import dataclass

from torch import Tensor, nn

from wipx.learn.recipe import NetworkRecipe, check_odd
from wipx.learn.training_set import CHANNELS


@dataclass(frozen=True, kw_only=True)
class Cnn1d(NetworkRecipe):
    """Convolutions, each of which halves the number of samples.

    Attributes:
        width: Channels.
        layers: Convolutions.
        kernel: Samples that a convolution spans.
    """

    width: int
    layers: int
    kernel: int

    def __post_init__(self) -> None:
        super().__post_init__()
        check_odd(self.kernel)

    def body(self, length: int) -> nn.Module:
        """See `NetworkRecipe.body`."""
        return StridedConvolutions(self.width, self.layers, self.kernel, length)


class StridedConvolutions(nn.Module):
    """Convolutions that halve the number of samples each; what is left is read out by one perceptron."""

    def __init__(self, width: int, layers: int, kernel: int, length: int) -> None:
        super().__init__()
        stack: list[nn.Module] = []
        for k in range(layers):
            stack += [nn.Conv1d(width if k else CHANNELS, width, kernel, stride=2, padding=kernel // 2), nn.ReLU()]
            length = (length + 1) // 2
        self.convolutions = nn.Sequential(*stack, nn.Flatten())
        self.readout = nn.Sequential(nn.Linear(width * length, width), nn.ReLU(), nn.Linear(width, 1))

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        return self.readout(self.convolutions(window.transpose(1, 2)))
