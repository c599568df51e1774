"""A hypothesis: the nominal model, the effects that are supposed to be missing, and what may vary."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model
from wipx.core.parameters import Scales
from wipx.effects.catalogue import effect_of
from wipx.identify.parameter_space import ParameterSpace, parameter_space

GIVEN = ("gravity",)  # numbers that are exact


@dataclass(frozen=True)
class Setting:
    """What all hypotheses about a robot share.

    Attributes:
        nominal: What its owner believes.
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        scales: Characteristic sizes by site.
    """

    nominal: Model
    uncertainty: Mapping[str, float]
    scales: Mapping[str, Scales]

    def space(self, effects: tuple[str, ...]) -> ParameterSpace:
        """The numbers that vary when these effects are added: theirs, and the uncertain nominal ones."""
        plant = self.nominal.plant
        prepared = self.nominal.with_effects({name: effect_of(name, plant).neutral for name in effects})
        if not effects and not self.uncertainty:
            return ParameterSpace(prepared, ())
        return parameter_space(prepared, effects, self.uncertainty, {}, {}, self.scales)

    def with_curve_of(self, hypothesis: "Hypothesis") -> "Setting":
        """The robot with the curve that stands in for what a hypothesis leaves over, where it has one."""
        effects, known = hypothesis.space.model.effects, (*hypothesis.effects, *self.nominal.effects)
        curve = {name: values for name, values in effects.items() if name not in known}
        return replace(self, nominal=self.nominal.with_effects(curve)) if curve else self

    def doubted(self, deviation: float) -> "Setting":
        """The same robot, none of whose numbers is quite exact: those of a real machine never are.

        Args:
            deviation: Relative standard deviation of a rigid body's numbers that are given as exact.
        """
        if deviation == 0.0:
            return self
        body = {name: deviation for name, value in self.nominal.parameters.items() if value and name not in GIVEN}
        return replace(self, uncertainty={**body, **self.uncertainty})


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
