"""What all networks share: from a window in metres and radians to a pitch in radians.

Training is in `wipx.learn.training`; what runs in a loop is the exported graph of `wipx.learn.onnx_model`.
"""

import numpy as np
import torch
from torch import Tensor, nn

from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import CHANNELS


class PitchNetwork(nn.Module):
    """A body between two normalisations, which are buffers, so that the network takes and gives SI units.

    Windows are taken as they are, x measured from the release, where the reference of the controller is. Counting x
    from the window's first sample would add the noise of that one sample to all the others.
    """

    def __init__(self, recipe: NetworkRecipe, length: int) -> None:
        super().__init__()
        self.recipe = recipe
        self.length = length
        self.body = recipe.body(length)
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
