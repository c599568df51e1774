"""The contract of controllers that need nothing but a model: settings in, a loop out."""

from typing import Protocol

from wipx.control.linear_law import LinearLaw
from wipx.control.loop import Loop
from wipx.core.model import Model


class LinearController(Protocol):
    """A controller that is linear while no limit acts; every member of `controller` is one."""

    @property
    def rate(self) -> float:
        """Steps per second [Hz]."""
        ...

    def law(self, model: Model) -> LinearLaw:
        """Its gains for a model's rigid body.

        Raises:
            InputError: the settings do not fit the plant.
        """
        ...


class Controller(LinearController, Protocol):
    """A controller whose loop needs no estimator of the equilibrium pitch; that of `EquilibriumLqr` does."""

    def loop(self, model: Model) -> Loop:
        """What runs at the robot's rate, on a state estimated with the whole model.

        Raises:
            InputError: as in `law`, or the gains do not stabilise the whole model.
        """
        ...
