"""Transformer encoder over the samples of the window."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from wipx.core.errors import InputError
from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import CHANNELS


@dataclass(frozen=True, kw_only=True)
class Transformer(NetworkRecipe):
    """Self-attention (Vaswani et al. 2017).

    Attributes:
        width: Model dimension.
        layers: Attention blocks.
        heads: Of the attention; twice their number divides the width.
    """

    width: int
    layers: int
    heads: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.width % (2 * self.heads):
            raise InputError(
                f"estimator.width is {self.width}, expected a multiple of twice estimator.heads = {self.heads}"
            )

    def body(self, length: int) -> nn.Module:
        """See `NetworkRecipe.body`."""
        return Encoder(self.width, self.layers, self.heads, length)


class AttentionBlock(nn.Module):
    """Self-attention and a perceptron, each after a normalisation and beside a residual connection."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.before_attention = nn.LayerNorm(width)
        self.projections = nn.Linear(width, 3 * width)
        self.joined = nn.Linear(width, width)
        self.before_perceptron = nn.LayerNorm(width)
        self.perceptron = nn.Sequential(nn.Linear(width, 2 * width), nn.GELU(), nn.Linear(2 * width, width))

    def forward(self, tokens: Tensor) -> Tensor:
        """Shape (N, length, width), and the same again."""
        samples, length, width = tokens.shape
        projected = self.projections(self.before_attention(tokens))
        query, key, value = projected.reshape(samples, length, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        weights = torch.softmax(query @ key.transpose(-2, -1) / query.shape[-1] ** 0.5, dim=-1)
        tokens = tokens + self.joined((weights @ value).transpose(1, 2).reshape(samples, length, width))
        return tokens + self.perceptron(self.before_perceptron(tokens))


class Encoder(nn.Module):
    """Attention blocks over the samples; their mean is read out (Vaswani et al. 2017, pre-normalised)."""

    def __init__(self, width: int, layers: int, heads: int, length: int) -> None:
        super().__init__()
        self.embedding = nn.Linear(CHANNELS, width)
        self.positions: Tensor
        self.register_buffer("positions", torch.as_tensor(sinusoids(length, width), dtype=torch.float32))
        self.blocks = nn.Sequential(*(AttentionBlock(width, heads) for _ in range(layers)))
        self.after = nn.LayerNorm(width)
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        tokens = self.blocks(self.embedding(window) + self.positions)
        return self.readout(self.after(tokens).mean(1))


def sinusoids(length: int, width: int) -> np.ndarray:
    """The place of each sample as sines and cosines (Vaswani et al. 2017, Sec. 3.5), shape (length, width)."""
    frequencies = 10000.0 ** (-2.0 * np.arange(width // 2) / width)
    phases = np.arange(length)[:, None] * frequencies
    return np.concatenate([np.sin(phases), np.cos(phases)], axis=1)
