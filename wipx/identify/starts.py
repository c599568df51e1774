"""Where predictions of windows start: smoothed states, and those that lead up to them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.identify.kalman import Filter, Places
from wipx.identify.sensors import true_states
from wipx.identify.smoothing import Smoother
from wipx.identify.windows import Windows
from wipx.sim.simulator import Path


@dataclass(frozen=True)
class Starts:
    """Windows, and the states that lead into them.

    Attributes:
        windows: R of them.
        until: Row of each window at which its prediction starts, shape (R,).
        states: As the sensors of each of B models show them, without their delay, shape (rows, 2 joints, B, R). Rows
            before the first that is simulated have the state of that.
        carried: What joints carry from earlier steps to that row (`wipx.sim.rows`), shape (N, STATES, B, R);
            None where they begin there.
    """

    windows: Windows
    until: np.ndarray
    states: np.ndarray
    carried: np.ndarray | None

    def of(self, index: np.ndarray) -> "Starts":
        """Of another one of the B models for each window, index (R,)."""
        windows = np.arange(len(index))
        return replace(
            self,
            states=self.states[:, :, index, windows][:, :, None],
            carried=None if self.carried is None else self.carried[:, :, index, windows][:, :, None],
        )

    def path(self, batch: ModelBatch) -> Path:
        """The true states of each of the B models that its sensors would show so."""
        return Path(true_states(batch, self.states), self.until, self.carried)


def starts_of(smoother: Smoother, windows: Windows, model: Model, bandwidths: Sequence[np.ndarray]) -> Starts:
    """Starts by one model, with filters of B bandwidths, each of shape (joints,) [rad/s]."""
    filters = smoother.filters(model, bandwidths)
    return starts_by(smoother, windows, ModelBatch(model, (), np.zeros((len(filters), 0))), filters)


def starts_by(smoother: Smoother, windows: Windows, batch: ModelBatch, filters: Sequence[Filter]) -> Starts:
    """Starts by each of B models, with a filter for each or one for all."""
    until, first = start_rows(windows), windows.inputs.first
    followed = smoother.following(batch, filters, _leads(smoother, windows), (windows.row + first, windows.recording))
    found = followed.states.reshape(batch.size, windows.count, -1, followed.states.shape[2])
    before = np.clip(until - np.arange(until.max() + 1)[:, None], 0, until - first)
    states = found[:, np.arange(windows.count), before]  # (B, rows, R, 2 joints)
    return Starts(windows, until, np.ascontiguousarray(states.transpose(1, 3, 0, 2)), followed.carried)


def starts_at_once(
    smoother: Smoother, windows: Windows, batch: ModelBatch, filters: Sequence[Filter]
) -> tuple[np.ndarray, Path]:
    """True states of B models where windows start, shape (2 joints, B, R), and what joints carry to there.

    Sensors must not be late; filters as `starts_by` takes them.
    """
    rows = windows.row + start_rows(windows)
    kept = (rows, windows.recording)
    followed = smoother.following(batch, filters, smoother.places(*kept, rows), kept)
    assert followed.carried is not None  # as asked for
    return true_states(batch, followed.states.transpose(2, 0, 1)), Path.behind(followed.carried)


def _leads(smoother: Smoother, windows: Windows) -> Places:
    """The rows from the start of each window back to the first that is simulated, window by window."""
    until, first = start_rows(windows), windows.inputs.first
    before = np.minimum(np.arange(np.max(until - first) + 1), (until - first)[:, None])  # (R, rows)
    starts = np.broadcast_to((windows.row + until)[:, None], before.shape)
    recordings = np.broadcast_to(windows.recording[:, None], before.shape)
    return smoother.places((starts - before).ravel(), recordings.ravel(), starts.ravel())


def start_rows(windows: Windows) -> np.ndarray:
    """Row of each window at which its prediction starts, shape (R,)."""
    return np.sum(windows.inputs.t <= windows.starts + 1e-6, axis=0) - 1
