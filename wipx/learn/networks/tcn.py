"""Temporal convolutional network."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from wipx.learn.recipe import NetworkRecipe, check_odd
from wipx.learn.training_set import CHANNELS


@dataclass(frozen=True, kw_only=True)
class Tcn(NetworkRecipe):
    """Dilated causal convolutions (Bai, Kolter and Koltun 2018).

    Attributes:
        width: Channels.
        layers: Residual blocks of two convolutions each.
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
        return TemporalConvolutions(self.width, self.layers, self.kernel)


class CausalBlock(nn.Module):
    """Two dilated causal convolutions with a residual connection (Bai, Kolter and Koltun 2018)."""

    def __init__(self, inputs: int, width: int, kernel: int, dilation: int) -> None:
        super().__init__()
        self.past = nn.ConstantPad1d(((kernel - 1) * dilation, 0), 0.0)
        self.first = nn.Conv1d(inputs, width, kernel, dilation=dilation)
        self.second = nn.Conv1d(width, width, kernel, dilation=dilation)
        self.shortcut = nn.Conv1d(inputs, width, 1) if inputs != width else nn.Identity()

    def forward(self, signal: Tensor) -> Tensor:
        """Shape (N, inputs, length) to (N, width, length)."""
        inner = torch.relu(self.first(self.past(signal)))
        return torch.relu(self.shortcut(signal) + self.second(self.past(inner)))


class TemporalConvolutions(nn.Module):
    """Causal blocks whose dilation doubles; the last sample is read out."""

    def __init__(self, width: int, layers: int, kernel: int) -> None:
        super().__init__()
        self.blocks = nn.Sequential(
            *(CausalBlock(width if k else CHANNELS, width, kernel, 2**k) for k in range(layers))
        )
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        return self.readout(self.blocks(window.transpose(1, 2))[:, :, -1])
