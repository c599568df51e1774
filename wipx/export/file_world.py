"""An exported file whose bodies MuJoCo moves while wipx's laws give the forces: all that MJCF cannot say included.

What the file itself says of the robot's joints and drives is switched off, since the laws have it. Parts may be left
on instead, to see what MuJoCo's way of saying them costs.
"""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from wipx.core.model import Model
from wipx.export.mjcf import ExportedFile, mujoco_module
from wipx.sim.exchange import Exchange
from wipx.sim.mechanism import mechanism
from wipx.sim.mujoco import MujocoWorld
from wipx.sim.stepped import SteppedSimulator, World

LONGEST = 1e-3  # [s] of a step of the laws, as of the other engines


def steps_within(step: float) -> int:
    """Steps of the laws in one of the file [s]."""
    return max(1, int(np.ceil(step / LONGEST - 1e-9)))


@dataclass(frozen=True)
class LeftOn:
    """What MuJoCo does itself.

    Attributes:
        joints: Joints with their own damping, dry friction and springs.
        drives: Joints with their own actuators.
    """

    joints: tuple[str, ...] = ()
    drives: tuple[str, ...] = ()


NOTHING = LeftOn()


@dataclass(frozen=True)
class LawsInFile(SteppedSimulator):
    """Wipx's laws around the bodies of an exported file.

    Attributes:
        file: What MuJoCo moves.
        left_on: What it does itself; the models that are simulated must lack it.
    """

    file: ExportedFile | None = None
    left_on: LeftOn = NOTHING

    @property
    def name(self) -> str:
        """Of the engine."""
        return "mujoco"

    def open(self) -> World:
        """A world of the file."""
        assert self.file is not None
        return FileWorld(mujoco_module(), self.file.model, self.left_on)


class FileWorld(MujocoWorld):
    """The bodies of a file; see `World`.

    A file may hold more than the robot: other bodies, contacts, limits of joints. They stay as they are.
    """

    def __init__(self, mujoco: Any, model: Any, left_on: LeftOn = NOTHING) -> None:
        super().__init__(mujoco, float(model.opt.timestep))
        self.whole, self.left_on = model, left_on

    def load(self, model: Model, exchange: Exchange, lanes: int) -> None:
        """See `World`."""
        super().load(model, exchange, lanes)
        self.exchange = exchange
        armature = np.array([link.armature for link in mechanism(model).tree.links])
        exchange.lanes.rotor[exchange.joints] = (armature - self._armature(model.plant.joints))[:, None]
        self.inputs = [self._input(model, joint) for joint in self.left_on.drives]

    def compiled(self, model: Model) -> Any:
        """The file without what the laws do."""
        return without_laws(self.mujoco, self.whole, model.plant.joints, self.left_on)

    def _armature(self, joints: tuple[str, ...]) -> np.ndarray:
        """What the file gives the joints and what its actuators add to it, shape (joints,)."""
        found = self.model.dof_armature[self.order].astype(float)
        for j, joint in enumerate(joints):
            for i in actuators_of(self.mujoco, self.model, joint):
                found[j] += self.model.actuator_armature[i] * self.model.actuator_gear[i, 0] ** 2
        return found

    def _input(self, model: Model, joint: str) -> tuple[int, int, float]:
        """Number of a joint among the model's, place of its actuator's input, and gain of its command."""
        found = next(
            int(self.model.actuator_ctrladr[i])
            for i in actuators_of(self.mujoco, self.model, joint)
            if self.model.actuator_ctrlnum[i] == 1
        )
        name = "input_gain" if model.plant.tree is None else f"{joint}.gain"
        return model.plant.joints.index(joint), found, model.parameters.get(name, 1.0)

    def advance(self) -> None:
        """See `World`."""
        first = self.exchange.joints.start
        for number, address, gain in self.inputs:
            for lane, x in enumerate(self.lanes):
                x.data.ctrl[address] = self.exchange.lanes.command[first + number, lane] / gain
        super().advance()


def actuators_of(mujoco: Any, model: Any, joint: str) -> list[int]:
    """Numbers of the actuators of a joint."""
    return [
        i
        for i in range(len(model.actuator_trntype))
        if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        and model.joint(int(model.actuator_trnid[i, 0])).name == joint
    ]


def without_laws(mujoco: Any, whole: Any, joints: tuple[str, ...], left_on: LeftOn = NOTHING) -> Any:
    """A copy of a compiled model without damping, dry friction, springs and actuators of some joints.

    Args:
        mujoco: The engine's module.
        whole: The compiled model.
        joints: Of the robot.
        left_on: What stays.
    """
    model = copy.copy(whole)
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST  # steps are taken in two halves
    for joint in joints:
        number, dof = model.joint(joint).id, int(model.joint(joint).dofadr[0])
        if joint not in left_on.joints:
            model.dof_damping[dof], model.dof_dampingpoly[dof] = 0.0, 0.0
            model.dof_frictionloss[dof] = 0.0
            model.jnt_stiffness[number], model.jnt_stiffnesspoly[number] = 0.0, 0.0
        model.jnt_actfrclimited[number] = 0
        for i in actuators_of(mujoco, model, joint):
            passive = model.actuator_ctrlnum[i] == 0
            friction = passive and not model.actuator(i).name.endswith("_ripple")
            if joint in (left_on.joints if friction else left_on.drives):
                continue
            model.actuator_gear[i] = 0.0  # it turns nothing
    return model
