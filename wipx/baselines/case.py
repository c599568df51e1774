"""What a baseline is given and what it answers: the same for all of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np

from wipx.baselines.network import ResidualAcceleration
from wipx.core.model import Model
from wipx.core.parameters import Scales
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.effects.catalogue import effect_of, vocabulary
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator

OF_TREES = ("asymmetric_coulomb", "load_friction", "offset", "rotor_inertia")  # contract section 6 has them besides


@dataclass(frozen=True)
class Problem:
    """Recordings of a robot, and what its owner believes of it.

    Attributes:
        recordings: All that may be used.
        nominal: The owner's model.
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        simulator: The engine.
    """

    recordings: tuple[Recording, ...]
    nominal: Model
    uncertainty: Mapping[str, float]
    simulator: AnalyticSimulator

    @cached_property
    def noise(self) -> np.ndarray:
        """Sensor noise of each coordinate, shape (joints,) [m or rad]."""
        return sensor_noise(self.recordings, self.nominal.plant)

    @cached_property
    def scales(self) -> dict[str, Scales]:
        """Characteristic sizes by site."""
        return scales_of(self.nominal, self.recordings)

    @property
    def speeds(self) -> tuple[float, ...]:
        """What each joint reaches, shape (joints,) [m/s or rad/s]."""
        return tuple(self.scales[site].velocity for site in self.nominal.plant.joints)

    def budget(self, seconds: float) -> float:
        """Time for a search [s]: what a baseline is given, for each joint of a robot from a model file."""
        return seconds * (1 if self.nominal.plant.tree is None else len(self.nominal.plant.joints))

    @property
    def vocabulary(self) -> tuple[str, ...]:
        """Effects of contract sections 3 and 6 that can be added to the owner's model."""
        plant, present = self.nominal.plant, tuple(self.nominal.effects)
        beside = OF_TREES if plant.tree is not None else ()
        contract = (
            name
            for name, effect in vocabulary(plant).items()
            if (not effect.outside_vocabulary or effect.kind in beside) and name not in present
        )
        return tuple(name for name in contract if not excluded(name, present, plant))


def excluded(name: str, present: tuple[str, ...], plant: Plant) -> bool:
    """Whether an effect cannot act beside those that are present."""
    site, _, kind = name.partition("/")
    beside = [other.partition("/")[2] for other in present if other.partition("/")[0] == site]
    refused = effect_of(name, plant).excludes
    return any(other in refused or kind in effect_of(f"{site}/{other}", plant).excludes for other in beside)


@dataclass(frozen=True)
class Found:
    """An effect that a baseline names.

    Attributes:
        name: "site/kind".
        parameters: Its numbers by symbol [SI].
        weight: How much worse the fit is without it; shares are in proportion to it.
        equivalent: Effects that explain the recordings exactly as well.
    """

    name: str
    parameters: Mapping[str, float]
    weight: float
    equivalent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """What a baseline says.

    Attributes:
        model: The completed model.
        found: Effects that it names.
        mismatch: Whether it says that the nominal model is wrong.
        network: Acceleration that is added to the model; None for a baseline that needs no network.
        notes: What a reader must know, one sentence each.
    """

    model: Model
    found: tuple[Found, ...]
    mismatch: bool
    network: ResidualAcceleration | None = None
    notes: tuple[str, ...] = ()


class Baseline(Protocol):
    """A method that people would use in place of a diagnosis.

    Attributes:
        of_trees: Whether it can do robots from a model file.
    """

    of_trees: ClassVar[bool]

    @property
    def seconds(self) -> float:
        """Its budget of time [s]."""
        ...

    def answer(self, case: Problem, rng: np.random.Generator) -> Answer:
        """Complete the model of a case within the budget, and name what was missing."""
        ...
