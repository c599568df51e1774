"""A known weight on the body, beside its axis too: how it changes the rigid body and its equilibrium."""

from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model

BALANCE = "geometry/com_offset"
BODY = ("body_mass", "com_height", "body_inertia", f"{BALANCE}.theta_eq")  # what a load changes


@dataclass(frozen=True)
class Load:
    """A point mass fixed to the body of a wip or cartpole.

    Attributes:
        mass: [kg].
        height: Above the wheel axis, along the body's axis [m].
        side: Beside the body's axis, towards +x when the body is upright [m]; a load at negative `side` moves the
            equilibrium pitch to negative angles, since positive theta moves the centre of mass to -x.
    """

    mass: float
    height: float
    side: float

    def on(self, model: Model) -> Model:
        """The model with the load on its body: mass, centre of mass, inertia about it, equilibrium pitch.

        Raises:
            InputError: the model has no body on a carriage.
        """
        if "com_height" not in model.parameters or "wheel_mass" not in model.parameters:
            raise InputError(f"load: a {model.plant.kind} has no body that could carry one; leave the load out")
        if self.mass == 0.0:
            return model
        leaning = with_lean(model)
        body = np.array([leaning.value(name) for name in BODY])
        loaded = loaded_body(body, np.array([self.mass, self.height, self.side]))
        return leaning.with_values(dict(zip(BODY, loaded.tolist(), strict=True)))

    def equilibrium(self, model: Model) -> float:
        """Pitch at which the loaded robot balances [rad]; the paper's theta_lin."""
        loaded = self.on(model)
        return loaded.effects.get(BALANCE, {}).get("theta_eq", 0.0)


def with_lean(model: Model) -> Model:
    """The model with an equilibrium pitch, zero where it had none."""
    return model.with_effects({BALANCE: {"theta_eq": 0.0}, **model.effects})


def loaded_body(body: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Bodies with a point mass fixed to each.

    Args:
        body: Numbers named in `BODY`, shape (4, ...) [kg, m, kg m^2, rad].
        load: Mass, height and side, shape (3, ...) [kg, m, m].

    Returns:
        What `BODY` names, of the bodies with their loads, shape (4, ...); the inertia is about the new centre of mass.
    """
    own, com_height, inertia, lean = body
    mass, height, side = load
    total = own + mass
    up = (own * com_height * np.cos(lean) + mass * height) / total
    across = (own * com_height * np.sin(lean) + mass * side) / total
    about_axis = inertia + own * com_height**2 + mass * (height**2 + side**2)
    squared = up**2 + across**2
    return np.stack([total, np.sqrt(squared), about_axis - total * squared, np.arctan2(across, up)])
