"""Time and memory of one identification: the paper's friction on both joints, 12 parameters, 8 recordings.

As the paper would do it (a swarm, each candidate a loop in Python around a physics engine), by the same swarm on
batches of the analytic simulator, and by least squares.
"""

import json
import os
import resource
import subprocess
import sys
import time
import tracemalloc
from dataclasses import asdict, dataclass
from math import copysign, exp
from pathlib import Path

import numpy as np
import pybullet
from engines import BulletLoop, bullet_loop
from kernel import BODY, PAPER, RATE, ROWS
from timing import print_table, processor_time

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
SHOOTING, TRAJECTORIES = MultiStep(horizon=0.4), PaperTrajectories(samples=78, at_rest=True)
CLOSE = 1.01  # of the best loss that any search of the same objective found
LOOPS = 5  # rollouts of the physics engine that are timed
BULLET = "paper's objective, PSO 50 x 100, PyBullet loop"


@dataclass(frozen=True)
class Search:
    """One identification.

    Attributes:
        objective: What is minimised.
        optimizer: How.
    """

    objective: MultiStep | PaperTrajectories
    optimizer: LeastSquares | ParticleSwarm


PSO, LEAST_SQUARES = "paper's objective, PSO 50 x 100", "paper's objective, least squares"
SEARCHES = {
    PSO: Search(TRAJECTORIES, ParticleSwarm(particles=50, iterations=100, start="random")),
    LEAST_SQUARES: Search(TRAJECTORIES, LeastSquares()),
    "multiple shooting, least squares": Search(SHOOTING, LeastSquares()),
}


@dataclass(frozen=True)
class Measured:
    """What one search took.

    Attributes:
        processor: Processor time [s].
        wall: Time [s].
        evaluations: Of the loss.
        best: Best loss, in multiples of that of the truth.
        course: Evaluations, seconds and best loss, in the same multiples, as the search went on.
        resident: Highest resident memory [MiB].
        batch: Memory of the losses of 50 candidates [MiB].
    """

    processor: float
    wall: float
    evaluations: int
    best: float
    course: list[list[float]]
    resident: float
    batch: float

    def until(self, loss: float) -> tuple[int, float] | None:
        """Evaluations and seconds until a loss was reached; None where it never was."""
        for evaluations, seconds, best in self.course:
            if best <= loss:
                return round(evaluations), seconds
        return None


def small_problem(objective: MultiStep | PaperTrajectories) -> tuple[WindowProblem | ClosedLoopProblem, np.ndarray]:
    """The problem, and the position of the truth in its unit cube."""
    plant = plant_of("wip")
    nominal = Model(plant, plant.complete(BODY, "benchmark"), {})
    truth = nominal.with_effects(dict.fromkeys(SWITCHED_ON, PAPER))
    feedback = Lqr().feedback(nominal)
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


def measure_one(name: str) -> Measured:
    """Time, memory and result of one search in this process."""
    search = SEARCHES[name]
    problem, truth = small_problem(search.objective)
    scale = float(problem.losses(truth[None])[0])  # compiled and warm
    wall, began = time.perf_counter(), time.process_time()
    minimum = search.optimizer.minimise(problem, np.random.default_rng(2))
    spent, wall = time.process_time() - began, time.perf_counter() - wall
    highest = _resident()
    tracemalloc.start()  # slows a search down, hence apart from it
    problem.losses(problem.space.sample(50, np.random.default_rng(3)))
    batch = tracemalloc.get_traced_memory()[1]
    history = minimum.history
    course = np.column_stack([history.evaluations, history.seconds, history.best_loss / scale])
    evaluations = int(history.evaluations[-1])
    return Measured(spent, wall, evaluations, minimum.loss / scale, course.tolist(), highest, batch / 2**20)


