"""What to record next, so that what recordings leave open is settled."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Experiment:
    """An excitation, and how well it would tell apart what these recordings leave open.

    Attributes:
        name: Of the menu, e.g. "multisine".
        how: What a person does, one sentence.
        separation: Standard deviations by which it would separate the open question.
    """

    name: str
    how: str
    separation: float


@dataclass(frozen=True)
class NextExperiment:
    """What to record next.

    Attributes:
        question: What is open, one sentence.
        best: The excitation that settles it best.
        menu: All that were simulated, the best first.
        reference: Columns of the file that the controller can run: t and x_ref or theta_ref, or u; empty where
            the experiment needs none.
        release: Coordinate of the last joint from which the robot is released [rad, or m without a pitch].
        mass: Known mass that is added to the body [kg].
        repeats: How often it is to be done.
    """

    question: str
    best: Experiment
    menu: tuple[Experiment, ...]
    reference: Mapping[str, np.ndarray]
    release: float = 0.0
    mass: float = 0.0
    repeats: int = 1
