"""Recurrent networks."""

from dataclasses import dataclass

from torch import Tensor, nn

from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import CHANNELS


@dataclass(frozen=True, kw_only=True)
class Lstm(NetworkRecipe):
    """Long short-term memory (Hochreiter and Schmidhuber 1997).

    Attributes:
        width: Hidden size.
        layers: Stacked cells.
    """

    width: int
    layers: int

    def body(self, length: int) -> nn.Module:
        """See `NetworkRecipe.body`."""
        return Recurrent(nn.LSTM, self.width, self.layers)


@dataclass(frozen=True, kw_only=True)
class Gru(NetworkRecipe):
    """Gated recurrent unit (Cho et al. 2014).

    Attributes:
        width: Hidden size.
        layers: Stacked cells.
    """

    width: int
    layers: int

    def body(self, length: int) -> nn.Module:
        """See `NetworkRecipe.body`."""
        return Recurrent(nn.GRU, self.width, self.layers)


class Recurrent(nn.Module):
    """Stacked recurrent cells; the last hidden state is read out."""

    def __init__(self, cell: type[nn.LSTM] | type[nn.GRU], width: int, layers: int) -> None:
        super().__init__()
        self.cells = cell(CHANNELS, width, layers, batch_first=True)
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        hidden, _ = self.cells(window)
        return self.readout(hidden[:, -1])
