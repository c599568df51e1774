"""What an effect is: physics that can be missing from a nominal model, at a site.

All that the program knows of one effect stands in the `Effect` of its module in `wipx.effects`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, Protocol

import numpy as np

from wipx.core.parameters import Parameter
from wipx.core.plant import Plant

JOINT_SITES = ("translation", "pitch", "joint1", "joint2", "joint")
SENSOR_SITES = ("sensor_x", "sensor_theta", "sensor_theta1", "sensor_theta2", "sensor")

Columns = Mapping[str, np.ndarray]
Coefficient = str | Callable[[Columns, Columns], np.ndarray]
Parts = tuple[str, ...] | Callable[[Columns], tuple[str, ...]]


class Steady(NamedTuple):
    """An effect as a curve over one signal, all others constant.

    Attributes:
        over: The signal: rate or coordinate of the joint, or the force that reaches this part of the drive.
        force: What the effect adds, (N,) [N or N m], to values of the signal (N,), by its parameters and the rigid
            body's numbers.
        stage: Place on the path through the drive of a law over the command; lower stages act first.
    """

    over: Literal["rate", "coordinate", "command"]
    force: Callable[[np.ndarray, Mapping[str, float], Mapping[str, float]], np.ndarray]
    stage: int = 0


class FittedEffect(Protocol):
    """An effect with fitted numbers, and what the recordings show of its joint (the driven one where it has none)."""

    @property
    def values(self) -> Mapping[str, float]:
        """Its numbers by symbol [SI]."""
        ...

    @property
    def positions(self) -> np.ndarray:
        """Coordinate of the joint in every row, shape (N,) [m or rad]."""
        ...

    @property
    def resolution(self) -> float:
        """Smallest deflection of the joint that its sensor shows [m or rad]."""
        ...

    @property
    def top_speed(self) -> float:
        """Largest speed of the joint [m/s or rad/s]."""
        ...

    @property
    def rate(self) -> float:
        """Rows per second of the fastest log [Hz]."""
        ...

    @property
    def latest_start(self) -> float:
        """When the last of the recordings starts [s]."""
        ...

    def deviation(self, weights: Mapping[str, float]) -> float:
        """Standard deviation of a weighted sum of its numbers [SI]."""
        ...


@dataclass(frozen=True)
class Contains:
    """A simpler law that the law can always imitate.

    Attributes:
        kind: The simpler law.
        when: Whether fitted numbers amount to it.
        symbols: Symbols of the simpler law that differ, by those of this law.
        at_joint: Whether the simpler law acts at the joint of the law's drive; else at the same site.
        comes_to_rest: Whether the law also fits how a joint comes to rest, so that it must gain more than others.
    """

    kind: str
    when: Callable[[FittedEffect], bool]
    symbols: Mapping[str, str] = field(default_factory=dict)
    at_joint: bool = False
    comes_to_rest: bool = False


@dataclass(frozen=True)
class MadeOf:
    """Simpler laws that the law is the sum of in a limit.

    Attributes:
        site: Site of the law.
        numbers: Symbols of the law, by the numbers "site/kind.symbol" of the simpler laws that they are.
        when: Whether fitted numbers are in the limit.
    """

    site: str
    numbers: Mapping[str, str]
    when: Callable[[FittedEffect], bool]


@dataclass(frozen=True)
class Extends:
    """A law of the vocabulary that a law outside of it generalises, with the same symbols.

    Attributes:
        kind: The law of the vocabulary.
        starts: Values of the further numbers from which fits start [SI].
    """

    kind: str
    starts: tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class WithConstant:
    """An effect that the law and a constant force on the joint are together.

    Attributes:
        kind: The effect.
        symbols: Its symbols, by those of the law that start from them.
    """

    kind: str
    symbols: Mapping[str, str]


@dataclass(frozen=True)
class NonSmooth:
    """Why the likelihood of an effect has kinks between which slopes lead nowhere.

    Attributes:
        ridge: Numbers that change together with little change of the motion, and the powers with which they do.
        imitates: Kinds at the same site whose place its numbers can take, by symbol.
    """

    ridge: Mapping[str, float]
    imitates: Mapping[str, str]


@dataclass(frozen=True)
class Effect:
    """One kind of physics; its law stands in the module that defines it.

    Attributes:
        kind: Name in the vocabulary, e.g. "coulomb"; with a site it is "pitch/coulomb".
        words: Its name in a sentence, with "{place}" for the site; lower case but for names such as Coulomb.
        sites: Sites at which it can act, or their classes (`wipx.core.plant.Plant.class_of`).
        parameters: Numbers of the law.
        law: The equation, as text.
        source: Paper or book.
        needs: Joints or plant parameters without which the effect has no meaning.
        rows: Coefficients that it gives the simulator, by name of their row in `wipx.sim.rows`: a symbol, or a
            function of the effect's numbers and the rigid body's, each (P,), for P models. It stands for the row of
            the effect's joint, or of each driven joint; `X` for `SENSOR_X` at a sensor. A value of shape (n, P) fills n
            rows.
            Effects that fill one row add up. Empty where an effect only changes masses.
        parts: Parts of the simulator's signal path that it switches on, named likewise without `ON_`; a function of
            its numbers where they decide.
        steady: Its curve; None where no single signal decides its force.
        linear_at_rest: Kind of the law, itself or another with the same symbols, that small motions about rest feel;
            empty where it has no slope there.
        constant_force: Whether it acts as a constant force on a joint.
        stretch: Symbols of the ends of the stretch of the joint's way on which it acts.
        begins: Symbol of the time at which it begins to act.
        built_in: Parameter of joint or motor, as MuJoCo calls it, that physics engines have for it.
        linear_in: Parameters in proportion to which, counted from neutral, the effect grows at least
            roughly; empty where it has a threshold.
        superposes: Whether what its numbers do adds up, so that one regression finds first guesses of all.
        scan: Name of its first guesses in `wipx.diagnosis.candidates.screening`; the grids of its parameters where
            empty.
        non_smooth: Why slopes of its likelihood mislead; None where they do not.
        doubt: Relative standard deviation of its first number by what its law leaves open.
        tolerance: What every machine has of it: standard deviations of numbers about neutral, by symbol, in multiples
            of the joint's `wipx.core.parameters.Scales`; empty where that is nothing.
        usual: Whether nearly every machine has it, so that less evidence will do.
        outside_vocabulary: Whether contract section 3 lacks it. A diagnosis names such an effect only where those of
            the contract leave something over.
        on_machines: Whether contract section 6 has it at a site of a plant all the same; None for nowhere.
        excludes: Kinds that cannot act at the same site at the same time.
        contains: The simpler law that it contains.
        made_of: The simpler laws that it is the sum of in a limit.
        extends: The law of the vocabulary that it generalises.
        with_constant: What it is together with a constant force.
        indistinguishable: Effects "site/kind" that no recording tells from it; told of one of them.
    """

    kind: str
    words: str
    sites: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    law: str
    source: str
    needs: tuple[str, ...] = ()
    rows: Mapping[str, Coefficient] = field(default_factory=dict)
    parts: Parts = ()
    steady: Steady | None = None
    linear_at_rest: str = ""
    constant_force: bool = False
    stretch: tuple[str, str] | None = None
    begins: str = ""
    built_in: str = ""
    linear_in: tuple[str, ...] = ()
    superposes: bool = False
    scan: str = ""
    non_smooth: NonSmooth | None = None
    doubt: float = 0.0
    tolerance: Mapping[str, float] = field(default_factory=dict)
    usual: bool = False
    outside_vocabulary: bool = False
    on_machines: Callable[[str, Plant], bool] | None = None
    excludes: tuple[str, ...] = ()
    contains: Contains | None = None
    made_of: MadeOf | None = None
    extends: Extends | None = None
    with_constant: WithConstant | None = None
    indistinguishable: tuple[str, ...] = ()

    def is_outside(self, plant: Plant) -> bool:
        """Whether the contract lacks it for a plant: section 3, or section 6 for robots from model files."""
        return self.outside_vocabulary and (plant.tree is None or self.on_machines is None)

    @property
    def neutral(self) -> dict[str, float]:
        """Values at which the effect is absent [SI], by parameter name."""
        return {p.name: p.neutral for p in self.parameters}
