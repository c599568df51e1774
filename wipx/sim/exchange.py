"""What the laws around a rigid body and the engine that moves it tell each other in a step."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wipx.sim.rows import W


class Lanes(NamedTuple):
    """Up to `W` lanes of one model with N joints, side by side, as the compiled code takes them.

    Attributes:
        place: Where the engine stands: in mid-step, later at the next one, shape (N, W).
        speed: Likewise.
        mass: The engine's mass matrix there, shape (N, N, W); only the lower triangle counts.
        bias: Coriolis, centrifugal and gravity forces there, on the side of M v', shape (N, W).
        rotor: Inertia at the joints that the engine's bodies lack, shape (N, W).
        gained: Accelerations over the step that the engine is to come to, shape (N, W).
        push: Generalised forces that bring it there, shape (N, W).
        duration: Of the step; 0 where a lane pauses, shape (W,).
        loaded: Share of the payload event's mass that is on the body, shape (W,).
        command: Of each drive at this moment, times its input gain, shape (N, W).
    """

    place: np.ndarray
    speed: np.ndarray
    mass: np.ndarray
    bias: np.ndarray
    rotor: np.ndarray
    gained: np.ndarray
    push: np.ndarray
    duration: np.ndarray
    loaded: np.ndarray
    command: np.ndarray


@dataclass(frozen=True)
class Exchange:
    """Lanes of one model.

    Attributes:
        joints: The plant's joints among those of the compiled code.
        lanes: All of them.
    """

    joints: slice
    lanes: Lanes

    @classmethod
    def of(cls, joints: slice, width: int) -> "Exchange":
        """An exchange for a plant whose `joints` are some of `width`."""
        place, speed, bias, rotor, gained, push, command = (np.zeros((width, W)) for _ in range(7))
        mass = np.repeat(np.eye(width)[..., None], W, axis=2)  # 1 for a joint that the plant lacks
        return cls(joints, Lanes(place, speed, mass, bias, rotor, gained, push, np.zeros(W), np.zeros(W), command))

    def joint(self, name: str, lane: int) -> np.ndarray:
        """What `lane` has of a quantity of the joints, a view of shape (joints,)."""
        return getattr(self.lanes, name)[self.joints, lane]

    def mass(self, lane: int) -> np.ndarray:
        """A lane's mass matrix, a view of shape (joints, joints)."""
        return self.lanes.mass[self.joints, self.joints, lane]
