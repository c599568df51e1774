"""What an effect is: physics that can be missing from a nominal model, at a site."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from wipx.core.parameters import Parameter

JOINT_SITES = ("translation", "pitch", "joint1", "joint2")
SENSOR_SITES = ("sensor_x", "sensor_theta", "sensor_theta1", "sensor_theta2")


class Steady(NamedTuple):
    """An effect as a curve over one signal, all others constant.

    Attributes:
        over: The signal: rate or coordinate of the joint, or the force that reaches this part of the drive.
        force: What the effect adds, (N,) [N or N m], to values of the signal (N,), by its parameters and the rigid
            body's numbers.
    """

    over: Literal["rate", "coordinate", "command"]
    force: Callable[[np.ndarray, Mapping[str, float], Mapping[str, float]], np.ndarray]


@dataclass(frozen=True)
class Effect:
    """One kind of physics; its law stands in the module that defines it.

    Attributes:
        kind: Name in the vocabulary, e.g. "coulomb"; with a site it is "pitch/coulomb".
        sites: Sites at which it can act.
        parameters: Numbers of the law.
        law: The equation, as text.
        linear_in: Parameters in proportion to which, counted from neutral, the effect grows at least
            roughly; empty where it has a threshold.
        source: Paper or book.
        excludes: Kinds that cannot act at the same site at the same time.
        needs: Joints or plant parameters without which the effect has no meaning.
        doubt: Relative standard deviation of its first number by what its law leaves open.
        outside_vocabulary: Whether contract section 3 lacks it. A diagnosis names such an effect only where those of
            the contract leave something over.
        steady: Its curve; None where no single signal decides its force.
    """

    kind: str
    sites: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    law: str
    source: str
    linear_in: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    doubt: float = 0.0
    outside_vocabulary: bool = False
    steady: Steady | None = None

    @property
    def neutral(self) -> dict[str, float]:
        """Values at which the effect is absent [SI], by parameter name."""
        return {p.name: p.neutral for p in self.parameters}
