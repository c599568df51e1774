"""An exported file replayed in MuJoCo as any user would step it: its own integrator, actuators and sensors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wipx.core.model import ModelBatch
from wipx.export.mjcf import ExportedFile, mujoco_module
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Path, Rollouts


@dataclass(frozen=True)
class FileSimulator(AnalyticSimulator):
    """A simulator of one robot; every model of a batch is taken for the same.

    Attributes:
        file: What MuJoCo steps.
    """

    file: ExportedFile | None = None

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """Open loop: the recorded commands are the inputs of the file's actuators; see `Simulator.replay`."""
        assert self.file is not None
        plant = batch.model.plant
        joints = len(plant.joints)
        starts = np.broadcast_to(initial, (2 * joints, batch.size, inputs.windows))
        coordinates = np.full((len(inputs.t), joints, batch.size, inputs.windows), np.nan)
        rates = np.full_like(coordinates, np.nan)
        robot = _Robot(self.file, plant.joints, plant.coordinates, plant.actuated)
        for p in range(batch.size):
            for r in range(inputs.windows):
                led = None if path is None else path.states[:, :, min(p, path.states.shape[2] - 1), r]
                until = -1 if path is None else int(path.until[r])
                robot.run(inputs, r, starts[:, p, r], led, until, coordinates[:, :, p, r], rates[:, :, p, r])
        return Rollouts(coordinates, rates, inputs.commands[:, :, None, :])


class _Robot:
    """The compiled file, and where its joints, inputs and sensors are."""

    def __init__(
        self, file: ExportedFile, joints: tuple[str, ...], columns: tuple[str, ...], actuated: tuple[str, ...]
    ) -> None:
        self.mujoco: Any = mujoco_module()
        self.model, self.step = file.model, file.step
        self.data = self.mujoco.MjData(self.model)
        self.joints = np.array([int(self.model.joint(name).dofadr[0]) for name in joints])
        self.places = np.array([int(self.model.joint(name).qposadr[0]) for name in joints])
        self.inputs = [self._input(name) for name in actuated]
        self.sensors = [self._sensor(name) for name in joints]

    def _input(self, joint: str) -> tuple[int, int]:
        """Actuator of a joint and place of its input."""
        model = self.model
        for i in range(len(model.actuator_trntype)):
            name = model.joint(int(model.actuator_trnid[i, 0])).name
            in_joint = model.actuator_trntype[i] == self.mujoco.mjtTrn.mjTRN_JOINT
            if in_joint and name == joint and model.actuator_ctrlnum[i] == 1:
                return i, int(model.actuator_ctrladr[i])
        raise ValueError(f"no actuator of joint {joint}")

    def _sensor(self, joint: str) -> int | None:
        """Place of the reading of a joint's coordinate; None where the file has no such sensor."""
        kind, model = self.mujoco.mjtSensor.mjSENS_JOINTPOS, self.model
        for i in range(model.nsensor):
            if model.sensor_type[i] == kind and model.joint(int(model.sensor_objid[i])).name == joint:
                return int(model.sensor_adr[i])
        return None

    def run(
        self,
        inputs: Inputs,
        r: int,
        start: np.ndarray,
        led: np.ndarray | None,
        until: int,
        shown: np.ndarray,
        rates: np.ndarray,
    ) -> None:
        """Replay window r and write what the sensors show (rows, joints) and the rates."""
        mujoco, model, data = self.mujoco, self.model, self.data
        t, first, last = inputs.t[:, r], int(inputs.first[r]), int(inputs.last[r])
        mujoco.mj_resetData(model, data)
        self._put(start)
        data.time = t[first]
        self._remember(t, inputs.commands[:, :, r], first)
        count = len(self.joints)
        shown[: first + 1], rates[: first + 1] = start[:count], start[count:]
        for k in range(first, last + 1):
            if led is not None and k <= until and k < len(led):
                self._put(led[k])
            mujoco.mj_forward(model, data)
            shown[k], rates[k] = self._shown(), data.qvel[self.joints]
            if k == last:
                break
            steps = max(1, int(np.ceil((t[k + 1] - t[k]) / self.step - 1e-9)))
            model.opt.timestep = (t[k + 1] - t[k]) / steps
            self._advance(inputs.commands[k, :, r], None if inputs.ramps is None else inputs.ramps[k, :, r], steps)

    def _advance(self, command: np.ndarray, ramp: np.ndarray | None, steps: int) -> None:
        """The steps of one row; a command that is a mean changes along it."""
        addresses = [address for _, address in self.inputs]
        if ramp is None:
            self.data.ctrl[addresses] = command
            self.mujoco.mj_step(self.model, self.data, steps)
            return
        for s in range(steps):
            self.data.ctrl[addresses] = command + ramp * ((s + 0.5) / steps - 0.5)
            self.mujoco.mj_step(self.model, self.data)

    def _put(self, state: np.ndarray) -> None:
        count = len(self.joints)
        self.data.qpos[self.places], self.data.qvel[self.joints] = state[:count], state[count:]

    def _remember(self, t: np.ndarray, commands: np.ndarray, first: int) -> None:
        """Fill the memories of late inputs with the rows before the first, those of late sensors at a steady rate."""
        for i, (actuator, _) in enumerate(self.inputs):
            samples = int(self.model.actuator_history[actuator, 0])
            if samples:
                times = t[first] - self.step * np.arange(samples, 0, -1.0)
                rows = np.clip(np.searchsorted(t, times + 1e-9, side="right") - 1, 0, max(first, 0))
                values = np.ascontiguousarray(commands[rows, i][:, None])
                self.mujoco.mj_initCtrlHistory(self.model, self.data, actuator, times[:, None], values)
        for place, joint, sensor in zip(self.places, self.joints, self.sensors, strict=True):
            if sensor is None:
                continue
            number = int(np.flatnonzero(self.model.sensor_adr == sensor)[0])
            samples = int(self.model.sensor_history[number, 0])
            if samples:
                times = t[first] - self.step * np.arange(samples, 0, -1.0)
                values = (self.data.qpos[place] + self.data.qvel[joint] * (times - t[first]))[:, None]
                self.mujoco.mj_initSensorHistory(self.model, self.data, number, times[:, None], values, 0.0)

    def _shown(self) -> np.ndarray:
        true = self.data.qpos[self.places]
        return np.array([q if i is None else self.data.sensordata[i] for q, i in zip(true, self.sensors, strict=True)])
