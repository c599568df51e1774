"""Recordings as one array: every row of every recording, side by side."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.identify.unlogged_commands import inputs_along
from wipx.sim.inputs import Inputs

FORETELLING = 4  # rows from which a command is foretold
ECHO = 1e-3  # of a reported force's variation, that must be more than a repeated command
SETTLES = 0.15  # [s] after a recording's first row, in which the state and the commands before it are unknown


@dataclass(frozen=True)
class RecordingBatch:
    """R recordings of a plant.

    Attributes:
        plant: The plant.
        recordings: The recordings.
        inputs: Times and commands of all rows.
        measured: Recorded coordinates, then rates, shape (K + 1, 2 joints, R); zero where not recorded.
        channels: Which of these are recorded, indices (c,); coordinates always.
        reported: Forces that the drives report, shape (K + 1, i, R) [N or N m]; i is the number of commands, or zero
            where they do not, only repeat the command, or the log has mean commands.
        left_out: Recordings whose rows do not count.
    """

    plant: Plant
    recordings: tuple[Recording, ...]
    inputs: Inputs
    measured: np.ndarray
    channels: np.ndarray
    reported: np.ndarray
    left_out: tuple[int, ...] = ()

    @classmethod
    def of(cls, recordings: tuple[Recording, ...], plant: Plant) -> "RecordingBatch":
        """All rows; a rate counts as recorded where every recording has it."""
        names = (*plant.coordinates, *plant.rates)
        channels = [c for c, name in enumerate(names) if all(name in r for r in recordings)]
        inputs = inputs_along(recordings, plant)
        measured = np.zeros((len(inputs.t), len(names), len(recordings)))
        for i, recording in enumerate(recordings):
            measured[: len(recording), channels, i] = recording.stack(tuple(names[c] for c in channels))
        return cls(plant, recordings, inputs, measured, np.array(channels), _reported(recordings, plant, len(inputs.t)))

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.plant.joints)

    def reporting_nothing(self, like: "RecordingBatch") -> "RecordingBatch":
        """With the reported forces of other recordings, all zero: they then tell nothing."""
        return replace(self, reported=np.zeros((len(self.rows), like.reported.shape[1], len(self.recordings))))

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Which of the channels are weighed together, by index among `channels`.

        All of a mechanism of one or two joints; those of each joint of a tree, where what one joint shows is hardly
        foretold by the past of another.
        """
        if self.plant.tree is None:
            return (tuple(range(len(self.channels))),)
        return tuple(tuple(np.flatnonzero(self.channels % self.joints == j).tolist()) for j in range(self.joints))

    @property
    def seen(self) -> int:
        """Number of columns of `measured` up to the last kind that is recorded: coordinates, or rates too."""
        return self.joints if self.channels.max() < self.joints else 2 * self.joints

    @property
    def signals(self) -> int:
        """Number m of signals whose errors are weighed: the channels, then the reported forces."""
        return len(self.channels) + self.reported.shape[1]

    @cached_property
    def rows(self) -> np.ndarray:
        """Which rows exist, shape (K + 1, R)."""
        return np.arange(len(self.inputs.t))[:, None] <= self.inputs.last

    @cached_property
    def counted(self) -> np.ndarray:
        """Rows that count, shape (K + 1, R): not those in which the state is still settling."""
        settled = self.rows & (self.inputs.t >= self.inputs.t[0] + SETTLES)
        return settled & ~np.isin(np.arange(self.inputs.windows), self.left_out)

    @cached_property
    def intervals(self) -> np.ndarray:
        """Time from each row to the next, shape (K, R) [s]; zero in the padding."""
        return np.where(self.rows[1:], np.diff(self.inputs.t, axis=0), 0.0)

    @property
    def has_means(self) -> bool:
        """Whether rows have means of commands only, the log being slower than the loop."""
        return any(recording.periods > 1 for recording in self.recordings)

    @cached_property
    def surprises(self) -> np.ndarray:
        """What each command has that the rows up to its own do not foretell, shape (R, inputs, K + 1) [N or N m].

        Where the log is slower than the loop, the mean command of a row answers to what the sensors showed within
        the row: it knows of noise that, if coloured, is still there at the next row. Taken for an effect of the
        command on the motion it would feign a delay. Empty (no inputs) where every command is in the log.
        """
        count = len(self.recordings)
        if not self.has_means:
            return np.zeros((count, 0, len(self.rows)))
        inputs = self.inputs.commands.shape[1]
        found = np.zeros((count, inputs, len(self.rows)))
        for r, recording in enumerate(self.recordings):
            u = recording.stack(self.plant.commands)
            y = self.measured[: len(u), :, r][:, self.channels]
            past = [np.roll(u, lag, axis=0) for lag in range(1, FORETELLING + 1)]
            past += [np.roll(y, lag, axis=0) for lag in range(FORETELLING + 1)]
            known = np.column_stack([*past, np.ones(len(u))])[FORETELLING:]
            scaled = known / np.maximum(np.abs(known).max(axis=0), 1e-12)
            foretold = scaled @ np.linalg.lstsq(scaled, u[FORETELLING:], rcond=1e-10)[0]
            found[r, :, FORETELLING : len(u)] = (u[FORETELLING:] - foretold).T
        return found / np.maximum(found.std(axis=(0, 2), keepdims=True), 1e-12)


def _reported(recordings: tuple[Recording, ...], plant: Plant, rows: int) -> np.ndarray:
    """What the drives say beyond the command, shape (rows, i, R).

    Where the log has only mean commands, the force within a row is not known well enough to be compared.
    """
    names = tuple(f"{command}_measured" for command in plant.commands)
    averaged = any(recording.periods > 1 for recording in recordings)
    if averaged or not all(name in recording for recording in recordings for name in names):
        return np.zeros((rows, 0, len(recordings)))
    for command, name in zip(plant.commands, names, strict=True):
        pairs = [(r[command][1:], r[command][:-1], r[name][1:]) for r in recordings]
        now, before, force = (np.concatenate(part) for part in zip(*pairs, strict=True))
        known = np.column_stack([now, before, np.ones(len(now))])
        left = force - known @ np.linalg.lstsq(known, force, rcond=None)[0]
        if np.std(left) <= ECHO * np.std(force):
            return np.zeros((rows, 0, len(recordings)))
    found = np.zeros((rows, len(names), len(recordings)))
    for r, recording in enumerate(recordings):
        found[: len(recording), :, r] = recording.stack(names)
    return found
