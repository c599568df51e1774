"""The networks in PyTorch: from a window in metres and radians to a pitch in radians.

Training is in `wipx.learn.training`; what runs in a loop is the exported graph of `wipx.learn.onnx_model`.
"""

import numpy as np
import torch
from torch import Tensor, nn

from wipx.learn.architecture import Architecture
from wipx.learn.training_set import SIGNALS

CHANNELS = len(SIGNALS)


class PitchNetwork(nn.Module):
    """A body between two normalisations, which are buffers, so that the network takes and gives SI units.

    Windows are taken as they are, x measured from the release, where the reference of the controller is. Counting x
    from the window's first sample would add the noise of that one sample to all the others.
    """

    def __init__(self, architecture: Architecture, length: int) -> None:
        super().__init__()
        self.architecture = architecture
        self.length = length
        self.body = BODIES[architecture.kind](architecture, length)
        self.signal_mean: Tensor
        self.signal_scale: Tensor
        self.pitch_mean: Tensor
        self.pitch_scale: Tensor
        self.register_buffer("signal_mean", torch.zeros(CHANNELS))
        self.register_buffer("signal_scale", torch.ones(CHANNELS))
        self.register_buffer("pitch_mean", torch.zeros(()))
        self.register_buffer("pitch_scale", torch.ones(()))

    def normalise_to(self, windows: np.ndarray, pitch: np.ndarray) -> None:
        """Take mean and standard deviation of each signal and of the pitch from training data.

        Args:
            windows: Shape (N, length, 2) [m, rad].
            pitch: Shape (N,) [rad].
        """
        tiny = 1e-6  # [m, rad]; a constant signal stays zero
        self.signal_mean.copy_(torch.as_tensor(windows.mean((0, 1))))
        self.signal_scale.copy_(torch.as_tensor(windows.std((0, 1)).clip(tiny)))
        self.pitch_mean.copy_(torch.as_tensor(pitch.mean()))
        self.pitch_scale.copy_(torch.as_tensor(pitch.std().clip(tiny)))

    def forward(self, windows: Tensor) -> Tensor:
        """The pitch of each window.

        Args:
            windows: Shape (N, length, 2) [m, rad].

        Returns:
            Shape (N,) [rad].
        """
        output = self.body((windows - self.signal_mean) / self.signal_scale)
        return self.pitch_mean + self.pitch_scale * output[:, 0]

    def predict(self, windows: np.ndarray) -> np.ndarray:
        """As `forward`, on arrays and without derivatives."""
        with torch.inference_mode():
            return self(torch.as_tensor(windows, dtype=torch.float32)).numpy().astype(float)


class Recurrent(nn.Module):
    """Stacked LSTM or GRU; the last hidden state is read out (Hochreiter and Schmidhuber 1997; Cho et al. 2014)."""

    def __init__(self, architecture: Architecture, length: int) -> None:
        super().__init__()
        cell = nn.LSTM if architecture.kind == "lstm" else nn.GRU
        self.cells = cell(CHANNELS, architecture.width, architecture.layers, batch_first=True)
        self.readout = nn.Linear(architecture.width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        hidden, _ = self.cells(window)
        return self.readout(hidden[:, -1])


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

    def __init__(self, architecture: Architecture, length: int) -> None:
        super().__init__()
        width, kernel = architecture.width, architecture.kernel or 1
        self.blocks = nn.Sequential(
            *(CausalBlock(width if k else CHANNELS, width, kernel, 2**k) for k in range(architecture.layers))
        )
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        return self.readout(self.blocks(window.transpose(1, 2))[:, :, -1])


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


class Transformer(nn.Module):
    """Attention blocks over the samples; their mean is read out (Vaswani et al. 2017, pre-normalised)."""

    def __init__(self, architecture: Architecture, length: int) -> None:
        super().__init__()
        width = architecture.width
        self.embedding = nn.Linear(CHANNELS, width)
        self.positions: Tensor
        self.register_buffer("positions", torch.as_tensor(sinusoids(length, width), dtype=torch.float32))
        self.blocks = nn.Sequential(
            *(AttentionBlock(width, architecture.heads or 1) for _ in range(architecture.layers))
        )
        self.after = nn.LayerNorm(width)
        self.readout = nn.Linear(width, 1)

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        tokens = self.blocks(self.embedding(window) + self.positions)
        return self.readout(self.after(tokens).mean(1))


class StridedConvolutions(nn.Module):
    """Convolutions that halve the number of samples each; what is left is read out by one perceptron."""

    def __init__(self, architecture: Architecture, length: int) -> None:
        super().__init__()
        width, kernel = architecture.width, architecture.kernel or 1
        layers: list[nn.Module] = []
        for k in range(architecture.layers):
            layers += [nn.Conv1d(width if k else CHANNELS, width, kernel, stride=2, padding=kernel // 2), nn.ReLU()]
            length = (length + 1) // 2
        self.convolutions = nn.Sequential(*layers, nn.Flatten())
        self.readout = nn.Sequential(nn.Linear(width * length, width), nn.ReLU(), nn.Linear(width, 1))

    def forward(self, window: Tensor) -> Tensor:
        """Shape (N, length, 2) to (N, 1)."""
        return self.readout(self.convolutions(window.transpose(1, 2)))


def sinusoids(length: int, width: int) -> np.ndarray:
    """The place of each sample as sines and cosines (Vaswani et al. 2017, Sec. 3.5), shape (length, width)."""
    frequencies = 10000.0 ** (-2.0 * np.arange(width // 2) / width)
    phases = np.arange(length)[:, None] * frequencies
    return np.concatenate([np.sin(phases), np.cos(phases)], axis=1)


BODIES = {
    "lstm": Recurrent,
    "gru": Recurrent,
    "tcn": TemporalConvolutions,
    "transformer": Transformer,
    "cnn1d": StridedConvolutions,
}
