"""The contract of controllers: settings in, a loop out, and what a task must know of them in between."""

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol, Self

import numpy as np

from wipx.control.linear_law import LinearLaw
from wipx.control.loop import ControlLoop
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.sim.simulator import StateFeedback


class EstimatedPitch(Protocol):
    """Equilibrium pitches with intervals."""

    @property
    def pitch(self) -> np.ndarray:
        """Shape (N,) [rad]."""
        ...

    @property
    def low(self) -> np.ndarray:
        """Lower ends, shape (N,)."""
        ...

    @property
    def high(self) -> np.ndarray:
        """Upper ends, shape (N,)."""
        ...


class PitchEstimator(Protocol):
    """Estimates equilibrium pitches from windows that begin at the release; every member of `estimator` is one."""

    @property
    def length(self) -> int:
        """Samples of a window."""
        ...

    @property
    def period(self) -> float:
        """Time between them [s]."""
        ...

    def estimate(self, windows: np.ndarray) -> EstimatedPitch:
        """From x and theta, shape (N, length, 2) [m, rad]."""
        ...


class LinearController(Protocol):
    """What stability margins need of a controller."""

    @property
    def rate(self) -> float:
        """Steps per second [Hz]."""
        ...

    def law(self, model: Model) -> LinearLaw:
        """Its gains for a model's rigid body."""
        ...


class Controller(ABC):
    """A controller that is linear while no limit acts; every member of `controller` is one.

    A subclass is a frozen dataclass with `law` and `loop`. Defaults of the rest suit a controller that acts about the
    nominal balance, asks no estimator and does not know where the rail ends.

    Attributes:
        rate: Steps per second [Hz].
        asks_estimator: Whether `loop` needs an estimator of the equilibrium pitch.
    """

    rate: float
    asks_estimator: ClassVar[bool] = False

    @property
    def moves_balance(self) -> bool:
        """Whether it moves the pitch about which it acts; `law` is then its inner loop alone."""
        return False

    def on_rail(self, half: float) -> Self:
        """The controller for a rail that ends at -half and +half [m]; the same where it has no use for that."""
        return self

    def state_feedback(self, model: Model) -> StateFeedback | None:
        """The controller as a plain state feedback, which is all that robot.yaml can describe; None where it is more.

        Raises:
            InputError: as in `law`.
        """
        return None

    @abstractmethod
    def law(self, model: Model) -> LinearLaw:
        """Its gains for a model's rigid body.

        Raises:
            InputError: the settings do not fit the plant.
        """

    @abstractmethod
    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> ControlLoop:
        """What runs at the robot's rate, on a state estimated with the whole model.

        Args:
            model: The robot without load.
            estimator: Of the equilibrium pitch, where `asks_estimator`; others ignore it.

        Raises:
            InputError: as in `law`, or the gains do not stabilise the whole model.
        """


def needed(estimator: PitchEstimator | None) -> PitchEstimator:
    """The estimator that a loop asks.

    Raises:
        InputError: there is none.
    """
    if estimator is None:
        raise InputError("controller: it asks an estimator of the equilibrium pitch; give one to its loop")
    return estimator
