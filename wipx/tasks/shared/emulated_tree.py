"""Example robots that balance: the nominal model, the emulated robot, and its closed loop."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import numpy as np

from wipx.control.whole_body import WholeBodyLoop
from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model
from wipx.recordings.robot_file import read_robot
from wipx.recordings.source import ROBOT_FILE
from wipx.recordings.strict_yaml import load_mapping
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator

SECRET = "emulated.yaml"


def example_names() -> list[str]:
    """Names of the example robots."""
    home = Path(str(files("wipx"))) / "robots"
    return sorted(path.name for path in home.iterdir() if (path / ROBOT_FILE).is_file())


def example_folder(name: str) -> Path:
    """Folder of an example robot.

    Raises:
        InputError: there is none of that name.
    """
    if name not in example_names():
        raise unknown_name("example", name, example_names(), "task.robot")
    return Path(str(files("wipx"))) / "robots" / name


@dataclass(frozen=True)
class EmulatedTree:
    """A robot that balances.

    Attributes:
        nominal: As its owner knows it.
        emulated: With the physics that the nominal model lacks.
        posture: Positions that its driven joints hold [rad or m].
        noise: Standard deviations of its sensors: position [rad and m], force [N m and N].
    """

    nominal: Model
    emulated: Model
    posture: Mapping[str, float]
    noise: Mapping[str, float]

    def driven(
        self,
        model: Model,
        loop: WholeBodyLoop,
        reference: np.ndarray,
        simulator: Simulator,
        rng: np.random.Generator,
        stopped: Callable[[np.ndarray], bool] = lambda _: False,
    ) -> dict[str, np.ndarray]:
        """Columns of a closed loop: `t`, positions and forces of the drives, as measured.

        Args:
            model: The robot that is driven; it begins at rest in the nominal balance.
            loop: Drives it.
            reference: Of the loop at each of its periods, shape (rows, 2 joints).
            simulator: The engine.
            rng: Of the noise.
            stopped: Of the true positions (joints,), whether the trial ends here.
        """
        joints, plant = len(model.plant.joints), model.plant
        rows: list[np.ndarray] = []

        def controller(_: float, measured: np.ndarray) -> np.ndarray:
            true = measured[:joints]
            if stopped(true):
                raise _StoppedError
            seen = true + self.noise["position"] * rng.normal(size=joints)
            commands = loop.step(seen, reference[len(rows)])
            rows.append(np.concatenate([seen, commands + self.noise["force"] * rng.normal(size=len(commands))]))
            return commands

        inputs = Inputs.regular((len(reference) - 1) / loop.rate, loop.rate, len(plant.commands))
        with suppress(_StoppedError):
            simulator.drive(model, inputs, np.concatenate([loop.nominal.positions, np.zeros(joints)]), controller)
        logged = np.array(rows).reshape(len(rows), joints + len(plant.commands))
        names = (*plant.coordinates, *plant.commands)
        return {"t": np.arange(len(rows)) / loop.rate, **dict(zip(names, logged.T, strict=True))}


def emulated_tree(name: str) -> EmulatedTree:
    """An example robot that balances.

    Raises:
        InputError: there is no such example, or it stands on its own.
    """
    folder = example_folder(name)
    said = load_mapping(folder / SECRET)
    if "posture" not in said:
        raise InputError(f"task.robot: {name} does not balance; expected an example with a posture, such as humanoid")
    nominal = read_robot(folder / ROBOT_FILE).model
    hidden = {str(key): dict(values) for key, values in cast(Mapping[str, Any], said["hidden"]).items()}
    posture, noise = (cast(Mapping[str, float], said[key]) for key in ("posture", "noise"))
    return EmulatedTree(nominal, nominal.with_effects(hidden), posture, noise)


class _StoppedError(Exception):
    """Ends a simulation that is not worth going on with."""
