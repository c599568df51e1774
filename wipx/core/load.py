"""A known weight on the body, beside its axis too: how it changes the rigid body and its equilibrium."""

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, sin

from wipx.core.errors import InputError
from wipx.core.model import Model

BALANCE = "geometry/com_offset"


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
        p = model.parameters
        if "com_height" not in p or "wheel_mass" not in p:
            raise InputError(f"load: a {model.plant.kind} has no body that could carry one; leave the load out")
        if self.mass == 0.0:
            return model
        mass = p["body_mass"] + self.mass
        lean = model.effects.get(BALANCE, {}).get("theta_eq", 0.0)  # of the body without the load
        up = (p["body_mass"] * p["com_height"] * cos(lean) + self.mass * self.height) / mass
        across = (p["body_mass"] * p["com_height"] * sin(lean) + self.mass * self.side) / mass
        about_axis = (
            p["body_inertia"] + p["body_mass"] * p["com_height"] ** 2 + self.mass * (self.height**2 + self.side**2)
        )
        com = hypot(up, across)
        body = {**p, "body_mass": mass, "com_height": com, "body_inertia": about_axis - mass * com**2}
        loaded = replace(model, parameters=body)
        return loaded.with_effects({BALANCE: {"theta_eq": atan2(across, up)}}) if across or lean else loaded

    def equilibrium(self, model: Model) -> float:
        """Pitch at which the loaded robot balances [rad]; the paper's theta_lin."""
        loaded = self.on(model)
        return loaded.effects.get(BALANCE, {}).get("theta_eq", 0.0)
