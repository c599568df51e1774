"""Speed of the analytic simulator: integration steps per second of one core."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from timing import interleaved, print_table

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

RATE, DURATION = 650.0, 1.2  # [Hz, s] paper: controller of 600 to 700 Hz, trajectories of 1.2 s
ROWS = 780
SAMPLES = 65.0  # [Hz] paper: 80 samples of a trajectory
ROUNDS = 5
BODY = {
    "body_mass": 5.0,
    "wheel_mass": 1.2,
    "com_height": 0.35,
    "body_inertia": 0.15,
    "wheel_inertia": 0.0023,
    "wheel_radius": 0.0625,
}
PAPER = {"F_s": 0.15, "F_c": 0.12, "v_s": 0.2, "sigma": 0.02, "epsilon": 0.01, "alpha": 0.7}
COULOMB = {"translation/coulomb": {"F_c": 0.5}, "pitch/coulomb": {"F_c": 0.1}}
EFFECTS: dict[str, dict[str, dict[str, float]]] = {
    "rigid body alone": {},
    "Coulomb on both joints": COULOMB,
    "Coulomb and delay": {**COULOMB, "actuator/delay": {"tau": 0.006}},
    "paper friction on both joints": {"translation/lagged_stribeck": PAPER, "pitch/lagged_stribeck": PAPER},
}
MAIN = "paper friction on both joints"
COMPILE = """
import time
began = time.process_time()
from kernel import EFFECTS, MAIN, Case
from wipx.sim.analytic import AnalyticSimulator
imported = time.process_time()
Case(MAIN, 64, 1).rollout()()
print(imported - began, time.process_time() - imported)
"""


@dataclass(frozen=True)
class Case:
    """One variant.

    Attributes:
        effects: Key of `EFFECTS`.
        batch: Rollouts of one call.
        substeps: Integration steps per row.
        rate: Rows per second [Hz].
    """

    effects: str
    batch: int
    substeps: int
    rate: float = RATE

    @property
    def name(self) -> str:
        """Label of its row."""
        return f"{self.effects}, batch {self.batch}, {self.rate:g} rows/s, {self.substeps} steps per row"

    @property
    def rows(self) -> int:
        """Rows of a rollout; large batches are shortened to keep memory and time small."""
        rows = round(DURATION * self.rate)
        return rows if self.batch <= 1024 else rows // 6

    @property
    def steps(self) -> int:
        """Integration steps of one call."""
        return self.batch * self.rows * self.substeps

    def rollout(self) -> Callable[[], object]:
        """A call that simulates the batch."""
        plant = plant_of("wip")
        model = Model(plant, plant.complete(BODY, "benchmark"), EFFECTS[self.effects])
        inputs = Inputs.regular(self.rows / self.rate, self.rate, 1)
        t = inputs.t[:-1, 0]
        commands = (3.0 * np.sin(2.0 * np.pi * 3.0 * t))[:, None, None]
        inputs = Inputs(inputs.t, commands, inputs.first, inputs.last)
        masses = np.linspace(4.0, 6.0, self.batch)[:, None]
        batch = ModelBatch(model, ("body_mass",), masses)
        initial = np.zeros((4, self.batch, 1))
        initial[1] = 0.02
        simulator = AnalyticSimulator(step=1.0 / self.rate / self.substeps, threads=1)
        return lambda: simulator.replay(batch, inputs, initial)


def measure_kernel() -> dict[str, dict[str, float]]:
    """Steps per second of every variant, printed and returned by name."""
    cases = [Case(effects, 1024, 1) for effects in EFFECTS]
    cases += [Case(MAIN, batch, 1) for batch in (64, 16384)]
    cases += [Case(effects, 1024, 10, SAMPLES) for effects in EFFECTS]
    timings = interleaved({case.name: case.rollout() for case in cases}, ROUNDS)
    results, lines = {}, []
    for case in cases:
        timing = timings[case.name]
        rate = case.steps / timing.median
        results[case.name] = {"steps_per_second": rate, "steps": case.steps, **asdict(timing)}
        spread = f"{case.steps / timing.high / 1e6:.1f} to {case.steps / timing.low / 1e6:.1f}"
        lines.append(
            (
                case.name,
                f"{rate / 1e6:.1f}",
                spread,
                f"{1e6 * timing.median / case.batch * DURATION * case.rate / case.rows:.2f}",
            )
        )
    print_table(
        f"Analytic simulator, one thread; a rollout of {DURATION:g} s has {ROWS} steps",
        ("variant", "million steps/s", "of the rounds", "us per rollout"),
        lines,
    )
    return results


def measure_compilation() -> dict[str, float]:
    """Processor time of the first call in a fresh process, without and with the cache on disk [s]."""
    here = Path(__file__).resolve().parent
    with tempfile.TemporaryDirectory() as folder:
        environment = {
            **os.environ,
            "NUMBA_CACHE_DIR": folder,
            "PYTHONPATH": os.pathsep.join([str(here), str(here.parent)]),
        }
        spent = []
        for _ in range(2):
            command = [sys.executable, "-c", COMPILE]
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
            spent.append([float(cell) for cell in done.stdout.split()])
    results = {"import_s": spent[1][0], "first_call_s": spent[0][1], "cached_call_s": spent[1][1]}
    print_table(
        "Compilation",
        ("processor time", "s"),
        [
            ("import of the simulator", f"{results['import_s']:.2f}"),
            ("first call, compiled", f"{results['first_call_s']:.2f}"),
            ("first call, read from the cache", f"{results['cached_call_s']:.2f}"),
        ],
    )
    return results
