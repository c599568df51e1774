"""A hypothesis: the nominal model, the effects that are supposed to be missing, and what may vary."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wipx.core.model import Model
from wipx.core.parameters import FreeParameter, Scales
from wipx.effects.catalogue import effect_of
from wipx.identify.parameter_space import ParameterSpace, effect_parameters, parameter_space

GIVEN = ("gravity",)  # numbers that are exact


@dataclass(frozen=True)
class ByForces:
    """What recorded forces say of a number of an effect.

    Attributes:
        value: The number [SI].
        deviation: Its standard deviation [SI].
        asked: Whether they ask for the effect.
    """

    value: float
    deviation: float
    asked: bool


@dataclass(frozen=True)
class Setting:
    """What all hypotheses about a robot share.

    Attributes:
        nominal: What its owner believes.
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        scales: Characteristic sizes by site.
        sites: Where effects are looked for; None for everywhere.
        by_forces: What recorded forces say of numbers of effects, by "site/kind.symbol".
        forces_count: Whether that is the prior of these numbers.
        tolerances: Laws that every machine follows a little, by "site/kind", with the numbers that no prior holds.
        everywhere: Whether all of them act, beside the effects of a hypothesis.
    """

    nominal: Model
    uncertainty: Mapping[str, float]
    scales: Mapping[str, Scales]
    sites: frozenset[str] | None = None
    by_forces: Mapping[str, ByForces] = field(default_factory=dict)
    forces_count: bool = False
    tolerances: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    everywhere: bool = False

    @property
    def asked_for(self) -> dict[str, float]:
        """Numbers of the effects that recorded forces ask for, by "site/kind.symbol" [SI]."""
        return {name: number.value for name, number in self.by_forces.items() if number.asked}

    def expects(self, effect: str) -> bool:
        """Whether recorded forces ask for an effect "site/kind"."""
        return any(name.rpartition(".")[0] == effect for name in self.asked_for)

    def looks_at(self, effect: str) -> bool:
        """Whether an effect "site/kind" is looked for."""
        return self.sites is None or effect.partition("/")[0] in self.sites

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        """The numbers that vary when these effects are added: theirs, and the uncertain nominal ones."""
        plant = self.nominal.plant
        more = tuple(name for name in self.tolerances if self.everywhere and name not in self.nominal.effects)
        small = tuple(name for name in dict.fromkeys((*effects, *more)) if name in self.tolerances)
        own = tuple(name for name in effects if name not in small)
        prepared = self.nominal.with_effects({name: effect_of(name, plant).neutral for name in own})
        prepared = prepared.with_effects({n: {**effect_of(n, plant).neutral, **self.tolerances[n]} for n in small})
        free: tuple[FreeParameter, ...] = tuple(number for name in small for number in self._small(name))
        if own or self.uncertainty:
            space = parameter_space(prepared, own, self.uncertainty, {}, {}, self.scales)
            known = tuple(map(self._by_forces, space.free)) if self.forces_count else space.free
            return replace(space, free=(*known, *free))
        return ParameterSpace(prepared, free)

    def _small(self, name: str) -> Iterator[FreeParameter]:
        """The numbers of a law that every machine follows a little, with the prior that says so."""
        plant, sizes = self.nominal.plant, self.scales[name.partition("/")[0]]
        law = effect_of(name, plant)
        for number, known in zip(effect_parameters(name, plant, self.scales), law.parameters, strict=True):
            if known.name in law.tolerance:
                deviation = law.tolerance[known.name] * sizes.of(known.dimension)
                yield replace(number, start=number.neutral, prior_mean=number.neutral, prior_std=deviation)

    def _by_forces(self, number: FreeParameter) -> FreeParameter:
        """A number with the prior that recorded forces give it, where they do."""
        site, symbol = number.name.partition("/")[0], number.name.rpartition(".")[2]
        level = f"{site}/coulomb.{symbol}"  # laws of dry friction share its symbol
        known = self.by_forces.get(number.name, self.by_forces.get(level))
        if known is None or not 0.0 < known.deviation < np.inf:
            return number
        return replace(number, prior_mean=known.value, prior_std=known.deviation)

    def with_curve_of(self, hypothesis: "Hypothesis") -> "Setting":
        """The robot with the curve that stands in for what a hypothesis leaves over, where it has one."""
        effects, known = hypothesis.space.model.effects, (*hypothesis.effects, *self.nominal.effects)
        curve = {name: values for name, values in effects.items() if name not in known}
        return replace(self, nominal=self.nominal.with_effects(curve)) if curve else self

    def doubted(self, deviation: float) -> "Setting":
        """The same robot, none of whose numbers is quite exact: those of a real machine never are.

        Of a tree, the numbers of the links and joints at which effects are looked for.

        Args:
            deviation: Relative standard deviation of a rigid body's numbers that are given as exact; of lengths, by
                the robot's size.
        """
        if deviation == 0.0:
            return self
        plant = self.nominal.plant
        known = {name: value for name, value in self.nominal.parameters.items() if value and name not in GIVEN}
        if plant.tree is not None:
            known = {name: value for name, value in known.items() if self._is_of_these_sites(name.partition(".")[0])}
        sizes = {name: self._size(name) if plant.parameters[name].absolute else 1.0 for name in known}
        return replace(self, uncertainty={**{n: deviation * s for n, s in sizes.items()}, **self.uncertainty})

    def _is_of_these_sites(self, owner: str) -> bool:
        """Whether a joint or a link of a tree is among the sites at which effects are looked for."""
        return self.sites is not None and bool({owner, f"link_{owner}"} & self.sites)

    def _size(self, name: str) -> float:
        """Length by which a place on a link is measured [m]."""
        return self.scales[f"link_{name.partition('.')[0]}"].length


@dataclass(frozen=True)
class Hypothesis:
    """Effects added to the nominal model, with values.

    Attributes:
        effects: Names "site/kind", in the order in which they were added.
        space: The numbers that vary.
        cube: Their values, as a position in the unit cube, shape (D,).
    """

    effects: tuple[str, ...]
    space: ParameterSpace
    cube: np.ndarray

    @classmethod
    def of(cls, setting: Setting, effects: tuple[str, ...], values: Mapping[str, float]) -> "Hypothesis":
        """Effects at given values; numbers that are not named start from their usual values."""
        space = setting.space(effects)
        start = np.array([values.get(p.name, p.start) for p in space.free])
        return cls(effects, space, space.to_cube(start))

    @property
    def model(self) -> Model:
        """The nominal model with these effects."""
        return self.space.model.with_values(self.values)

    @property
    def values(self) -> dict[str, float]:
        """Every number that varies [SI]."""
        return dict(zip(self.space.names, self.space.to_values(self.cube).tolist(), strict=True))

    def at(self, cube: np.ndarray) -> "Hypothesis":
        """The same effects with other values."""
        return replace(self, cube=cube)

    def parameters_of(self, effect: str) -> list[int]:
        """Which of the numbers belong to an effect."""
        return [i for i, name in enumerate(self.space.names) if name.startswith(f"{effect}.")]
