"""The choice of the nominal rigid body: the recordings' own description, or another."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import plant_of


@dataclass(frozen=True)
class NominalPlant:
    """Nominal parameters that replace those of robot.yaml.

    Attributes:
        kind: Plant; None takes plant and parameters of robot.yaml.
        parameters: Numbers that replace single ones (kind None) or all of them [SI].
    """

    kind: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)

    def nominal(self, described: Model) -> Model:
        """The nominal model for recordings whose owner described them by another.

        Raises:
            InputError: a parameter is wrong, or the recordings are of another plant.
        """
        if self.kind is None:
            merged = {**described.parameters, **self.parameters}
            return Model(described.plant, described.plant.complete(merged, "plant.parameters"), described.effects)
        plant = plant_of(self.kind)
        if plant.coordinates != described.plant.coordinates:
            raise InputError(
                f"plant={self.kind} has columns {', '.join(plant.coordinates)}, "
                f"the recordings are of a {described.plant.kind} with {', '.join(described.plant.coordinates)}"
            )
        return Model(plant, plant.complete(self.parameters, "plant.parameters"), described.effects)
