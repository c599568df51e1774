"""A model: a plant's rigid body plus effects, each with the values of its parameters.

Reading and writing of files is in `wipx.recordings.model_file`; simulation in `wipx.sim`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from wipx.core.plant import Plant


def _frozen(values: Mapping[str, float]) -> Mapping[str, float]:
    return MappingProxyType(dict(values))


@dataclass(frozen=True)
class Model:
    """A plant, the numbers of its rigid body, and effects beside it.

    Attributes:
        plant: The kind of mechanism.
        parameters: Rigid body by name [SI]; complete.
        effects: Values of each effect's parameters [SI], by "site/kind"; an effect that is not
            listed is absent.
        bandwidths: How little the model is trusted where a prediction starts: bandwidth of the filter that
            estimates its state, by coordinate [rad/s]; empty where that is not known. No physics depends on it.
    """

    plant: Plant
    parameters: Mapping[str, float]
    effects: Mapping[str, Mapping[str, float]]
    bandwidths: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", _frozen(self.parameters))
        object.__setattr__(self, "effects", MappingProxyType({k: _frozen(v) for k, v in self.effects.items()}))
        object.__setattr__(self, "bandwidths", _frozen(self.bandwidths))

    def __reduce__(self):
        # Mapping proxies do not pickle; rebuild from plain dictionaries.
        effects = {k: dict(v) for k, v in self.effects.items()}
        return Model, (self.plant, dict(self.parameters), effects, dict(self.bandwidths))

    def value(self, name: str) -> float:
        """The number of that name: a plant parameter or "site/kind.symbol"."""
        if name in self.parameters:
            return self.parameters[name]
        effect, _, symbol = name.rpartition(".")
        return self.effects[effect][symbol]

    def servo(self, joint: str) -> tuple[float, float]:
        """Stiffness and damping of the position drive of a joint, with the effects that change them.

        Units are N m/rad and N m s/rad, or N/m and N s/m where the joint slides.
        """
        kp, kd = (
            self.parameters[f"{joint}.{kind}"] * self.effects.get(f"actuator_{joint}/{kind}", {}).get("factor", 1.0)
            for kind in ("kp", "kd")
        )
        return kp, kd

    def with_values(self, values: Mapping[str, float]) -> "Model":
        """A copy in which the named numbers are replaced."""
        parameters = dict(self.parameters)
        effects = {name: dict(symbols) for name, symbols in self.effects.items()}
        for name, value in values.items():
            effect, _, symbol = name.rpartition(".")
            if name in parameters:
                parameters[name] = float(value)
            else:
                effects[effect][symbol] = float(value)
        return replace(self, parameters=parameters, effects=effects)

    def with_effects(self, effects: Mapping[str, Mapping[str, float]]) -> "Model":
        """A copy with further effects; those of the same name are replaced."""
        return replace(self, effects={**self.effects, **effects})


@dataclass(frozen=True)
class ModelBatch:
    """Many models of one structure: a model in which some numbers vary.

    Attributes:
        model: What they share.
        names: The numbers that vary, as `Model.value` names them.
        values: Their values, shape (P, len(names)) [SI].
    """

    model: Model
    names: tuple[str, ...] = ()
    values: np.ndarray | None = None

    @property
    def size(self) -> int:
        """Number of models P."""
        return 1 if self.values is None else len(self.values)

    def column(self, name: str) -> np.ndarray:
        """The number of that name in every model, shape (P,)."""
        if self.values is not None and name in self.names:
            return np.ascontiguousarray(self.values[:, self.names.index(name)], dtype=float)
        return np.full(self.size, self.model.value(name))
