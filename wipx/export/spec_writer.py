"""Writes what MuJoCo can say of a completed model into its specification of a robot (`MjSpec`)."""

from math import pi
from typing import Any

import numpy as np

from wipx.core.export_result import Statement, approximated, exact, lost
from wipx.core.model import Model
from wipx.export.drive_terms import DriveTerms, clamped, drive_terms, finite
from wipx.export.joint_terms import Bristle, JointTerms, joint_terms
from wipx.recordings.robot_model import read_drives
from wipx.sim.mechanism import EVENT, Mechanism

STIFF = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # impedance of dry friction that sticks
NO_LOAD = 1e-9  # [kg] of a payload that has not come
FORCE, POSITION, NOTHING = 4, 1, 16  # inputs of a dcmotor: `ff`, `pos`, `none`
ROUNDED = 1e-5  # relative; a written file has six digits


class SpecWriter:
    """Writes the terms of a model into a specification.

    Attributes:
        model: The completed model.
    """

    def __init__(self, mujoco: Any, model: Model, found: Mechanism, spec: Any, *, own: bool) -> None:
        """A writer.

        Args:
            mujoco: The engine's module.
            model: The completed model.
            found: Its links.
            spec: That has the model's bodies; it is changed.
            own: Whether it is the owner's file, of which only what the model changes may be changed.
        """
        self.mujoco, self.model, self.found, self.spec, self.own = mujoco, model, found, spec, own
        self.step = float(spec.option.timestep)
        self.links = {link.joint: link for link in found.tree.links}

    def write(self) -> tuple[Statement, ...]:
        """Write all of it; what became of every effect, in the order of the model."""
        if not self.own:
            self.spec.option.integrator = self.mujoco.mjtIntegrator.mjINT_IMPLICITFAST
            self._round_inertias()
        inertias = self._inertias()
        said: dict[str, Statement] = {}
        for joint in self.model.plant.joints:
            terms = joint_terms(self.model, joint, inertias[joint], self.step)
            self._joint(joint, terms)
            said |= {statement.effect: statement for statement in terms.statements}
        for command in self.model.plant.commands:
            drive = drive_terms(self.model, command, self.step)
            self.drive(drive)
            said |= {statement.effect: statement for statement in drive.statements}
        said |= {statement.effect: statement for statement in (*self._sensors(), *self._bodies())}
        order = {name: i for i, name in enumerate(self.model.effects)}
        return tuple(sorted(said.values(), key=lambda statement: order.get(statement.effect, len(order))))

    def _round_inertias(self) -> None:
        """Keep the largest moment below the sum of the others when six digits are left of them."""
        for body in self.spec.bodies[1:]:
            moments = np.array(body.inertia)
            most = int(np.argmax(moments))
            moments[most] = min(moments[most], (1.0 - ROUNDED) * (moments.sum() - moments[most]))
            body.inertia = moments
        if self.found.coming is not None:
            self.spec.body(EVENT).mass = NO_LOAD

    def _inertias(self) -> dict[str, float]:
        """Inertia that a force on each joint meets, all joints at their places of reference."""
        compiled = self.spec.compile()
        data = self.mujoco.MjData(compiled)
        self.mujoco.mj_forward(compiled, data)
        matrix = np.zeros((compiled.nv, compiled.nv))
        self.mujoco.mj_fullM(compiled, data, matrix)
        lightness = np.diag(np.linalg.inv(matrix))
        return {name: 1.0 / float(lightness[compiled.joint(name).dofadr[0]]) for name in self.links}

    def _joint(self, name: str, terms: JointTerms) -> None:
        joint, link = self.spec.joint(name), self.links[name]
        file = None if self.model.plant.tree is None else self.model.plant.tree.links[self._number(name)]
        if not self.own or file is None:
            joint.armature, joint.damping = link.armature, [*terms.damping, 0.0]
        else:  # actuators of the file may have a part in both
            joint.armature += link.armature - file.armature
            joint.damping = [joint.damping[0] + terms.damping[0] - file.damping, terms.damping[1], 0.0]
        if not self.own or file is None or terms.friction != file.friction:
            joint.frictionloss = terms.friction
            joint.solref_friction, joint.solimp_friction = [2.0 * self.step, 1.0], list(STIFF)
        if terms.stiffness:
            joint.stiffness = [terms.stiffness, 0.0, 0.0]
            joint.springref = terms.rest * (180.0 / pi if self.spec.compiler.degree and not link.slides else 1.0)
        if link.effort is not None and not self.own:
            joint.actfrcrange = [-link.effort, link.effort]
        if terms.bristle is not None:
            self._passive(f"{name}_friction", name, lugre=_lugre(terms.bristle))
        if terms.constant:
            self._constant(name, terms.constant)

    def _number(self, joint: str) -> int:
        return self.model.plant.joints.index(joint)

    def _passive(self, name: str, joint: str, gear: float = 1.0, **terms: list[float]) -> None:
        """An actuator without input."""
        actuator = self._added(name, joint)
        actuator.gear = [gear, 0.0, 0.0, 0.0, 0.0, 0.0]
        actuator.set_to_dcmotor(motorconst=[0.0, 0.0], resistance=1.0, ctrlspec=NOTHING, **terms)

    def _constant(self, joint: str, force: float) -> None:
        """A force that acts at all times: cogging without poles."""
        self._passive(f"{joint}_offset", joint, cogging=[force, 0.0, 0.5 * pi])

    def _added(self, name: str, joint: str) -> Any:
        actuator = self.spec.add_actuator(name=name, target=joint)
        actuator.trntype = self.mujoco.mjtTrn.mjTRN_JOINT
        return actuator

    def drive(self, terms: DriveTerms) -> None:
        """Write the drive of a joint."""
        actuator = self._of_joint(terms.joint)
        if actuator is not None and self._is_as_in_file(terms):
            return
        if actuator is None:
            actuator = self._added(terms.command, terms.joint)
        gear = float(actuator.gear[0])
        if terms.is_motor:
            self._motor(actuator, terms)
        else:
            self._plain(actuator, terms)
        same = (gear / float(actuator.gear[0])) ** 2  # what the actuator adds to its joint stays
        actuator.armature, actuator.damping = actuator.armature * same, [actuator.damping[0] * same, 0.0, 0.0]
        if clamped(terms.inputs):
            actuator.ctrlrange, actuator.ctrllimited = finite(terms.inputs), True
        if terms.damping:
            more = terms.damping / float(actuator.gear[0]) ** 2
            actuator.damping = [actuator.damping[0] + more, 0.0, 0.0]
        if terms.delay:
            actuator.delay, actuator.nsample = terms.delay, int(np.ceil(terms.delay / self.step - 1e-9)) + 1
            actuator.interp = 1  # linear: what a command that is held over a step amounts to when it is late
        if terms.ripple is not None:
            wave = [terms.ripple.amplitude / terms.ripple.periods, 1.0, terms.ripple.phase + 0.5 * pi]
            self._passive(f"{terms.joint}_ripple", terms.joint, terms.ripple.periods, cogging=wave)

    def _of_joint(self, joint: str) -> Any:
        """The actuator that a joint has; None where it has none."""
        in_joint = self.mujoco.mjtTrn.mjTRN_JOINT
        for actuator in self.spec.actuators:
            if actuator.trntype == in_joint and actuator.target == joint and actuator.ctrlspec != NOTHING:
                return actuator
        return None

    def _is_as_in_file(self, terms: DriveTerms) -> bool:
        """Whether the owner's file already says all of a drive."""
        tree = self.model.plant.tree
        if not self.own or terms.statements or tree is None or tree.source is None:
            return False
        file = read_drives(tree.source.path, tree.source.locked).get(terms.joint)
        own, parameters = self.model.plant.drives[terms.joint], self.model.parameters
        if file is None or file.kind != own.kind or file.limit != own.limit:
            return False
        if own.kind == "position":
            return (file.kp, file.kd) == (parameters[f"{terms.joint}.kp"], parameters[f"{terms.joint}.kd"])
        return file.gain == parameters[f"{terms.joint}.gain"]

    def _plain(self, actuator: Any, terms: DriveTerms) -> None:
        mujoco = self.mujoco
        actuator.set_to_motor()
        actuator.gear = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        if terms.servo is not None:
            stiffness, damping = terms.servo
            actuator.gainprm[0], actuator.biasprm[:3] = stiffness, (terms.offset, -stiffness, -damping)
        else:
            actuator.gainprm[0], actuator.biasprm[0] = terms.gain, terms.offset
        if terms.lag:
            actuator.dyntype, actuator.dynprm[0] = mujoco.mjtDyn.mjDYN_FILTEREXACT, terms.lag
        actuator.forcelimited = clamped(terms.forces)
        if clamped(terms.forces):
            actuator.forcerange = finite(terms.forces)

    def _motor(self, actuator: Any, terms: DriveTerms) -> None:
        """A `dcmotor` whose constants make its voltage a torque."""
        gear = terms.gain if terms.servo is None else 1.0
        size = abs(gear)
        resistance, voltage = 1.0, 0.0
        if terms.line is not None:
            voltage = terms.line.free * size  # of the input's side; the motor's constant is one
            resistance = voltage / (terms.line.stall / size)
        controller = [0.0, 0.0, 0.0, 0.0, 0.0, voltage]
        if terms.servo is not None:
            controller[0], controller[2] = terms.servo
        actuator.gear = [gear, 0.0, 0.0, 0.0, 0.0, 0.0]
        actuator.set_to_dcmotor(
            motorconst=[1.0, 1.0],
            resistance=resistance,
            inductance=[0.0, terms.lag],
            controller=controller,
            ctrlspec=POSITION if terms.servo is not None else FORCE,
        )
        actuator.forcelimited = clamped(terms.forces)
        if clamped(terms.forces):
            low, high = sorted(end / gear for end in finite(terms.forces))
            actuator.forcerange = [low, high]
        if terms.offset:
            self._constant(terms.joint, terms.offset)

    def _sensors(self) -> list[Statement]:
        """Sensors of the joints' coordinates; MuJoCo's have delays, but neither errors of scale nor of zero."""
        said: list[Statement] = []
        for joint, column in self.model.plant.columns.items():
            site = f"sensor_{column}"
            late = self.model.effects.get(f"{site}/delay")
            if not self.own or late is not None:
                sensor = self._sensor(joint, column)
                if late is not None:
                    said.append(self._late(sensor, f"{site}/delay", late["tau"]))
            said += [
                lost(name, "sensors in MJCF have no such error")
                for name in self.model.effects
                if name.startswith(f"{site}/") and not name.endswith("/delay")
            ]
        return said

    def _sensor(self, joint: str, column: str) -> Any:
        kind = self.mujoco.mjtSensor.mjSENS_JOINTPOS
        for sensor in self.spec.sensors:
            if sensor.type == kind and sensor.objname == joint:
                return sensor
        return self.spec.add_sensor(name=column, type=kind, objtype=self.mujoco.mjtObj.mjOBJ_JOINT, objname=joint)

    def _late(self, sensor: Any, name: str, delay: float) -> Statement:
        if delay < self.step:
            return approximated(name, "no delay, as it is shorter than a step")
        sensor.delay, sensor.nsample, sensor.interp = delay, int(np.ceil(delay / self.step - 1e-9)) + 2, 2
        return exact(name, "delay of the sensor")

    def _bodies(self) -> list[Statement]:
        """Effects of masses and gravity, which are in the bodies already."""
        said = []
        for name in self.model.effects:
            site, _, kind = name.partition("/")
            if kind == EVENT:
                said.append(lost(name, f"a mass that comes; set that of body {EVENT} when it does"))
            elif site == "geometry" or site.startswith("link_"):
                said.append(exact(name, "mass, centre and inertia of the body"))
            elif name == "environment/base_tilt":
                said.append(exact(name, "direction of gravity"))
            elif name == "environment/rail_tilt":
                said.append(exact(name, "axis of the joint"))
        return said


def _lugre(bristle: Bristle) -> list[float]:
    return [bristle.stiffness, bristle.damping, bristle.sliding, bristle.peak, bristle.speed]
