"""A trained network as an ONNX graph, run by onnxruntime inside a control loop.

The file `estimator.onnx` is self-contained: normalisation is part of the graph, and what a reader must know besides
is in its metadata. PyTorch is needed to write one, not to read or run it.
"""

import json
import warnings
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wipx.core.errors import InputError
from wipx.learn.estimator import PitchEstimate, check_windows

if TYPE_CHECKING:
    from onnxruntime import InferenceSession

    from wipx.learn.networks.pitch_network import PitchNetwork

VERSION = 1  # of the networks; another one cannot be read
METADATA = "wipx"  # key of the card in the file
REMEDY = "give the estimator.onnx that this version of the program wrote, or train again"


@dataclass(frozen=True)
class NetworkCard:
    """What the metadata say.

    Attributes:
        version: Of the networks.
        kind: Class of the network's recipe.
        length: Samples of a window.
        period: Time between them [s].
        half_width: Of the 90 % interval [rad].
        data: Digest of the training set.
    """

    version: int
    kind: str
    length: int
    period: float
    half_width: float
    data: str


@dataclass(frozen=True)
class NetworkEstimator:
    """A network that is ready to estimate; it runs on one thread.

    Attributes:
        graph: Content of `estimator.onnx`.
        card: Its metadata.
    """

    graph: bytes = field(repr=False)
    card: NetworkCard
    session: "InferenceSession" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "session", _session(self.graph))

    def __reduce__(self):
        # Sessions do not pickle; start another one on the same graph.
        return NetworkEstimator, (self.graph, self.card)

    @property
    def length(self) -> int:
        """Samples of a window."""
        return self.card.length

    @property
    def period(self) -> float:
        """Time between them [s]."""
        return self.card.period

    def estimate(self, windows: np.ndarray) -> PitchEstimate:
        """See `Estimator.estimate`."""
        check_windows(windows, self.length, self.period)
        (pitch,) = self.session.run(None, {"windows": windows.astype(np.float32)})
        pitch = np.asarray(pitch, dtype=float)
        return PitchEstimate(pitch, pitch - self.card.half_width, pitch + self.card.half_width)


def export(network: "PitchNetwork", card: NetworkCard, path: Path) -> NetworkEstimator:
    """Write a network's graph, with its card as metadata; the file is complete or not there at all."""
    import onnx
    import torch

    partial = path.with_name(f".{path.name}.part")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of traces that could depend on the data; tests compare the two
        # The exporter by tracing takes 0.3 s of processor time for an LSTM where the newer one takes 9 s, and the
        # graph is as fast.
        torch.onnx.export(
            network.eval(),
            (torch.zeros(2, network.length, 2),),
            partial,
            dynamo=False,
            input_names=["windows"],
            output_names=["pitch"],
            dynamic_axes={"windows": {0: "robots"}, "pitch": {0: "robots"}},
        )
    model = onnx.load_model(partial)
    onnx.helper.set_model_props(model, {METADATA: json.dumps(asdict(card))})
    graph = model.SerializeToString()
    partial.write_bytes(graph)
    partial.replace(path)
    return NetworkEstimator(graph, card)


def read_estimator(path: Path, *, length: int | None = None, period: float | None = None) -> NetworkEstimator:
    """The estimator in a file.

    Args:
        path: The file.
        length: Samples of the windows that it is to read; None for any.
        period: Time between them [s]; None for any.

    Raises:
        InputError: the file is missing, no estimator, or one of another version, length or period.
    """
    try:
        graph = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); {REMEDY}") from error
    card = _card(path, graph)
    if length is not None and card.length != length:
        raise InputError(
            f"{path}: an estimator for windows of {card.length} samples, expected {length}; "
            f"give one that was trained with {length} samples, or windows of {card.length}"
        )
    if period is not None and not np.isclose(card.period, period, rtol=1e-3):
        raise InputError(
            f"{path}: an estimator for samples {1e3 * card.period:.4g} ms apart, expected {1e3 * period:.4g} ms; "
            f"give one that was trained at this rate, or resample the windows"
        )
    return NetworkEstimator(graph, card)


def _card(path: Path, graph: bytes) -> NetworkCard:
    import onnx
    from google.protobuf.message import DecodeError

    try:
        metadata = {entry.key: entry.value for entry in onnx.load_model_from_string(graph).metadata_props}
        content = json.loads(metadata[METADATA])
        version = content["version"]
        if version != VERSION:
            raise InputError(f"{path}: an estimator of version {version}, expected version {VERSION}; {REMEDY}")
        return NetworkCard(**content)
    except (DecodeError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: no estimator of the equilibrium pitch; {REMEDY}") from error


def _session(graph: bytes) -> "InferenceSession":
    """A session for a control loop: one thread that sleeps while it has nothing to do."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    options.log_severity_level = 3  # errors alone
    return onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
