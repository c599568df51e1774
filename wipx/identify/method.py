"""Which simulation later training sets come from: the five methods of the paper, Sec. V-C."""

from dataclasses import dataclass
from typing import Literal

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.effects.catalogue import kinds, vocabulary
from wipx.identify.friction import IdentifiedFriction, JointFriction

AS_IT_IS = ("none", "completed")  # physics that nothing is searched or drawn for
BUILT_IN = ("damping", "frictionloss", "armature", "gear")  # what physics engines have for joints and motors; seven
# numbers for a plant of two joints


@dataclass(frozen=True)
class Method:
    """Physics beside the rigid body, and where its numbers come from.

    Attributes:
        physics: `none`; `friction`: the chosen friction and effects=[...]; `built_in`: joint damping, friction loss,
            armature and motor gear, which every physics engine has; `completed`: what a model has that was completed
            before.
        values: `nominal`; `optimised`: those that match the recordings best; `random`: drawn by
            `ParameterSpace.sample`.
        effects: Further effects of `friction`, beside effects=[...], as "site/kind".
        reach: Share of the search intervals over which random numbers are spread; a robot whose friction is as large as
            what drives it does not move at all.
    """

    physics: Literal["none", "friction", "built_in", "completed"]
    values: Literal["nominal", "optimised", "random"]
    effects: tuple[str, ...] = ()
    reach: float = 0.1

    def __post_init__(self) -> None:
        if self.effects and self.physics != "friction":
            raise InputError(f"method.effects belongs to physics=friction, not to {self.physics}; leave it out")
        if not 0.0 < self.reach <= 1.0:
            raise InputError(f"method.reach is {self.reach:g}, expected a share in (0, 1]")
        if (self.physics in AS_IT_IS) != (self.values == "nominal"):
            raise InputError(
                f"method: physics={self.physics} with values={self.values} leaves nothing to do; "
                "physics=none and physics=completed go with values=nominal only"
            )

    @property
    def completes(self) -> bool:
        """Whether it takes a model that was completed before."""
        return self.physics == "completed"

    def switched_on(
        self, model: Model, friction: JointFriction | IdentifiedFriction, effects: tuple[str, ...]
    ) -> tuple[str, ...]:
        """Effects whose numbers are optimised or drawn.

        Args:
            model: The nominal model; an effect that it has already is left as it is.
            friction: The chosen friction.
            effects: Further effects that were switched on, as "site/kind".
        """
        if self.physics in AS_IT_IS:
            return ()
        if self.physics == "friction":
            return tuple(dict.fromkeys((*friction.switched_on(model, None), *self.effects, *effects)))
        return tuple(name for name in built_in(model.plant) if name not in model.effects)


def built_in(plant: Plant) -> tuple[str, ...]:
    """Effects that a physics engine has as parameters of its own."""
    kinds_of = {effect.built_in: kind for kind, effect in kinds().items()}
    names = (f"{site}/{kinds_of[parameter]}" for site in (*plant.joints, "actuator") for parameter in BUILT_IN)
    return tuple(name for name in names if name in vocabulary(plant))
