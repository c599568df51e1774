"""What runs at a robot's rate: from what its sensors show to its commands."""

from typing import Protocol

import numpy as np


class Loop(Protocol):
    """A state estimate and a controller; the same object drives simulator, emulated testbed and hardware."""

    @property
    def rate(self) -> float:
        """Steps per second [Hz]."""
        ...

    @property
    def state(self) -> np.ndarray:
        """Estimated coordinates, then rates, shape (2 joints,) [m, rad, m/s, rad/s]."""
        ...

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; the robot is at rest where its sensors show it.

        Args:
            t: Time [s].
            measured: Coordinates and rates as the sensors show them, shape (2 joints,).
        """
        ...

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """One step.

        Args:
            t: Time [s]; steps may be uneven.
            measured: As in `reset`; NaN where a sensor had nothing new.
            reference: Of coordinates and rates, shape (2 joints,).

        Returns:
            Commands, shape (inputs,) [N or N m].
        """
        ...


class ControlLoop(Loop, Protocol):
    """The loop of a controller, which also says what it found out during a trial."""

    @property
    def balance(self) -> float | None:
        """Estimated pitch at which the robot balances [rad]; None where no estimator is asked."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided during this trial, one line each."""
        ...
