"""Time and memory of one identification: the paper's friction on both joints, 12 parameters."""

import json
import os
import resource
import subprocess
import sys
import time
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kernel import BODY, PAPER, RATE
from timing import print_table

from wipx.control.lqr import Lqr
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.effects.catalogue import effect_of
from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.noise import sensor_noise
from wipx.identify.objectives import FitData, MultiStep, PaperTrajectories
from wipx.identify.optimizers.least_squares import LeastSquares
from wipx.identify.optimizers.pso import ParticleSwarm
from wipx.identify.parameter_space import parameter_space, scales_of
from wipx.identify.problem import WindowProblem
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import StateFeedback

RECORDINGS, DURATION = 8, 1.2  # paper: trajectories of 1.2 s
POSITION_NOISE, ANGLE_NOISE = 5e-4, 1e-3  # [m], [rad]
SWITCHED_ON = ("translation/lagged_stribeck", "pitch/lagged_stribeck")
SHOOTING, TRAJECTORIES = MultiStep(horizon=0.4), PaperTrajectories(samples=78)


@dataclass(frozen=True)
class Search:
    """One identification.

    Attributes:
        objective: What is minimised.
        optimizer: How.
    """

    objective: MultiStep | PaperTrajectories
    optimizer: LeastSquares | ParticleSwarm


SEARCHES = {
    "multiple shooting, least squares, 1 start": Search(SHOOTING, LeastSquares(starts=1)),
    "multiple shooting, least squares, 2 starts": Search(SHOOTING, LeastSquares(starts=2)),
    "multiple shooting, PSO 50 x 15": Search(SHOOTING, ParticleSwarm(particles=50, iterations=15)),
    "paper's objective, least squares, 2 starts": Search(TRAJECTORIES, LeastSquares(starts=2)),
    "paper's objective, PSO 50 x 100": Search(TRAJECTORIES, ParticleSwarm(particles=50, iterations=100)),
}


def small_problem(objective: MultiStep | PaperTrajectories) -> tuple[WindowProblem | ClosedLoopProblem, np.ndarray]:
    """The problem, and the position of the truth in its unit cube."""
    plant = plant_of("wip")
    nominal = Model(plant, plant.complete(BODY, "benchmark"), {})
    truth = nominal.with_effects(dict.fromkeys(SWITCHED_ON, PAPER))
    feedback = Lqr(rate_filter=None).feedback(nominal)
    recordings = _record(truth, feedback, np.random.default_rng(1))
    scales = scales_of(nominal, recordings)
    neutral = nominal.with_effects({name: effect_of(name, plant).neutral for name in SWITCHED_ON})
    space = parameter_space(neutral, SWITCHED_ON, {}, {}, {}, scales)
    speeds = tuple(scales[joint].velocity for joint in plant.joints)
    simulator = AnalyticSimulator(threads=1)
    data = FitData(recordings, nominal, simulator, sensor_noise(recordings, plant), speeds, (feedback, RATE))
    return objective.problem(data, space), space.to_cube(np.array([truth.value(name) for name in space.names]))


def _record(truth: Model, feedback: StateFeedback, rng: np.random.Generator) -> tuple[Recording, ...]:
    """Releases from a tilt under a regulator."""
    inputs = Inputs.regular(DURATION, RATE, 1, RECORDINGS)
    rows = len(inputs.t) - 1
    initial = np.zeros((4, 1, RECORDINGS))
    initial[1] = np.linspace(-0.1, 0.1, RECORDINGS)
    run = AnalyticSimulator(threads=1).close_loop(
        ModelBatch(truth), inputs, initial, feedback, np.zeros((rows, 4, RECORDINGS))
    )
    noise = np.array([POSITION_NOISE, ANGLE_NOISE])[:, None, None] * rng.normal(size=run.coordinates.shape)
    shown = (run.coordinates + noise)[:-1]
    return tuple(
        Recording(
            f"r{r}.csv",
            {"t": inputs.t[:-1, r], "x": shown[:, 0, 0, r], "theta": shown[:, 1, 0, r], "u": run.commands[:, 0, 0, r]},
        )
        for r in range(RECORDINGS)
    )


def measure_one(name: str) -> dict[str, float]:
    """Time, memory and result of one search in this process."""
    search = SEARCHES[name]
    problem, truth = small_problem(search.objective)
    problem.losses(problem.space.start[None])  # compiled and warm
    wall, began = time.perf_counter(), time.process_time()
    minimum = search.optimizer.minimise(problem, np.random.default_rng(2))
    spent, wall = time.process_time() - began, time.perf_counter() - wall
    highest = _resident()
    tracemalloc.start()  # slows a search down, hence apart from it
    problem.losses(problem.space.sample(50, np.random.default_rng(3)))
    batch = tracemalloc.get_traced_memory()[1]
    return {
        "processor_s": spent,
        "wall_s": wall,
        "evaluations": float(minimum.history.evaluations[-1]),
        "loss_over_truth": minimum.loss / float(problem.losses(truth[None])[0]),
        "resident_mib": highest,
        "batch_of_50_mib": batch / 2**20,
    }


def _resident() -> float:
    """Highest resident memory so far [MiB]."""
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def measure_identification() -> dict[str, dict[str, float]]:
    """Every search in a process of its own, since a peak of memory never falls."""
    # The small matrices of a search are not worth threads; read when numpy is imported.
    environment = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", **os.environ}
    results, lines = {}, []
    for name in SEARCHES:
        command = [sys.executable, str(Path(__file__).resolve()), name]
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
        r = results[name] = json.loads(done.stdout)
        lines.append(
            (
                name,
                f"{r['processor_s']:.2f}",
                f"{r['wall_s']:.2f}",
                f"{r['evaluations']:.0f}",
                f"{r['loss_over_truth']:.4f}",
                f"{r['resident_mib']:.0f}",
                f"{r['batch_of_50_mib']:.0f}",
            )
        )
    print_table(
        f"Identification of 12 parameters from {RECORDINGS} recordings of {DURATION:g} s, one thread",
        (
            "search",
            "processor s",
            "wall s",
            "evaluations",
            "loss/truth's",
            "peak MiB",
            "50 candidates MiB",
        ),
        lines,
    )
    return results


if __name__ == "__main__":
    print(json.dumps(measure_one(sys.argv[1])))
