"""What the loops of all controllers share: a filtered state, limited commands, and a filter that is told of them."""

from abc import ABC, abstractmethod

import numpy as np

from wipx.control.ekf import Ekf


class FilteredLoop(ABC):
    """A control law on the state estimate of an extended Kalman filter; a `wipx.control.loop.ControlLoop`.

    Attributes:
        estimator: Gives the state.
        rate: Steps per second [Hz].
        limit: Largest command [N or N m].
        balance: See `ControlLoop.balance`.
        notes: See `ControlLoop.notes`.
    """

    balance: float | None = None
    notes: tuple[str, ...] = ()

    def __init__(self, estimator: Ekf, rate: float, limit: float) -> None:
        self.estimator = estimator
        self.rate = rate
        self.limit = limit

    @property
    def state(self) -> np.ndarray:
        """Estimated coordinates, then rates, shape (2 joints,) [m, rad, m/s, rad/s]."""
        return self.estimator.state

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; see `Loop.reset`."""
        self.estimator.reset(t, measured)

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands for a reading, shape (inputs,) [N or N m]; see `Loop.step`."""
        state = self.estimator.observe(t, measured)
        commands = np.clip(self.wanted(t, state, measured, reference), -self.limit, self.limit)
        self.estimator.send(t, commands)
        return commands

    @abstractmethod
    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit, shape (inputs,) [N or N m].

        Args:
            t: Time [s].
            state: Estimated, shape (2 joints,).
            measured: As the sensors show it, NaN where a sensor had nothing new, shape (2 joints,).
            reference: Of coordinates and rates, shape (2 joints,).
        """
