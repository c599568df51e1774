"""Where rollouts stand in the arrays of the compiled code.

A lane is one model on one window: lane = model * windows + window. A joint that a plant lacks stays at zero.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.plant import Plant
from wipx.sim import rows as R
from wipx.sim.coefficients import joint_count, joint_index
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path, Rollouts, StateFeedback


@dataclass(frozen=True)
class ClosedLoop:
    """A state feedback as the compiled code takes it.

    Attributes:
        gains: Shape (N, 2 N).
        references: Shape (K, 2 N, R).
        noise: Shape (K, 2 N, lanes).
        settings: Time constant of the rate filter [s] (negative: rates are measured), limit of the command.
    """

    gains: np.ndarray
    references: np.ndarray
    noise: np.ndarray
    settings: np.ndarray


@dataclass(frozen=True)
class Layout:
    """Arrays of P models on R windows, to and from the N joints of the compiled code.

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
    def width(self) -> int:
        """Joints N of the compiled code."""
        return joint_count(self.plant)

    @property
    def joints(self) -> slice:
        """The plant's joints; they are neighbours."""
        indices = [joint_index(self.plant, site) for site in self.plant.joints]
        return slice(indices[0], indices[-1] + 1)

    def places(self, kinds: int) -> list[int]:
        """Of the plant's joints in rows of several kinds, each of which has N: coordinates, rates, ..."""
        indices = [joint_index(self.plant, site) for site in self.plant.joints]
        return [kind * self.width + joint for kind in range(kinds) for joint in indices]

    @property
    def pattern(self) -> list[int]:
        """The plant's coordinates, then rates, among 2 N."""
        return self.places(2)

    @property
    def driven(self) -> list[int]:
        """The joint on which each command acts."""
        return [joint_index(self.plant, site) for site in self.plant.actuated]

    def states(self, initial: np.ndarray, path: Path | None = None) -> np.ndarray:
        """Carried states (N, STATES, lanes) from coordinates and rates (2 joints, P or 1, R or 1)."""
        states = np.zeros((self.width, R.STATES, self.lanes))
        if path is not None and path.carried is not None:
            states[:] = path.carried.reshape(states.shape)
        shape = (2, len(self.plant.joints), self.models, self.inputs.windows)
        start = np.broadcast_to(initial.reshape(2, -1, *initial.shape[1:]), shape)
        states[self.joints, R.Q], states[self.joints, R.V] = start.reshape(*shape[:2], self.lanes)
        return states

    def led(self, path: Path | None) -> tuple[np.ndarray, np.ndarray]:
        """A path as the compiled code takes it, shape (rows, 2 N, lanes), and its last row in each window."""
        if path is None or not len(path.states):
            return np.zeros((0, 2 * self.width, 1)), np.zeros(1, dtype=np.int64)
        rows, _, models, windows = path.states.shape
        states = np.zeros((rows, 2 * self.width, models * windows))
        states[:, self.pattern] = path.states.reshape(rows, len(self.pattern), -1)
        return states, path.until.astype(np.int64)

    def past(self, has: np.ndarray) -> np.ndarray:
        """Room for the true course (K + 1, 2 N, lanes) that late sensors need; one number where none is late."""
        late = has[:, R.ON_SENSOR_DELAY].any()
        return np.zeros((self.rows + 1, 2 * self.width, self.lanes) if late else (1, 2 * self.width, 1))

    def recorded(self) -> np.ndarray:
        """Commands of the windows, shape (K, N, R)."""
        commands = np.zeros((self.rows, self.width, self.inputs.windows))
        commands[:, self.driven] = self.inputs.commands
        return commands

    def ramps(self) -> np.ndarray | None:
        """Change of the commands along each row, shape (K, N, R); None where there is none."""
        if self.inputs.ramps is None:
            return None
        ramps = np.zeros((self.rows, self.width, self.inputs.windows))
        ramps[:, self.driven] = self.inputs.ramps
        return ramps

    def spread(self) -> np.ndarray:
        """Half width by which single commands scatter about the mean that the log has, shape (N, 1)."""
        spread = np.zeros((self.width, 1))
        spread[self.driven, 0] = self.inputs.spread
        return spread

    def block(self, rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Room for a block of lanes of a robot with so many rows: A, lanes, pointers and counts of `rollout`."""
        room = np.zeros((self.width * R.BLOCK + rows) * R.W)
        lanes, pointers = np.zeros((2, R.W), dtype=np.int64), np.zeros((self.width, R.W), dtype=np.int64)
        return room, lanes, pointers, np.zeros(R.W, dtype=np.int64)

    def held(self) -> np.ndarray:
        """Stands for commands that do not change along a row."""
        return np.zeros((1, self.width, 1))

    def open_loop(self) -> ClosedLoop:
        """Stands for a feedback where there is none."""
        width = self.width
        rows = np.zeros((1, 2 * width, 1))
        return ClosedLoop(np.zeros((width, 2 * width)), rows, rows, np.zeros(2))

    def loop(self, feedback: StateFeedback, references: np.ndarray, noise: np.ndarray | None) -> ClosedLoop:
        """A feedback with references (K, 2 joints, R) and measurement noise (K, 2 joints, P, R)."""
        gains = np.zeros((self.width, 2 * self.width))
        gains[np.ix_(self.driven, self.pattern)] = feedback.gains
        wide = np.zeros((self.rows, 2 * self.width, self.inputs.windows))
        wide[:, self.pattern] = references
        noise_rows = np.zeros((self.rows, 2 * self.width, self.lanes))
        if noise is not None:
            noise_rows[:, self.pattern] = noise.reshape(self.rows, len(self.pattern), self.lanes)
        smoothing = -1.0 if feedback.rate_filter is None else feedback.rate_filter
        return ClosedLoop(gains, wide, noise_rows, np.array([smoothing, feedback.limit]))

    def per_command(self, values: np.ndarray) -> np.ndarray:
        """What each command has of `values` (K, N, lanes), shape (K, inputs, P, R)."""
        return values[:, self.driven].reshape(len(values), len(self.driven), self.models, self.inputs.windows)

    def rollouts(
        self,
        out: np.ndarray,
        commands: np.ndarray,
        delivered: np.ndarray | None = None,
        carried: np.ndarray | None = None,
    ) -> Rollouts:
        """Rollouts from what the sensors show, `out` (K + 1, 2 N, lanes)."""
        joints = self.joints  # slices, not copies
        shape = (self.rows + 1, joints.stop - joints.start, self.models, self.inputs.windows)
        coordinates = out[:, joints].reshape(shape)
        rates = out[:, self.width + joints.start : self.width + joints.stop].reshape(shape)
        return Rollouts(coordinates, rates, commands, delivered, carried)
