"""What `task=balance` finds out of one controller."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BalanceTrial:
    """A robot with a payload that balanced and then drove a way.

    Attributes:
        name: Of the controller.
        columns: What was recorded, by name, and the reference of the way.
        joint: That has no drive.
        true: Its position at which the loaded robot balances [rad].
        aimed: That at which the controller aimed in the end [rad].
        mass: Estimated payload [kg]; None where none was estimated.
        deviation: Its standard error [kg].
        fell: When the trial ended early [s]; None where it did not.
        standing: Largest distance from the reference in the last second before the way [m].
        arriving: Largest distance in the last second of the trial [m].
        near: Distance within which the robot has to stay [m].
    """

    name: str
    columns: Mapping[str, np.ndarray]
    joint: str
    true: float
    aimed: float
    mass: float | None
    deviation: float | None
    fell: float | None
    standing: float
    arriving: float
    near: float

    @property
    def balances(self) -> bool:
        """Whether the robot stood where it should."""
        return self.fell is None and self.standing < self.near

    @property
    def tracks(self) -> bool:
        """Whether it arrived where it should."""
        return self.fell is None and self.arriving < self.near
