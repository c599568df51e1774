"""What an export leaves: the fate of every effect, and how the exported robot predicts recordings."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

Status = Literal["exact", "approximated", "lost"]


@dataclass(frozen=True)
class Statement:
    """What becomes of one effect.

    Attributes:
        effect: "site/kind", or "JOINT.rate" and the like for what is no effect but the owner's own model.
        status: Whether the file says the same law, a similar one, or nothing.
        how: Where it stands in the file, or why it does not, in words.
        cost: By how much the prediction error grows because of it, by recorded column [its unit]; None where that was
            not measured.
    """

    effect: str
    status: Status
    how: str
    cost: Mapping[str, float] | None = None

    def costing(self, cost: Mapping[str, float]) -> "Statement":
        """The same with what it costs."""
        return replace(self, cost=dict(cost))


def exact(effect: str, how: str) -> Statement:
    """The file says the same law."""
    return Statement(effect, "exact", how)


def approximated(effect: str, how: str) -> Statement:
    """The file says a similar law."""
    return Statement(effect, "approximated", how)


def lost(effect: str, how: str) -> Statement:
    """The file says nothing of it."""
    return Statement(effect, "lost", how)


@dataclass(frozen=True)
class WaysTrace:
    """One recording beside what several simulators predict; NaN where nothing was predicted.

    Attributes:
        name: Of the recording.
        t: Time, shape (rows,) [s].
        recorded: Recorded coordinates by column.
        predicted: By way of simulating, then by column.
        starts: Times at which the predictions were restarted [s].
    """

    name: str
    t: np.ndarray
    recorded: Mapping[str, np.ndarray]
    predicted: Mapping[str, Mapping[str, np.ndarray]]
    starts: np.ndarray


@dataclass(frozen=True)
class ExportErrors:
    """Prediction errors of the exported robot, all from the same states.

    Attributes:
        horizon: Length of a prediction [s].
        windows: How many there were.
        rms: Root mean square error by way of simulating, then by column [unit of the column].
        noise_floor: Error that a right model would have, by column.
        traces: The recordings.
    """

    horizon: float
    windows: int
    rms: Mapping[str, Mapping[str, float]]
    noise_floor: Mapping[str, float]
    traces: tuple[WaysTrace, ...]


WIPX, FILE, RUNTIME = "wipx", "file", "file_with_runtime"  # ways of simulating
