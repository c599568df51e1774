"""The kinds and sizes of the networks, without PyTorch; the networks themselves are in `wipx.learn.networks`."""

from dataclasses import dataclass
from typing import Literal, get_args

from wipx.core.errors import InputError, check_positive, unknown_name

Kind = Literal["lstm", "gru", "tcn", "transformer", "cnn1d"]
KERNELS = ("tcn", "cnn1d")  # kinds that are made of convolutions
HEADS = ("transformer",)  # kinds that attend


@dataclass(frozen=True)
class Architecture:
    """A network that turns a window into one number.

    Attributes:
        kind: Long short-term memory, gated recurrent unit, temporal convolutional network, transformer or strided
            convolutions.
        width: Hidden size, channels or model dimension.
        layers: How many of them are stacked; of a tcn the residual blocks of two convolutions each.
        kernel: Samples that a convolution spans; None for kinds without convolutions.
        heads: Of the attention; None for kinds without attention.
    """

    kind: Kind
    width: int
    layers: int
    kernel: int | None = None
    heads: int | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise unknown_name("kind of network", self.kind, get_args(Kind), "estimator.kind")
        check_positive(**{"estimator.width": self.width, "estimator.layers": self.layers})
        self._check("kernel", self.kernel, needed=self.kind in KERNELS)
        self._check("heads", self.heads, needed=self.kind in HEADS)
        if self.heads is not None and self.width % (2 * self.heads):
            raise InputError(
                f"estimator.width is {self.width}, expected a multiple of twice estimator.heads = {self.heads}"
            )
        if self.kernel is not None and self.kernel % 2 == 0:
            raise InputError(f"estimator.kernel is {self.kernel}, expected an odd number of samples")

    def _check(self, name: str, value: int | None, *, needed: bool) -> None:
        if needed and value is None:
            raise InputError(f"estimator.{name} is missing; a {self.kind} needs it")
        if not needed and value is not None:
            raise InputError(f"estimator.{name} is {value}, but a {self.kind} has none; leave it out")
        if value is not None:
            check_positive(**{f"estimator.{name}": value})
