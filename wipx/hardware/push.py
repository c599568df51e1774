"""What a blow to the body of a wheeled inverted pendulum does to its speeds."""

from math import cos

import numpy as np

from wipx.core.errors import InputError
from wipx.core.load import BALANCE
from wipx.core.model import Model
from wipx.hardware.target import Push


def pushed(model: Model, state: np.ndarray, push: Push) -> np.ndarray:
    """Coordinates and rates right after a push, shape (2 joints,).

    The impulse J at a height h along the body moves the point x - h sin(theta), so that the generalised impulses are
    J and -J h cos(theta); the mass matrix of contract section 2 turns them into changes of the rates.

    Args:
        model: The robot with its load.
        state: Coordinates, then rates, before the push, shape (2 joints,).
        push: Impulse and height; its time is ignored.

    Raises:
        InputError: the plant has no body on a carriage.
    """
    p = model.parameters
    if "com_height" not in p or "wheel_mass" not in p:
        raise InputError(f"push: a {model.plant.kind} has no body on a carriage that could be pushed; leave it out")
    x, theta, x_dot, theta_dot = state
    balance = model.effects.get(BALANCE, {}).get("theta_eq", 0.0)
    mass = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    coupling = p["body_mass"] * p["com_height"] * cos(theta - balance)
    inertia = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    impulses = push.impulse * np.array([1.0, -push.height * cos(theta)])
    gained = np.linalg.solve([[mass, -coupling], [-coupling, inertia]], impulses)
    return np.array([x, theta, x_dot + gained[0], theta_dot + gained[1]])
