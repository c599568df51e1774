"""Where rollouts stand in the arrays of the compiled code, which always has two joints.

A lane is one model on one window: lane = model * windows + window. Translation and joint1 are rows 0, pitch and
joint2 rows 1; a joint that a plant lacks stays at zero.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.plant import Plant
from wipx.sim import rows as R
from wipx.sim.coefficients import joint_index
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path, Rollouts, StateFeedback

NO_ROWS = np.zeros((1, 4, 1))
HELD = np.zeros((1, 2, 1))
NOT_LED = np.zeros((0, 4, 1))


@dataclass(frozen=True)
class ClosedLoop:
    """A state feedback as the compiled code takes it.

    Attributes:
        gains: Shape (2, 4).
        references: Shape (K, 4, R).
        noise: Shape (K, 4, lanes).
        settings: Time constant of the rate filter [s] (negative: rates are measured), limit of the command.
    """

    gains: np.ndarray
    references: np.ndarray
    noise: np.ndarray
    settings: np.ndarray


OPEN = ClosedLoop(np.zeros((2, 4)), NO_ROWS, NO_ROWS, np.zeros(2))


@dataclass(frozen=True)
class Layout:
    """Arrays of P models on R windows, to and from the two joints of the compiled code.

    Attributes:
        plant: Of all models.
        models: P.
        inputs: R windows of K + 1 rows.
    """

    plant: Plant
    models: int
    inputs: Inputs

    @property
    def rows(self) -> int:
        """Rows K that have a command."""
        return len(self.inputs.t) - 1

    @property
    def lanes(self) -> int:
        """P R."""
        return self.models * self.inputs.windows

    @property
    def joints(self) -> slice:
        """Rows of the plant's joints; they are neighbours."""
        indices = [joint_index(site) for site in self.plant.joints]
        return slice(indices[0], indices[-1] + 1)

    @property
    def pattern(self) -> list[int]:
        """Rows of the plant's coordinates, then rates, among four."""
        indices = [joint_index(site) for site in self.plant.joints]
        return [*indices, *(2 + j for j in indices)]

    @property
    def driven(self) -> list[int]:
        """Row of the joint on which each command acts."""
        return [joint_index(site) for site in self.plant.actuated]

    def states(self, initial: np.ndarray) -> np.ndarray:
        """Carried states (STATES, lanes) from coordinates and rates (2 joints, P or 1, R or 1)."""
        states = np.zeros((R.STATES, self.lanes))
        shape = (len(self.pattern), self.models, self.inputs.windows)
        states[self.pattern] = np.broadcast_to(initial, shape).reshape(len(self.pattern), self.lanes)
        return states

    def led(self, path: Path | None) -> tuple[np.ndarray, np.ndarray]:
        """A path as the compiled code takes it, shape (rows, 4, lanes), and its last row in each window."""
        if path is None:
            return NOT_LED, np.zeros(1, dtype=np.int64)
        rows, _, models, windows = path.states.shape
        states = np.zeros((rows, 4, models * windows))
        states[:, self.pattern] = path.states.reshape(rows, len(self.pattern), -1)
        return states, path.until.astype(np.int64)

    def past(self, present: np.ndarray) -> np.ndarray:
        """Room for the true course (K + 1, 4, lanes) that late sensors need; one number where none is late."""
        return np.zeros((self.rows + 1, 4, self.lanes) if present[R.ON_SENSOR_DELAY] else (1, 4, 1))

    def recorded(self) -> np.ndarray:
        """Commands of the windows, shape (K, 2, R)."""
        commands = np.zeros((self.rows, 2, self.inputs.windows))
        commands[:, self.driven] = self.inputs.commands
        return commands

    def ramps(self) -> np.ndarray:
        """Change of the commands along each row, shape (K, 2, R); `HELD` where there is none."""
        if self.inputs.ramps is None:
            return HELD
        ramps = np.zeros((self.rows, 2, self.inputs.windows))
        ramps[:, self.driven] = self.inputs.ramps
        return ramps

    def loop(self, feedback: StateFeedback, references: np.ndarray, noise: np.ndarray | None) -> ClosedLoop:
        """A feedback with references (K, 2 joints, R) and measurement noise (K, 2 joints, P, R)."""
        gains = np.zeros((2, 4))
        gains[np.ix_(self.driven, self.pattern)] = feedback.gains
        wide = np.zeros((self.rows, 4, self.inputs.windows))
        wide[:, self.pattern] = references
        noise_rows = np.zeros((self.rows, 4, self.lanes))
        if noise is not None:
            noise_rows[:, self.pattern] = noise.reshape(self.rows, len(self.pattern), self.lanes)
        smoothing = -1.0 if feedback.rate_filter is None else feedback.rate_filter
        return ClosedLoop(gains, wide, noise_rows, np.array([smoothing, feedback.limit]))

    def per_command(self, values: np.ndarray) -> np.ndarray:
        """What each command has of `values` (K, 2, lanes), shape (K, inputs, P, R)."""
        return values[:, self.driven].reshape(len(values), len(self.driven), self.models, self.inputs.windows)

    def rollouts(self, out: np.ndarray, commands: np.ndarray, delivered: np.ndarray | None = None) -> Rollouts:
        """Rollouts from what the sensors show, `out` (K + 1, 4, lanes)."""
        joints = self.joints  # slices, not copies
        shape = (self.rows + 1, joints.stop - joints.start, self.models, self.inputs.windows)
        coordinates = out[:, joints].reshape(shape)
        rates = out[:, 2 + joints.start : 2 + joints.stop].reshape(shape)
        return Rollouts(coordinates, rates, commands, delivered)
