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
from wipx.sim.mechanism import EVENT, mechanism
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
        self.bullet.setGravity(0.0, 0.0, -model.parameters["gravity"], physicsClientId=self.client)
        links = mechanism(model)
        for link, j in zip(links, range(exchange.joints.start, exchange.joints.stop), strict=True):
            exchange.lanes.rotor[j] = link.rotor
        self.joints: list[int] = []
        self.bare = self._body(urdf(model, with_event=False))
        self.loaded = self._body(urdf(model, with_event=True)) if f"geometry/{EVENT}" in model.effects else self.bare
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
                    x.mass[:], x.bias[:] = self._weighed(self.bare if share == 0.0 else self.loaded, x)
                else:
                    bare, loaded = self._weighed(self.bare, x), self._weighed(self.loaded, x)
                    x.mass[:] = (1.0 - share) * np.array(bare[0]) + share * np.array(loaded[0])
                    x.bias[:] = (1.0 - share) * np.array(bare[1]) + share * np.array(loaded[1])

    def _weighed(self, body: int, x: _Lane) -> tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]:
        """Mass matrix and bias forces of a body."""
        places = x.place.tolist()
        matrix = self.bullet.calculateMassMatrix(body, places, physicsClientId=self.client)
        return matrix, self._forces(body, places, x, self.still)

    def _forces(self, body: int, places: list[float], x: _Lane, accelerations: list[float]) -> tuple[float, ...]:
        """What moves a body with these accelerations."""
        return self.bullet.calculateInverseDynamics(
            body, places, x.speed.tolist(), accelerations, physicsClientId=self.client
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
                places, push = x.place.tolist(), x.push.tolist()
                if 0.0 < share < 1.0:  # the payload came within the step: its body moves like one with a part of it
                    push = self._forces(body, places, x, x.gained.tolist())
                for joint, place, speed in zip(self.joints, places, x.speed.tolist(), strict=True):
                    bullet.resetJointState(body, joint, place, speed, physicsClientId=client)
                bullet.setJointMotorControlArray(
                    body, self.joints, bullet.TORQUE_CONTROL, forces=push, physicsClientId=client
                )
                bullet.stepSimulation(physicsClientId=client)
                states = bullet.getJointStates(body, self.joints, physicsClientId=client)
                x.place[:] = [state[0] for state in states]
                x.speed[:] = [state[1] for state in states]

    def _body(self, text: str) -> int:
        """Load a body; Bullet's own damping and motors are off, since friction is the laws' business."""
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
        types = {joint: bullet.getJointInfo(body, joint, physicsClientId=client)[2] for joint in joints}
        self.joints = [joint for joint in joints if types[joint] != bullet.JOINT_FIXED]
        for joint in self.joints:
            bullet.setJointMotorControl2(body, joint, bullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        return body
