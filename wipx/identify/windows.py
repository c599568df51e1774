"""Prediction windows: where a prediction restarts, what it may see, and what it must predict.

A window of the contract begins at s; the state there is estimated from the rows of a short
lead before s and 0.05 s after it, and the recorded command is then replayed for one horizon.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.identify.unlogged_commands import command_spread
from wipx.sim.inputs import Inputs

FIRST_START = 0.5  # [s] after the first row, contract section 4
LOOK_AHEAD = 0.05  # [s] of rows after the start that the state estimate may use, likewise
LEAD = 0.2  # [s] of smoothed states before the start, along which friction, lags and gaps settle
HISTORY = 0.25  # [s] of commands before the lead, for transport delays


@dataclass(frozen=True)
class Windows:
    """R windows of some recordings.

    Attributes:
        inputs: Times and commands, with lead and history.
        recorded: Recorded coordinates, shape (K + 1, joints, R); zero where padded.
        known: Rows from which the state is estimated, shape (K + 1, R).
        predicted: Rows that are predicted and judged, shape (K + 1, R).
        recording: Index of each window's recording, shape (R,).
        row: Row of that recording at which the window's first row stands, shape (R,).
        starts: Time at which each prediction starts [s], shape (R,).
    """

    inputs: Inputs
    recorded: np.ndarray
    known: np.ndarray
    predicted: np.ndarray
    recording: np.ndarray
    row: np.ndarray
    starts: np.ndarray

    @property
    def count(self) -> int:
        """Number of windows R."""
        return self.inputs.windows

    def seeing_all(self) -> "Windows":
        """The same windows, the state estimated from every row that is predicted (multiple shooting)."""
        return Windows(
            self.inputs, self.recorded, self.predicted, self.predicted, self.recording, self.row, self.starts
        )


def check_long_enough(recordings: tuple[Recording, ...]) -> None:
    """Refuse recordings that are shorter than one window.

    Raises:
        InputError: the first one that is.
    """
    shortest = FIRST_START + LOOK_AHEAD
    for recording in recordings:
        if recording.duration < shortest:
            raise InputError(
                f"{recording.source or recording.name}: {recording.duration:.3g} s long, expected more than "
                f"{shortest:g} s (one window); leave it out or record longer"
            )


def cut(
    recordings: tuple[Recording, ...],
    plant: Plant,
    *,
    horizon: float,
    lead: float,
    shooting: bool = False,
    stride: float | None = None,
) -> Windows:
    """Cut recordings into windows of one `horizon`.

    Args:
        recordings: What to cut.
        plant: Says which columns are coordinates and commands.
        horizon: Length of a prediction [s].
        lead: Time before a window's start from which its state is estimated [s].
        shooting: Whether windows have no lead and begin with the recording: the state is then
            estimated from the whole window.
        stride: Time from one window's start to the next [s]; the first starts as long after the first row. None for
            windows that follow each other.

    Raises:
        InputError: a recording is shorter than one window.
    """
    check_long_enough(recordings)
    pieces = [
        piece
        for i, recording in enumerate(recordings)
        for piece in _pieces(i, recording, horizon, lead, shooting, stride)
    ]
    if not pieces:
        names = ", ".join(r.name for r in recordings)
        raise InputError(f"{names}: no window of {horizon:g} s has three rows; log faster")
    inputs = Inputs.of(
        [recordings[p.recording].t[p.rows] for p in pieces],
        [recordings[p.recording].stack(plant.commands)[p.rows] for p in pieces],
        [p.first for p in pieces],
        tuple(recordings[p.recording].periods for p in pieces),
        command_spread(recordings, plant),
    )
    shape = (len(inputs.t), len(pieces))
    recorded = np.zeros((shape[0], len(plant.coordinates), shape[1]))
    known, predicted = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    for r, p in enumerate(pieces):
        t = recordings[p.recording].t[p.rows]
        recorded[: len(t), :, r] = recordings[p.recording].stack(plant.coordinates)[p.rows]
        # A tolerance of a microsecond: times are decimal fractions.
        predicted[: len(t), r] = (t >= p.start - 1e-6) & (t < p.start + horizon - 1e-6)
        known[: len(t), r] = (np.arange(len(t)) >= p.first) & (t <= p.start + LOOK_AHEAD + 1e-6)
    windows = Windows(
        inputs,
        recorded,
        known,
        predicted,
        np.array([p.recording for p in pieces]),
        np.array([p.rows.start for p in pieces]),
        np.array([p.start for p in pieces]),
    )
    return windows.seeing_all() if shooting else windows


@dataclass(frozen=True)
class _Piece:
    recording: int
    rows: slice
    first: int
    start: float


def _pieces(
    index: int, recording: Recording, horizon: float, lead: float, shooting: bool, stride: float | None
) -> Iterator[_Piece]:
    t = recording.t
    begin = t[0] if shooting else t[0] + (stride or FIRST_START)
    step = stride or horizon
    for number in range(int(np.ceil((t[-1] - begin) / step))):
        start = begin + number * step
        first = np.searchsorted(t, start - (0.0 if shooting else lead) - 1e-6)
        last = np.searchsorted(t, start + horizon - 1e-6)
        history = np.searchsorted(t, t[first] - HISTORY - 1e-6)
        seen = np.searchsorted(t, start + (horizon if shooting else LOOK_AHEAD) + 1e-6) - first
        unseen = last - np.searchsorted(t, start - 1e-6)
        if seen >= 3 and unseen >= 2:
            yield _Piece(index, slice(int(history), int(last)), int(first - history), float(start))
