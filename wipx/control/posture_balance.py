"""Where a robot from a model file balances: positions and drive commands at which nothing accelerates.

Positions of the driven joints are chosen; those of joints without a drive follow from the statics of the tree, as does
what the drives must give. For a robot on wheels this says: the centre of mass is above the wheel axis.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model
from wipx.sim.tree.inverse import forces_of

LEFT_OVER = 1e-8  # [N m or N] of the forces on joints without a drive


@dataclass(frozen=True)
class Balance:
    """An equilibrium of a tree.

    Attributes:
        positions: Of all joints, shape (N,) [rad or m].
        commands: Of the drives, shape (inputs,).
    """

    positions: np.ndarray
    commands: np.ndarray


def balance(model: Model, held: Mapping[str, float]) -> Balance:
    """The equilibrium of a robot that holds a posture.

    Args:
        model: The robot; effects at its links and at its base count, dry friction and springs do not.
        held: Positions of driven joints [rad or m]; those that are left out are zero.

    Raises:
        InputError: it is no tree of torque drives, `held` names a joint without a drive, or there is no equilibrium.
    """
    from scipy.optimize import root

    plant = model.plant
    check_torque_drives(model)
    for joint in held:
        if joint not in plant.actuated:
            raise unknown_name("driven joint", joint, plant.actuated, "posture")
    positions = np.array([held.get(joint, 0.0) for joint in plant.joints])
    free = [i for i, joint in enumerate(plant.joints) if joint not in plant.actuated]
    driven = [plant.joints.index(joint) for joint in plant.actuated]

    def forces(angles: np.ndarray) -> np.ndarray:
        at = positions.copy()
        at[free] = angles
        return forces_of(model, at[None], np.zeros((1, len(at))), np.zeros((1, len(at))))[0]

    if free:
        found = root(lambda angles: forces(angles)[free], np.zeros(len(free)), tol=1e-13)
        if np.abs(forces(found.x)[free]).max() > LEFT_OVER:
            names = ", ".join(plant.joints[i] for i in free)
            raise InputError(
                f"posture: the robot balances nowhere with it, whatever {names} is; choose another posture"
            )
        positions[free] = found.x
    gains = np.array([model.parameters[f"{joint}.gain"] for joint in plant.actuated])
    return Balance(positions, forces(positions[free])[driven] / gains)


def check_torque_drives(model: Model) -> None:
    """Refuse plants that are no trees, and drives that take targets.

    Raises:
        InputError: with what was expected.
    """
    plant = model.plant
    if plant.tree is None:
        raise InputError(f"posture: it needs a robot from a model file (plant: robot), got a {plant.kind}")
    servos = [joint for joint in plant.actuated if plant.drives[joint].kind != "torque"]
    if servos:
        raise InputError(f"robot.yaml: drives of {', '.join(servos)} take positions, expected kind: torque or none")
