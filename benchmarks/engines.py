"""Physics engines in Python: the loop that the analytic simulator replaces, and the engines behind its contract."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from math import sin
from pathlib import Path

import numpy as np
import pybullet
from kernel import BODY, EFFECTS, MAIN, RATE, ROUNDS, ROWS, Case
from timing import interleaved, print_table

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.bullet import BulletSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.mechanism import mechanism
from wipx.sim.mujoco import MujocoSimulator
from wipx.sim.simulator import Simulator
from wipx.sim.urdf import urdf

LOOP = "PyBullet, one loop in Python"
SMALLEST = 2e-4  # [s], of an emulated testbed
SECONDS = 1.0


class BulletLoop:
    """One rollout: both joints read, torques computed and set, one step, as often as there are rows."""

    def __init__(self, client: int, body: int) -> None:
        self.client = client
        self.body = body

    def __call__(self) -> None:
        """Simulate one rollout."""
        client, body = self.client, self.body
        pybullet.resetJointState(body, 0, 0.0, physicsClientId=client)
        pybullet.resetJointState(body, 1, 0.02, physicsClientId=client)
        for k in range(ROWS):
            force = 3.0 * sin(6.0 * 3.14159 * k / RATE)
            for joint, push in ((0, force), (1, 0.0)):
                rate = pybullet.getJointState(body, joint, physicsClientId=client)[1]
                torque = push - 0.02 * rate
                pybullet.setJointMotorControl2(
                    body, joint, pybullet.TORQUE_CONTROL, force=torque, physicsClientId=client
                )
            pybullet.stepSimulation(physicsClientId=client)


@contextmanager
def bullet_loop() -> Iterator[BulletLoop]:
    """The loop, with PyBullet connected."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "wip.urdf")
            path.write_text(urdf(mechanism(wip("rigid body alone")), "wip"), encoding="utf-8")
            body = pybullet.loadURDF(
                str(path), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client
            )
        pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        pybullet.setTimeStep(1.0 / RATE, physicsClientId=client)
        for joint in range(2):  # the joints' own motors
            pybullet.setJointMotorControl2(body, joint, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        yield BulletLoop(client, body)
    finally:
        pybullet.disconnect(client)


def wip(effects: str) -> Model:
    """The robot with the effects of that name."""
    plant = plant_of("wip")
    return Model(plant, plant.complete(BODY, "benchmark"), EFFECTS[effects])


def measure_engines() -> dict[str, float]:
    """Steps per second of PyBullet and of the analytic simulator in the same rounds."""
    cases = {f"analytic, batch {batch}": Case(MAIN, batch, 1) for batch in (1, 64, 1024)}
    with bullet_loop() as loop:
        timings = interleaved({LOOP: loop, **{name: case.rollout() for name, case in cases.items()}}, ROUNDS)
    slow = ROWS / timings[LOOP].median
    rates = {name: (cases[name].steps if name in cases else ROWS) / t.median for name, t in timings.items()}
    print_table(
        f"Beside a physics engine, {ROWS} steps at {RATE:g} Hz, one thread",
        ("engine", "million steps/s", "ratio"),
        [(name, f"{rate / 1e6:.3f}", f"{rate / slow:.0f}") for name, rate in rates.items()],
    )
    return rates | measure_steps()


def measure_steps() -> dict[str, float]:
    """Steps per second of the three engines behind one contract: a loop under a controller, and batches."""
    engines: dict[str, Simulator] = {
        "analytic": AnalyticSimulator(SMALLEST, threads=1),
        "mujoco": MujocoSimulator(SMALLEST),
        "pybullet": BulletSimulator(SMALLEST),
    }
    inputs = Inputs.regular(SECONDS, RATE, 1)
    windows = Inputs.regular(SECONDS, RATE, 1, windows=32)
    steps, start = int(inputs.substeps(SMALLEST).sum()), np.array([0.0, 0.02, 0.0, 0.0])

    def driven(engine: Simulator) -> object:
        return engine.drive(wip(MAIN), inputs, start, lambda t, measured: np.array([3.0 * sin(6.0 * t)]))

    def replayed(engine: Simulator, effects: str) -> object:
        held = replace(windows, commands=3.0 * np.sin(6.0 * windows.t[:-1, None, :]))
        return engine.replay(ModelBatch(wip(effects)), held, start[:, None, None])

    calls = {f"drive, {name}": lambda engine=engine: driven(engine) for name, engine in engines.items()}
    for effects in (MAIN, "rigid body alone"):
        calls |= {
            f"replay of 32 windows, {effects}, {name}": lambda engine=engine, effects=effects: replayed(engine, effects)
            for name, engine in engines.items()
        }
    timings = interleaved(calls, ROUNDS)
    rates = {name: steps * (32 if name.startswith("replay") else 1) / t.median for name, t in timings.items()}
    print_table(
        f"Engines behind one contract, steps of {SMALLEST:g} s, one thread",
        ("call", "microseconds per step"),
        [(name, f"{1e6 / rate:.2f}") for name, rate in rates.items()],
    )
    return rates


if __name__ == "__main__":
    measure_engines()
