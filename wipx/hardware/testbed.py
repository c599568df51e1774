"""Emulated testbed: a robot whose physics its owner does not know entirely.

It stands in for hardware where there is none. Its recordings are emulated, not real. The
hidden physics is drawn afresh from the generator; the nominal model is what the owner believes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import StateFeedback

FALLEN = 1.0  # [rad]


@dataclass(frozen=True)
class TestbedRun:
    """What the testbed leaves.

    Attributes:
        recordings: One per excitation, as logged.
        hidden: The robot as it really is; for checking only, no identification may read it.
    """

    recordings: tuple[Recording, ...]
    hidden: Model


@dataclass(frozen=True)
class EmulatedTestbed:
    """A simulated robot under its controller, with sensor noise and a log slower than the loop.

    Attributes:
        kind: Its plant.
        parameters: Its rigid body, which its owner knows exactly [SI].
        duration: Of each recording [s].
        log_every: Rows of the controller per row of the log; the logged command is their mean.
        position_noise: Standard deviation [m].
        position_step: Quantisation of the position encoder [m].
        angle_noise: Standard deviation [rad].
        step: Of its integrator [s].
    """

    kind: str
    parameters: Mapping[str, float]
    duration: float = 10.0
    log_every: int = 2
    position_noise: float = 2e-5
    position_step: float = 5e-5
    angle_noise: float = 4e-4
    step: float = 2e-4

    def __post_init__(self) -> None:
        check_positive(
            duration=self.duration, log_every=self.log_every, position_step=self.position_step, step=self.step
        )

    def nominal(self) -> Model:
        """The robot as its owner believes it to be."""
        plant = plant_of(self.kind, "target.kind")
        return Model(plant, plant.complete(self.parameters, "target.parameters"), {})

    def record(
        self, nominal: Model, feedback: StateFeedback, rate: float, rng: np.random.Generator, names: tuple[str, ...]
    ) -> TestbedRun:
        """Run the robot through excitations that differ.

        Args:
            nominal: What its owner believes.
            feedback: Its controller.
            rate: Of the controller [Hz].
            rng: Draws the hidden physics, excitations and noise.
            names: Names of the recordings; their number says how many are made.

        Raises:
            InputError: the robot falls over under this controller.
        """
        hidden = _with_hidden_physics(nominal, rng)
        plant = nominal.plant
        joints, windows = len(plant.joints), len(names)
        inputs = Inputs.regular(self.duration, rate, len(plant.commands), windows)
        rows = len(inputs.t) - 1
        references = np.zeros((rows, 2 * joints, windows))
        initial = np.zeros((2 * joints, 1, windows))
        driven = plant.joints.index(plant.actuated[0])
        for r in range(windows):
            path = _excitation(r, inputs.t[:-1, 0], rng)
            references[:, driven, r] = path
            references[:, joints + driven, r] = np.gradient(path, inputs.t[:-1, 0])
            initial[joints - 1, 0, r] = rng.uniform(0.03, 0.06) if r % 6 == 0 else rng.uniform(-0.01, 0.01)
        deviations = [self.position_noise if c == "x" else self.angle_noise for c in plant.coordinates]
        noise = np.zeros((rows + 1, 2 * joints, 1, windows))
        noise[:, :joints] = rng.normal(size=(rows + 1, joints, 1, windows)) * np.array(deviations)[:, None, None]
        run = AnalyticSimulator(self.step).close_loop(
            ModelBatch(hidden), inputs, initial, feedback, references, noise[:-1]
        )
        if not np.all(np.abs(run.coordinates[:, joints - 1]) < FALLEN):
            raise InputError(
                "target=emulated: the robot fell over under this controller; change the controller's weights"
            )
        shown = run.coordinates + noise[:, :joints]
        return TestbedRun(
            tuple(self._log(plant, inputs, shown, run.commands, r, names[r]) for r in range(windows)), hidden
        )

    def _log(self, plant, inputs: Inputs, shown: np.ndarray, commands: np.ndarray, r: int, name: str) -> Recording:
        """Every `log_every`-th row, with the mean of the commands until the next."""
        rows = (len(commands) // self.log_every) * self.log_every
        at = np.arange(0, rows, self.log_every)
        columns = {"t": inputs.t[at, r]}
        for j, column in enumerate(plant.coordinates):
            values = shown[at, j, 0, r]
            columns[column] = np.round(values / self.position_step) * self.position_step if column == "x" else values
        for c, column in enumerate(plant.commands):
            columns[column] = commands[:rows, c, 0, r].reshape(-1, self.log_every).mean(axis=1)
        return Recording(name, columns, f"emulated testbed, {name}", self.log_every)


def _with_hidden_physics(nominal: Model, rng: np.random.Generator) -> Model:
    """The robot as it is: bristle friction with a Stribeck peak, damping, dead zone, delay."""
    p = nominal.parameters
    weight = (p.get("body_mass", p.get("link1_mass", 1.0)) + p.get("wheel_mass", 0.0)) * p["gravity"]
    arm = p.get("com_height", p.get("link1_length", 1.0))
    effects: dict[str, dict[str, float]] = {}
    for site in nominal.plant.joints:
        driven = site in nominal.plant.actuated
        scale = weight if site == "translation" else weight * arm * (0.3 if driven else 0.02)
        level = rng.uniform(0.008, 0.02) * scale
        effects[f"{site}/lugre"] = {
            "F_c": level,
            "F_s": level * rng.uniform(1.1, 1.5),
            "v_s": rng.uniform(0.01, 0.05),
            "stiffness": level / rng.uniform(2e-5, 8e-5),
            "damping": 0.0,
        }
        effects[f"{site}/viscous"] = {"sigma": rng.uniform(0.01, 0.04) * scale}
    driven_scale = weight if nominal.plant.actuated[0] == "translation" else weight * arm
    effects["actuator/dead_zone"] = {"band": rng.uniform(0.002, 0.006) * driven_scale}
    effects["actuator/delay"] = {"tau": rng.uniform(0.004, 0.010)}
    return nominal.with_effects(effects)


def _excitation(number: int, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Reference of the driven coordinate, shape (rows,) [m or rad]: six kinds in turn."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    kind = number % 6
    if kind == 0:  # release from a tilt
        return np.zeros_like(t)
    if kind == 1:  # 0.3 m/s at 0.4 Hz, the paper's tracking task
        return 0.3 / (0.8 * np.pi) * (1.0 - np.cos(0.8 * np.pi * t))
    if kind == 2:  # slow and small
        return 0.03 * np.sin(2.0 * np.pi * 0.2 * t)
    if kind == 3:  # multisine
        frequencies = np.array([0.2, 0.5, 0.9, 1.4, 2.1])
        phases = rng.uniform(0.0, 2.0 * np.pi, 5)
        sines = np.sin(2.0 * np.pi * frequencies[:, None] * t + phases[:, None]) - np.sin(phases)[:, None]
        return np.minimum(t, 1.0) * ((0.03 / np.sqrt(frequencies)) @ sines)
    if kind == 4:  # steps
        return 0.12 * np.sign(np.sin(2.0 * np.pi * t / 4.0 + phase)) * np.minimum(t, 1.0)
    return 0.05 * np.minimum(t, 1.0) * np.sin(2.0 * np.pi * (0.2 + 0.12 * t) * t)  # chirp to 2.6 Hz
