"""Bullet behind the contract of simulators (`sim=pybullet`)."""

import importlib
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.sim.exchange import Exchange
from wipx.sim.mechanism import mechanism
from wipx.sim.stepped import SteppedSimulator, World
from wipx.sim.urdf import urdf

FASTEST = 1e9  # [m/s, rad/s]; Bullet's own bound is 100


@dataclass(frozen=True)
class BulletSimulator(SteppedSimulator):
    """PyBullet without a window, stepped explicitly."""

    @property
    def name(self) -> str:
        """Of the option."""
        return "pybullet"

    def open(self) -> World:
        """A client of its own.

        Raises:
            InputError: PyBullet is not installed.
        """
        try:
            bullet = importlib.import_module("pybullet")
        except ModuleNotFoundError as error:
            raise InputError(
                'sim=pybullet needs PyBullet, which is not installed; pip install "pybullet>=3.2.5" or use sim=analytic'
            ) from error
        return BulletWorld(bullet)


@dataclass(frozen=True)
class _Lane:
    """Views of what is exchanged with one lane, each of shape (joints,), or (joints, joints) of the mass matrix."""

    place: np.ndarray
    speed: np.ndarray
    mass: np.ndarray
    bias: np.ndarray
    gained: np.ndarray
    push: np.ndarray

    @classmethod
    def of(cls, exchange: Exchange, lane: int) -> "_Lane":
        place, speed, bias, gained, push = (
            exchange.joint(name, lane) for name in ("place", "speed", "bias", "gained", "push")
        )
        return cls(place, speed, exchange.mass(lane), bias, gained, push)


class BulletWorld:
    """One client, in which the body of one model is moved; see `World`.

    Lanes take turns: the body is put where a lane stands before each step. Bullet keeps the masses of a body as they
    were when it was loaded, so a payload event has two bodies, one with the payload and one without.
    """

    def __init__(self, bullet: Any) -> None:
        self.bullet = bullet
        self.client: int = bullet.connect(bullet.DIRECT)

    def load(self, model: Model, exchange: Exchange, lanes: int) -> None:
        """See `World`."""
        self.bullet.resetSimulation(physicsClientId=self.client)
        found = mechanism(model)
        links = found.tree.links
        self.bullet.setGravity(*found.tree.gravity.tolist(), physicsClientId=self.client)
        for link, j in zip(links, range(exchange.joints.start, exchange.joints.stop), strict=True):
            exchange.lanes.rotor[j] = link.armature
        self.joints: list[int] = []
        self.order: list[int] = []
        names = [link.joint for link in links]
        self.bare = self._body(urdf(found, model.plant.kind, with_event=False), names)
        with_event = urdf(found, model.plant.kind, with_event=True)
        self.loaded = self.bare if found.coming is None else self._body(with_event, names)
        self.pairs = np.ix_(self.order, self.order)
        self.durations, self.shares = exchange.lanes.duration, exchange.lanes.loaded
        self.lanes = [_Lane.of(exchange, lane) for lane in range(lanes)]
        self.still = [0.0] * len(links)
        self.time_step = 0.0

    def close(self) -> None:
        """See `World`."""
        self.bullet.disconnect(self.client)

    def weigh(self) -> None:
        """See `World`."""
        for lane, x in enumerate(self.lanes):
            if self.durations[lane] > 0.0:
                share = self.shares[lane]
                if share == 0.0 or share == 1.0 or self.loaded == self.bare:
                    mass, bias = self._weighed(self.bare if share == 0.0 else self.loaded, x)
                else:
                    bare, loaded = self._weighed(self.bare, x), self._weighed(self.loaded, x)
                    mass, bias = ((1.0 - share) * a + share * b for a, b in zip(bare, loaded, strict=True))
                x.mass[self.pairs], x.bias[self.order] = mass, bias

    def _weighed(self, body: int, x: _Lane) -> tuple[np.ndarray, np.ndarray]:
        """Mass matrix and bias forces of a body, its joints in Bullet's order."""
        places = x.place[self.order].tolist()
        matrix = self.bullet.calculateMassMatrix(body, places, physicsClientId=self.client)
        return np.array(matrix), np.array(self._forces(body, places, x, self.still))

    def _forces(self, body: int, places: list[float], x: _Lane, accelerations: list[float]) -> tuple[float, ...]:
        """What moves a body with these accelerations."""
        return self.bullet.calculateInverseDynamics(
            body, places, x.speed[self.order].tolist(), accelerations, physicsClientId=self.client
        )

    def advance(self) -> None:
        """See `World`."""
        bullet, client = self.bullet, self.client
        for lane, x in enumerate(self.lanes):
            duration, share = self.durations[lane], self.shares[lane]
            if duration > 0.0:
                if duration != self.time_step:
                    self.time_step = duration
                    bullet.setTimeStep(duration, physicsClientId=client)
                body = self.bare if share == 0.0 else self.loaded
                places, push = x.place[self.order].tolist(), x.push[self.order].tolist()
                if 0.0 < share < 1.0:  # the payload came within the step: its body moves like one with a part of it
                    push = self._forces(body, places, x, x.gained[self.order].tolist())
                for joint, place, speed in zip(self.joints, places, x.speed[self.order].tolist(), strict=True):
                    bullet.resetJointState(body, joint, place, speed, physicsClientId=client)
                bullet.setJointMotorControlArray(
                    body, self.joints, bullet.TORQUE_CONTROL, forces=push, physicsClientId=client
                )
                bullet.stepSimulation(physicsClientId=client)
                states = bullet.getJointStates(body, self.joints, physicsClientId=client)
                x.place[self.order] = [state[0] for state in states]
                x.speed[self.order] = [state[1] for state in states]

    def _body(self, text: str, names: list[str]) -> int:
        """Load a body with joints of these names.

        Bullet's own damping and motors are off, since friction is the laws' business.
        """
        bullet, client = self.bullet, self.client
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "body.urdf")
            path.write_text(text, encoding="utf-8")
            flags = bullet.URDF_USE_INERTIA_FROM_FILE
            body = bullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)
        undamped = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0, "maxJointVelocity": FASTEST}
        joints = range(bullet.getNumJoints(body, physicsClientId=client))
        for joint in joints:
            bullet.changeDynamics(body, joint, **undamped, physicsClientId=client)
        known = {joint: bullet.getJointInfo(body, joint, physicsClientId=client) for joint in joints}
        self.joints = [joint for joint in joints if known[joint][2] != bullet.JOINT_FIXED]
        self.order = [names.index(known[joint][1].decode("utf-8")) for joint in self.joints]
        for joint in self.joints:
            bullet.setJointMotorControl2(body, joint, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        return body
