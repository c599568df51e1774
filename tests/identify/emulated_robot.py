"""Recordings of simulated robots whose physics is known, for tests that must find it again."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from wipx.control.lqr import Lqr
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording, RecordingSplit
from wipx.identify.identification import Identified, Request, identify
from wipx.identify.objectives import MultiStep, Objective
from wipx.identify.optimizers.least_squares import LeastSquares
from wipx.identify.optimizers.search import Optimizer
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import StateFeedback

Effects = Mapping[str, Mapping[str, float]]

RATE = 250.0  # [Hz] of the controller and of the log
POSITION_NOISE = 5e-5  # [m]
ANGLE_NOISE = 3e-4  # [rad]
BODIES = {
    "wip": {
        "body_mass": 5.0,
        "wheel_mass": 1.2,
        "com_height": 0.35,
        "body_inertia": 0.15,
        "wheel_inertia": 0.0023,
        "wheel_radius": 0.0625,
    },
    "cartpole": {"body_mass": 0.5, "wheel_mass": 1.0, "com_height": 0.3, "body_inertia": 0.015},
    "pendulum": {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037},
    "linear_axis": {"body_mass": 2.0, "wheel_mass": 0.5},
    "double_pendulum": {
        "link1_mass": 0.5,
        "link1_length": 0.2,
        "link1_com": 0.15,
        "link1_inertia": 0.015,
        "link2_mass": 0.6,
        "link2_length": 0.3,
        "link2_com": 0.25,
        "link2_inertia": 0.05,
    },
}
TRAVEL = {"x": 0.15, "theta": 0.3, "theta1": 0.4, "theta2": 0.4}  # of a driven joint [m, rad]
SIMULATOR = AnalyticSimulator(threads=1)
FAST = LeastSquares(starts=1)
SHORT = MultiStep(horizon=0.3)


def nominal_model(kind: str) -> Model:
    plant = plant_of(kind)
    return Model(plant, plant.complete(BODIES[kind], "test"), {})


@cache
def controller(kind: str) -> StateFeedback:
    """A regulator on noiseless rates: the noise of the recordings is the sensors' alone."""
    gentle = 10.0 if kind == "double_pendulum" else 0.2  # its light links would chatter at 250 Hz
    return Lqr(command=gentle).feedback(nominal_model(kind))


def sensor_deviations(model: Model) -> np.ndarray:
    """Standard deviation of the noise on each coordinate, shape (joints,) [m or rad]."""
    return np.array([POSITION_NOISE if column == "x" else ANGLE_NOISE for column in model.plant.coordinates])


@dataclass(frozen=True)
class Robot:
    """A robot under its controller.

    Attributes:
        model: How it really is.
        duration: Of each recording [s].
        noisy: Whether its sensors are.
    """

    model: Model
    duration: float = 3.0
    noisy: bool = True

    def record(self, rng: np.random.Generator, count: int = 3) -> tuple[Recording, ...]:
        """Follow sums of sines, drawn afresh for every recording and driven joint."""
        plant = self.model.plant
        joints = len(plant.joints)
        inputs = Inputs.regular(self.duration, RATE, len(plant.commands), count)
        t = inputs.t[:-1, 0]
        references = np.zeros((len(t), 2 * joints, count))
        for r in range(count):
            for j in map(plant.joints.index, plant.actuated):
                path = TRAVEL[plant.coordinates[j]] * _sines(t, rng)
                references[:, j, r], references[:, joints + j, r] = path, np.gradient(path, t)
        run = SIMULATOR.close_loop(
            ModelBatch(self.model), inputs, np.zeros((2 * joints, 1, count)), controller(plant.kind), references
        )
        noise = rng.normal(size=run.coordinates.shape) * sensor_deviations(self.model)[:, None, None] * self.noisy
        shown = (run.coordinates + noise)[:-1, :, 0]
        return tuple(
            Recording(
                f"r{r + 1}.csv",
                {
                    "t": t,
                    **{column: shown[:, j, r] for j, column in enumerate(plant.coordinates)},
                    **{column: run.commands[:, c, 0, r] for c, column in enumerate(plant.commands)},
                    **{f"{c}_ref": references[:, i, r] for i, c in enumerate((*plant.coordinates, *plant.rates))},
                },
            )
            for r in range(count)
        )


def _sines(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A smooth path that starts at rest at zero, of size about one."""
    frequencies = rng.uniform((0.3, 0.8, 1.8), (0.7, 1.4, 2.6))
    phases = rng.uniform(0.0, 2.0 * np.pi, 3)
    return np.minimum(t / 0.5, 1.0) ** 2 * (np.sin(2.0 * np.pi * np.outer(t, frequencies) + phases) @ (0.6, 0.3, 0.15))


def complete(
    nominal: Model,
    recordings: tuple[Recording, ...],
    switched_on: tuple[str, ...],
    *,
    held_out: tuple[Recording, ...] = (),
    free: Mapping[str, float | None] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    optimizer: Optimizer = FAST,
    objective: Objective = SHORT,
) -> Identified:
    """Identify effects, quickly."""
    return identify(
        Request(nominal, switched_on, {}, free or {}, bounds or {}, (controller(nominal.plant.kind), RATE)),
        RecordingSplit(recordings, held_out, "as the test says"),
        SIMULATOR,
        objective,
        optimizer,
        horizon=0.5,
        rng=np.random.default_rng(0),
    )
