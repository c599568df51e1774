"""Friction variants: which effects act on every joint of a plant."""

from dataclasses import dataclass

from wipx.core.effect import JOINT_SITES
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.effects.catalogue import kinds


@dataclass(frozen=True)
class JointFriction:
    """The same kinds of friction on every joint, each with parameters of its own.

    Attributes:
        kinds: Kinds of effects, e.g. coulomb and viscous.
    """

    kinds: tuple[str, ...] = ()

    def switched_on(self, model: Model, earlier: Model | None) -> tuple[str, ...]:
        """Effects to identify; one that the nominal model has already is left as it is."""
        names = (f"{joint}/{kind}" for joint in model.plant.joints for kind in self.kinds)
        return tuple(name for name in names if name not in model.effects)

    def given(self, model: Model, earlier: Model | None) -> dict[str, dict[str, float]]:
        """Effects with known values: none."""
        return {}


@dataclass(frozen=True)
class IdentifiedFriction:
    """The friction of an earlier model.yaml, with the values found there."""

    def switched_on(self, model: Model, earlier: Model | None) -> tuple[str, ...]:
        """Effects to identify: none."""
        return ()

    def given(self, model: Model, earlier: Model | None) -> dict[str, dict[str, float]]:
        """The earlier model's effects at the joints.

        Raises:
            InputError: there is no earlier model.
        """
        if earlier is None:
            raise InputError(
                "friction=identified takes the friction of an earlier model; give model.path=.../model.yaml"
            )
        frictions = {kind for kind, effect in kinds().items() if set(effect.sites) & set(JOINT_SITES)}
        return {
            name: dict(values)
            for name, values in earlier.effects.items()
            if name.partition("/")[0] in model.plant.joints and name.partition("/")[2] in frictions
        }
