"""Predictions of up to half a second: where they start, what they see, and how far they err at several horizons.

They start from smoothed states (`wipx.identify.smoothing`). These depend on the model, as the filter of any hypothesis
does, and are estimated anew when values have moved.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.diagnosis.likelihood.recorded_ways import Ways
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.identify.kalman import Filter
from wipx.identify.smoothing import Smoother
from wipx.identify.starts import start_rows, starts_at_once, starts_by
from wipx.identify.windows import LOOK_AHEAD, Windows, cut
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.coefficients import sensors_are_late
from wipx.sim.inputs import Inputs

HORIZONS = (0.0, 0.05, 0.15, HORIZON - LOOK_AHEAD)  # [s] after the rows that a start is estimated from; 0 for one row
SPACING = 0.005  # [s] of the rows of condensed logs, about
STRIDE = 0.25  # [s] from one start to the next
LEAD = 0.1  # [s] of smoothed states before a start, for what late sensors show at first
LARGEST_CALL = 6_000_000  # numbers of one batch of rollouts, about 48 MB
TOO_FAR = 5.0  # ranges of the recorded motion; what a prediction that fell over counts


@dataclass(frozen=True)
class Predictions:
    """N predictions of recordings, seen at H horizons.

    Attributes:
        simulator: The engine.
        data: The recordings.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
        doubt: Relative standard deviation of the scale of recorded rates.
        horizons: After the rows that a start is estimated from [s]; 0 for one row.
    """

    simulator: AnalyticSimulator
    data: RecordingBatch
    noise: np.ndarray
    doubt: float
    horizons: tuple[float, ...] = HORIZONS

    @property
    def count(self) -> int:
        """N."""
        return self.windows.count

    @property
    def recording(self) -> np.ndarray:
        """Number of the recording of each, shape (N,)."""
        return self.windows.recording

    @property
    def starts(self) -> np.ndarray:
        """When each starts [s], shape (N,)."""
        return self.windows.starts

    @cached_property
    def _recordings(self) -> tuple[Recording, ...]:
        return tuple(condensed(recording, self.data.plant.commands) for recording in self.data.recordings)

    @cached_property
    def windows(self) -> Windows:
        """The predicted stretches of the recordings."""
        return cut(self._recordings, self.data.plant, horizon=HORIZON, lead=LEAD, stride=STRIDE)

    @cached_property
    def sampled(self) -> np.ndarray:
        """Row of each window at each horizon, shape (H, N)."""
        t, windows = self.windows.inputs.t, self.windows
        seen = np.sum(t <= windows.starts + LOOK_AHEAD + 1e-6, axis=0)
        wanted = [np.sum(t < windows.starts + LOOK_AHEAD + horizon - 1e-6, axis=0) for horizon in self.horizons]
        rows = np.stack([np.minimum(np.maximum(row, seen), windows.inputs.last) for row in wanted])
        apart = np.concatenate([[True], np.median(np.diff(rows, axis=0), axis=1) > 0.0])
        return rows[apart]

    @cached_property
    def recorded(self) -> np.ndarray:
        """Recorded coordinates where each starts and at its horizons, shape (N, 1 + H, joints)."""
        windows = self.windows
        return windows.recorded[np.stack([start_rows(windows), *self.sampled]), :, np.arange(self.count)].swapaxes(0, 1)

    @cached_property
    def counted(self) -> np.ndarray:
        """Predictions that count: whole ones, of recordings that do, shape (N,)."""
        windows = self.windows
        last = windows.inputs.t[windows.inputs.last, np.arange(windows.count)]
        interval = max(float(np.median(np.diff(recording.t))) for recording in self._recordings)
        whole = last >= windows.starts + HORIZON - 1.5 * interval - 1e-6
        return whole & ~np.isin(windows.recording, self.data.left_out)

    @cached_property
    def ways(self) -> Ways:
        """How far recorded rates say that joints move along each prediction."""
        ends = start_rows(self.windows), self.sampled[-1]
        return Ways.of(self._recordings, self.data.plant, self.windows, *ends, self.doubt)

    @property
    def size(self) -> int:
        """Number of errors of a prediction E: of H joints, then of the ways by recorded rates."""
        return len(self.sampled) * self.data.joints + len(self.ways.joints)

    @cached_property
    def groups(self) -> tuple[np.ndarray, ...]:
        """Which of the errors of a prediction go with each other, indices."""
        joints, channels = self.data.joints, self.data.channels
        first = np.arange(len(self.sampled))[:, None] * joints
        own = [[channels[c] for c in group if channels[c] < joints] for group in self.data.groups]
        ways = [first.size * joints + np.flatnonzero(np.isin(self.ways.joints, some)) for some in own]
        return tuple(np.append(first + np.array(some), way) for some, way in zip(own, ways, strict=True))

    def filters(self, model: Model, bandwidths: Sequence[np.ndarray]) -> list[Filter]:
        """Filters of a model along the recordings, each of bandwidths (joints,) [rad/s]."""
        return self._smoother.filters(model, bandwidths)

    @cached_property
    def _smoother(self) -> Smoother:
        return Smoother(self.simulator, self.data.plant, self._recordings, self.noise)

    def errors(self, batch: ModelBatch, filters: Sequence[Filter]) -> np.ndarray:
        """Errors of P models in units of the sensor noise, shape (P, N, E); zero where one does not count.

        Args:
            batch: The models.
            filters: Of each model, or one for all.
        """
        windows, sampled = self.windows, self.sampled
        joints, count = self.data.joints, windows.count
        found = np.empty((batch.size, count, self.size))
        ahead = len(sampled) * joints
        found[:, :, ahead:] = self.ways.errors(batch, self.recorded[:, [0, -1]]) / self.noise[self.ways.joints]
        found[:, ~self.counted, ahead:] = 0.0
        size = max(1, LARGEST_CALL // (len(windows.inputs.t) * 4 * count))
        recorded = self.recorded[:, 1:].swapaxes(0, 1)  # (H, N, joints)
        for begin in range(0, batch.size, size):
            part = np.arange(begin, min(begin + size, batch.size))
            some = ModelBatch(batch.model, batch.names, None if batch.values is None else batch.values[part])
            own = filters if len(filters) == 1 else filters[part[0] : part[-1] + 1]
            shown = self._shown(some, own)
            at = np.stack([shown[rows, :, :, np.arange(count)] for rows in sampled])  # (H, N, joints, P)
            errors = at - recorded[..., None]
            errors = np.clip(np.nan_to_num(errors, nan=np.inf), -self._largest[:, None], self._largest[:, None])
            errors = errors / self.noise[:, None] * self.counted[None, :, None, None]
            found[part, :, :ahead] = np.transpose(errors, (3, 1, 0, 2)).reshape(len(part), count, -1)
        return found

    def _shown(self, batch: ModelBatch, filters: Sequence[Filter]) -> np.ndarray:
        """Coordinates that P models show in every row from each start on, shape (K + 1, joints, P, N)."""
        if sensors_are_late(batch):
            path = starts_by(self._smoother, self.windows, batch, filters).path(batch)
            return self.simulator.replay(batch, self.windows.inputs, path.states[0], path).coordinates
        states, path = starts_at_once(self._smoother, self.windows, batch, filters)
        return self.simulator.replay(batch, self._from_starts, states, path).coordinates

    @cached_property
    def _from_starts(self) -> Inputs:
        """Those of the windows without what leads to their starts."""
        return replace(self.windows.inputs, first=start_rows(self.windows))

    @cached_property
    def _largest(self) -> np.ndarray:
        rows = np.moveaxis(self.windows.recorded, 1, 0)[:, self.windows.predicted]
        return TOO_FAR * np.ptp(rows, axis=1) + 1e3 * self.noise


def condensed(recording: Recording, commands: tuple[str, ...]) -> Recording:
    """Means of an odd number of rows each, at the time of the middle one; commands as they act from there on.

    Many more rows than a joint's motion needs cost time and tell little more of half a second.
    """
    every = 1 + 2 * round(0.5 * max(SPACING * recording.rate - 1.0, 0.0))
    kept = len(recording) // every - 1
    if every == 1 or kept < 2:
        return recording

    def means(values: np.ndarray, first: int) -> np.ndarray:
        return values[first : first + kept * every].reshape(kept, every).mean(axis=1)

    middle = every // 2
    columns = {name: means(values, middle if name in commands else 0) for name, values in recording.columns.items()}
    times = {"t": recording.t[middle : middle + kept * every : every]}
    return Recording(recording.name, {**columns, **times}, recording.source, recording.periods)