def _resident() -> float:
    """Highest resident memory so far [MiB]."""
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def paper_rollout(loop: BulletLoop, gains: np.ndarray) -> None:
    """One release as the paper simulates it: control and friction of both joints in Python, then one step."""
    client, body = loop.client, loop.body
    pybullet.resetJointState(body, 0, 0.0, physicsClientId=client)
    pybullet.resetJointState(body, 1, 0.05, physicsClientId=client)
    before = [0.0, 0.0]
    for _ in range(ROWS):
        (x, v), (theta, rate) = (pybullet.getJointState(body, j, physicsClientId=client)[:2] for j in range(2))
        command = -(gains[0] * x + gains[1] * theta + gains[2] * v + gains[3] * rate)
        for joint, speed, push in ((0, v, command), (1, rate, 0.0)):
            now = _friction(speed)
            torque = push - PAPER["alpha"] * now - (1.0 - PAPER["alpha"]) * before[joint]
            before[joint] = now
            pybullet.setJointMotorControl2(body, joint, pybullet.TORQUE_CONTROL, force=torque, physicsClientId=client)
        pybullet.stepSimulation(physicsClientId=client)


def _friction(speed: float) -> float:
    """F_ss of the paper's Eq. 5."""
    if abs(speed) < PAPER["epsilon"]:
        return 0.0
    level = PAPER["F_c"] + (PAPER["F_s"] - PAPER["F_c"]) * exp(-((speed / PAPER["v_s"]) ** 2))
    return copysign(level, speed) + PAPER["sigma"] * speed


def bullet_evaluation() -> float:
    """Processor time of one candidate, that is of all recordings, in the loop [s]."""
    plant = plant_of("wip")
    gains = Lqr().feedback(Model(plant, plant.complete(BODY, "benchmark"), {})).gains[0]
    with bullet_loop() as loop:
        paper_rollout(loop, gains)
        return RECORDINGS * float(np.median([processor_time(lambda: paper_rollout(loop, gains)) for _ in range(LOOPS)]))


def measure_identification() -> dict[str, dict[str, object]]:
    """Every search in a process of its own, since a peak of memory never falls."""
    # The small matrices of a search are not worth threads; read when numpy is imported.
    environment = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", **os.environ}
    results = {}
    for name in SEARCHES:
        command = [sys.executable, str(Path(__file__).resolve()), name]
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
        results[name] = Measured(**json.loads(done.stdout))
    best = {
        search.objective: min(results[n].best for n, s in SEARCHES.items() if s.objective == search.objective)
        for search in SEARCHES.values()
    }
    lines = [_line(name, measured, CLOSE * best[SEARCHES[name].objective]) for name, measured in results.items()]
    evaluation = bullet_evaluation()
    lines.insert(0, _bullet_line(results[PSO], evaluation, CLOSE * best[TRAJECTORIES]))
    print_table(
        f"Identification of 12 parameters from {RECORDINGS} recordings of {DURATION:g} s, one thread",
        ("search", "processor s", "evaluations", "loss/truth's", "s to within 1 %", "peak MiB", "50 candidates MiB"),
        lines,
    )
    extrapolated = evaluation * results[PSO].evaluations
    ratios = {name: extrapolated / results[name].processor for name in (PSO, LEAST_SQUARES)}
    print(f"the loop takes {ratios[PSO]:.0f} times as long as this swarm, {ratios[LEAST_SQUARES]:.0f} as least squares")
    figures: dict[str, dict[str, object]] = {name: asdict(measured) for name, measured in results.items()}
    return figures | {BULLET: {"evaluation_s": evaluation, "extrapolated_s": extrapolated}}


def _line(name: str, measured: Measured, close: float) -> tuple[str, ...]:
    reached = measured.until(close)
    return (
        name,
        f"{measured.processor:.2f}",
        f"{measured.evaluations}",
        f"{measured.best:.4f}",
        "never" if reached is None else f"{reached[1]:.2f}",
        f"{measured.resident:.0f}",
        f"{measured.batch:.0f}",
    )


def _bullet_line(swarm: Measured, evaluation: float, close: float) -> tuple[str, ...]:
    """The same swarm, each evaluation taking what the loop takes: extrapolated from a few rollouts."""
    reached = swarm.until(close)
    return (
        f"{BULLET} (extrapolated)",
        f"{evaluation * swarm.evaluations:.0f}",
        f"{swarm.evaluations}",
        "as below",
        "never" if reached is None else f"{evaluation * reached[0]:.0f}",
        "",
        "",
    )


if __name__ == "__main__":
    print(json.dumps(asdict(measure_one(sys.argv[1]))))
