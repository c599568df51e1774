"""What the laws around a rigid body and the engine that moves it tell each other in a step."""

from dataclasses import dataclass, field

import numpy as np

from wipx.sim.rows import MOST, W

# Rows; a pair belongs to joints 0 and 1.
(
    PLACE, PLACE1, SPEED, SPEED1,  # where the engine stands: in mid-step, later at the next one
    MASS11, MASS12, MASS22,  # the engine's mass matrix there
    BIAS, BIAS1,  # Coriolis, centrifugal and gravity forces there, on the side of M v'
    ROTOR, ROTOR1,  # inertia at the joints that the engine's bodies lack
    GAINED, GAINED1,  # accelerations over the step that it is to come to,
    PUSH, PUSH1,  # and the generalised forces that bring it there
    DURATION,  # of the step; 0 where a lane pauses
    LOADED,  # share of the payload event's mass that is on the body
    N_ROWS, *_,
) = range(MOST)  # fmt: skip


def _empty() -> np.ndarray:
    values = np.zeros((N_ROWS, W))
    values[[MASS11, MASS22]] = 1.0  # of a joint that the plant lacks
    return values


@dataclass(frozen=True)
class Exchange:
    """Up to `W` lanes of one model, side by side.

    Attributes:
        joints: Rows of the plant's joints among two.
        values: Shape (N_ROWS, W).
    """

    joints: slice
    values: np.ndarray = field(default_factory=_empty)

    def of(self, row: int, lane: int) -> np.ndarray:
        """What `lane` has of a pair of rows, a view of shape (joints,)."""
        return self.values[row + self.joints.start : row + self.joints.stop, lane]

    def mass(self, lane: int) -> np.ndarray:
        """Lower triangle of a lane's mass matrix row by row, a view of shape (1,) or (3,)."""
        first, last = 2 * self.joints.start, 2 * self.joints.stop - 1
        return self.values[MASS11 + first : MASS11 + last, lane]
