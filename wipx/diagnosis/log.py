"""Recordings as one array: every row of every recording, side by side."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.sim.inputs import Inputs

SETTLES = 0.15  # [s] after a recording's first row, in which the state and the commands before it are unknown


@dataclass(frozen=True)
class Log:
    """R recordings of a plant.

    Attributes:
        plant: The plant.
        recordings: The recordings.
        inputs: Times and commands of all rows.
        measured: Recorded coordinates, then rates, shape (K + 1, 2 joints, R); zero where not recorded.
        channels: Which of these are recorded, indices (m,); coordinates always.
        left_out: A recording whose rows do not count; None for none.
    """

    plant: Plant
    recordings: tuple[Recording, ...]
    inputs: Inputs
    measured: np.ndarray
    channels: np.ndarray
    left_out: int | None = None

    @classmethod
    def of(cls, recordings: tuple[Recording, ...], plant: Plant) -> "Log":
        """All rows; a rate counts as recorded where every recording has it."""
        names = (*plant.coordinates, *plant.rates)
        channels = [c for c, name in enumerate(names) if all(name in r for r in recordings)]
        inputs = Inputs.of(
            [r.t for r in recordings],
            [r.stack(plant.commands) for r in recordings],
            [0] * len(recordings),
            tuple(r.periods for r in recordings),
        )
        measured = np.zeros((len(inputs.t), len(names), len(recordings)))
        for i, recording in enumerate(recordings):
            measured[: len(recording), channels, i] = recording.stack(tuple(names[c] for c in channels))
        return cls(plant, recordings, inputs, measured, np.array(channels))

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.plant.joints)

    @cached_property
    def rows(self) -> np.ndarray:
        """Which rows exist, shape (K + 1, R)."""
        return np.arange(len(self.inputs.t))[:, None] <= self.inputs.last

    @cached_property
    def counted(self) -> np.ndarray:
        """Rows that count, shape (K + 1, R): not those in which the state is still settling."""
        settled = self.rows & (self.inputs.t >= self.inputs.t[0] + SETTLES)
        return settled & (np.arange(self.inputs.windows) != self.left_out)

    @cached_property
    def intervals(self) -> np.ndarray:
        """Time from each row to the next, shape (K, R) [s]; zero in the padding."""
        return np.where(self.rows[1:], np.diff(self.inputs.t, axis=0), 0.0)

    @property
    def command_noise(self) -> float:
        """Standard deviation of what is noise in the commands from row to row [N or N m]."""
        fourth = [np.diff(r[name], 4) for r in self.recordings for name in self.plant.commands]
        return max(1.4826 * float(np.median(np.abs(np.concatenate(fourth)))) / np.sqrt(70.0), 1e-9)
