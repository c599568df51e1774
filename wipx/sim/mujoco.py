"""MuJoCo behind the contract of simulators (`sim=mujoco`)."""

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.sim import mujoco_batch
from wipx.sim.exchange import Exchange
from wipx.sim.inputs import Inputs
from wipx.sim.mechanism import EVENT, check_possible
from wipx.sim.mjcf import mjcf
from wipx.sim.simulator import Path, Rollouts
from wipx.sim.stepped import ANALYTIC, SteppedSimulator, World, single


@dataclass(frozen=True)
class MujocoSimulator(SteppedSimulator):
    """MuJoCo, stepped explicitly."""

    @property
    def name(self) -> str:
        """Of the option."""
        return "mujoco"

    def open(self) -> World:
        """Room for a model.

        Raises:
            InputError: MuJoCo is not installed.
        """
        return MujocoWorld(engine(), self.step)

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """Open loop, in MuJoCo's own batches where they serve; see `Simulator.replay`."""
        if path is not None or not mujoco_batch.serves(batch, inputs, initial, self.step):
            return super().replay(batch, inputs, initial, path)
        for p in range(batch.size):
            check_possible(single(batch, p), f"sim={self.name}", ANALYTIC)
        return mujoco_batch.replay(engine(), batch, inputs, initial, self.step)


def engine() -> Any:
    """MuJoCo's module.

    Raises:
        InputError: it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ModuleNotFoundError as error:
        raise InputError(
            'sim=mujoco needs MuJoCo, which is not installed; pip install "mujoco>=4.0,<5" or use sim=analytic'
        ) from error


@dataclass(frozen=True)
class _Lane:
    """Views of one lane: MuJoCo's data and what is exchanged with the laws."""

    data: Any
    qpos: np.ndarray
    qvel: np.ndarray
    bias: np.ndarray
    applied: np.ndarray
    place: np.ndarray
    speed: np.ndarray
    mass: np.ndarray
    held: np.ndarray
    push: np.ndarray

    @classmethod
    def of(cls, data: Any, exchange: Exchange, lane: int) -> "_Lane":
        return cls(
            data,
            data.qpos,
            data.qvel,
            data.qfrc_bias,
            data.qfrc_applied,
            exchange.joint("place", lane),
            exchange.joint("speed", lane),
            exchange.mass(lane),
            exchange.joint("bias", lane),
            exchange.joint("push", lane),
        )


class MujocoWorld:
    """One compiled model and a state for each lane; see `World`."""

    def __init__(self, mujoco: Any, step: float) -> None:
        self.mujoco = mujoco
        self.step = step

    def load(self, model: Model, exchange: Exchange, lanes: int) -> None:
        """See `World`."""
        self.model = self.compiled(model)
        self.durations, self.loaded = exchange.lanes.duration, exchange.lanes.loaded
        order = [int(self.model.joint(name).dofadr[0]) for name in model.plant.joints]
        self.order, self.pairs = np.array(order), np.ix_(order, order)
        self.places = np.array([int(self.model.joint(name).qposadr[0]) for name in model.plant.joints])
        self.lanes = [_Lane.of(self.mujoco.MjData(self.model), exchange, lane) for lane in range(lanes)]
        self.mass = np.zeros((self.model.nv, self.model.nv))
        self.time_step = self.step
        self.payload = model.effects[f"geometry/{EVENT}"]["mass"] if f"geometry/{EVENT}" in model.effects else None

    def compiled(self, model: Model) -> Any:
        """MuJoCo's model of the rigid body."""
        return self.mujoco.MjModel.from_xml_string(mjcf(model, self.step))

    def close(self) -> None:
        """See `World`."""
        self.lanes = []

    def weigh(self) -> None:
        """See `World`."""
        step1, full_mass, order = self.mujoco.mj_step1, self.mujoco.mj_fullM, self.order
        for lane, x in enumerate(self.lanes):
            if self.durations[lane] > 0.0:
                if self.payload is not None:
                    # What MuJoCo derives from masses beforehand is for constraints, of which there are none.
                    self.model.body(EVENT).mass[0] = self.loaded[lane] * self.payload
                x.qpos[self.places] = x.place
                x.qvel[order] = x.speed
                step1(self.model, x.data)
                full_mass(self.model, x.data, self.mass)
                x.mass[:] = self.mass[self.pairs]
                x.held[:] = x.bias[order]

    def advance(self) -> None:
        """See `World`."""
        step2, order = self.mujoco.mj_step2, self.order
        for lane, x in enumerate(self.lanes):
            duration = self.durations[lane]
            if duration > 0.0:
                if duration != self.time_step:
                    self.time_step = duration
                    self.model.opt.timestep = duration
                x.applied[order] = x.push
                step2(self.model, x.data)
                x.place[:] = x.qpos[self.places]
                x.speed[:] = x.qvel[order]
