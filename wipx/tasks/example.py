"""`task=example`: an example robot with emulated recordings, to try every other task on.

The robots are in `wipx/robots`: a model file written from public numbers, robot.yaml, and emulated.yaml, which says how
the emulated robot moves and what physics it has that its model lacks.
"""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from wipx.control.whole_body import WholeBodyLoop, WholeBodyLqr
from wipx.core.drive import Drive
from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.recordings.robot_file import read_robot
from wipx.recordings.source import ROBOT_FILE
from wipx.recordings.strict_yaml import load_mapping
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator
from wipx.tasks.files.results import write_csv, written_together
from wipx.tasks.shared.emulated_tree import SECRET, emulated_tree, example_folder
from wipx.tasks.shared.job import Job

FREQUENCIES = (0.15, 0.35, 0.6)  # [Hz] of the three sines, each times 0.8 to 1.2
RISE = 2.0  # [s] over which the sines of a robot that balances grow from zero


@dataclass(frozen=True)
class ExampleRobot:
    """Write an example robot and record it.

    Attributes:
        robot: Its name.
        path: Folder that takes it.
        runs: Number of recordings.
        duration: Of each [s].
    """

    robot: str
    path: str
    runs: int = 2
    duration: float = 10.0

    def run(self, job: Job) -> None:
        """Write the model file, robot.yaml and recordings."""
        check_positive(runs=self.runs, duration=self.duration)
        home = example_folder(self.robot)
        folder = Path(self.path).expanduser()
        if (folder / ROBOT_FILE).exists():
            raise InputError(f"{folder / ROBOT_FILE} is there already; give another task.path")
        rng = np.random.default_rng(job.seed)
        with written_together(folder) as draft:
            for path in home.iterdir():
                if path.name != SECRET:
                    shutil.copyfile(path, draft / path.name)
            nominal = read_robot(draft / ROBOT_FILE).model
            said = load_mapping(home / SECRET)
            for k in range(self.runs):
                write_csv(draft / f"r{k + 1}.csv", self._recorded(nominal, said, job.part("sim"), rng))
        print(f"written: {folder}\nnext: python -m wipx task=diagnose recordings.path={self.path}")

    def _recorded(
        self, nominal: Model, said: Mapping[str, object], simulator: Simulator, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Columns of one run: the emulated robot follows sines under position control, or while it balances."""
        if "posture" in said:
            return self._balanced(said, simulator, rng)
        joints = nominal.plant.joints
        emulated = _emulated(nominal, said)
        rate, noise = cast(float, said["rate"]), cast(Mapping[str, float], said["noise"])
        t = np.arange(round(self.duration * rate)) / rate
        target = _sines(t, _each(said["middle"], joints), _each(said["reach"], joints), rng)
        first = np.concatenate([target[0], np.zeros(len(joints))])[:, None, None]
        run = simulator.replay(ModelBatch(emulated), Inputs.of([t], [target], [0]), first)
        q, v = run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0]
        columns = {"t": t}
        for j, joint in enumerate(joints):
            columns[joint] = q[:, j] + noise["position"] * rng.normal(size=len(t))
            drive = emulated.plant.drives[joint]
            if nominal.plant.drives[joint].kind == "position":
                columns[f"u_{joint}"] = target[:, j]
            else:
                force = drive.kp * (target[:, j] - q[:, j]) - drive.kd * v[:, j]
                columns[f"u_{joint}"] = force + noise["force"] * rng.normal(size=len(t))
        return columns

    def _balanced(
        self, said: Mapping[str, object], simulator: Simulator, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Columns of one run of a robot that balances by the regulator of its whole body."""
        robot = emulated_tree(self.robot)
        loop = WholeBodyLoop(WholeBodyLqr(rate=cast(float, said["rate"])), robot.nominal, robot.posture)
        t = np.arange(round(self.duration * loop.rate)) / loop.rate
        joints, reach = robot.nominal.plant.joints, cast(Mapping[str, float], said["reach"])
        sines = _sines(t, np.zeros(len(joints)), np.array([reach.get(joint, 0.0) for joint in joints]), rng)
        rising = np.minimum(t / RISE, 1.0)[:, None] * sines
        reference = np.hstack([rising, np.gradient(rising, 1.0 / loop.rate, axis=0)])
        return robot.driven(robot.emulated, loop, reference, simulator, rng)


def _emulated(nominal: Model, said: Mapping[str, object]) -> Model:
    """The robot with its position control, and with the physics that its model lacks."""
    assert nominal.plant.tree is not None
    stiffness, damping = (cast(Mapping[str, float], said[key]) for key in ("stiffness", "damping"))
    drives = dict(nominal.plant.drives)
    for joint, kp in stiffness.items():
        drives[joint] = Drive("position", kp=kp, kd=damping[joint])
    plant = robot_plant(nominal.plant.tree, drives)
    effects = {str(name): dict(values) for name, values in cast(Mapping[str, Any], said["hidden"]).items()}
    return Model(plant, plant.complete({}, SECRET), effects)


def _each(values: object, joints: tuple[str, ...]) -> np.ndarray:
    return np.array([cast(Mapping[str, float], values)[joint] for joint in joints])


def _sines(t: np.ndarray, middle: np.ndarray, reach: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Targets of all joints, shape (rows, joints): sums of three sines about the middle, within the reach."""
    share = np.array([1.0, 0.5, 1.0 / 3.0]) / (1.0 + 0.5 + 1.0 / 3.0)
    frequencies = np.array(FREQUENCIES)[:, None] * rng.uniform(0.8, 1.2, (3, len(middle)))
    phases = rng.uniform(0.0, 2.0 * np.pi, (3, len(middle)))
    waves = np.sin(2.0 * np.pi * frequencies[:, None] * t[:, None] + phases[:, None])
    return middle + reach * np.einsum("s,srj->rj", share, waves)
