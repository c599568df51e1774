"""Simulated robots that are released under unknown loads: the training sets of the paper, Sec. IV-B.

Every robot starts at rest, almost upright, under the regulator of the robot without load, and is watched for a window
of a second or so. Which simulation it is (a method's) is decided elsewhere; reading and writing is in `dataset_file`.
"""

import hashlib
import json
from dataclasses import asdict, dataclass, field

import numpy as np

from wipx.core.errors import InputError, check_positive
from wipx.core.model import ModelBatch
from wipx.identify.closed_loop import Sampling
from wipx.identify.problem import chunks
from wipx.learn.balance import balance_of
from wipx.learn.dataset_file import digest_of
from wipx.learn.loads import LoadRanges, carrying, equilibria, some_of
from wipx.learn.training_set import PARTS, TrainingSet
from wipx.sim.inputs import Inputs
from wipx.sim.noise import AMPLITUDE, FREQUENCY, SPREAD, paper_noise
from wipx.sim.simulator import Simulator, StateFeedback

FEWEST = 10  # robots: one for validation and one for the test
SHARES = (0.8, 0.1, 0.1)  # of `PARTS`; paper, Sec. IV-B
FALLEN = 1.0  # [rad]
AT_ONCE = 4096  # robots in one call; 0.1 GB at the paper's length


@dataclass(frozen=True)
class ObservationNoise:
    """The paper's high-frequency noise, Eq. 6: A cos(2 pi f t) B N(0, 1), on position and pitch.

    Attributes:
        amplitude: A [m and rad].
        spread: B [1].
        frequency: f [Hz].
        in_loop: Whether the regulator measures with this noise too, rates included. By default it does not: a
            robot's regulator works on a filtered state (the paper's by an extended Kalman filter), which is far less
            noisy than Eq. 6; fed back raw, the noise of 5 mrad alone would shake the wheels by half a newton.
    """

    amplitude: float = AMPLITUDE
    spread: float = SPREAD
    frequency: float = FREQUENCY
    in_loop: bool = False

    def __post_init__(self) -> None:
        for name in ("amplitude", "spread", "frequency"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"noise: {name} is {getattr(self, name):g}, expected zero or a positive number")

    def draw(self, t: np.ndarray, signals: int, robots: int, rng: np.random.Generator) -> np.ndarray:
        """Noise at the times t (K,) [s], shape (K, signals, robots) [unit of the signal]."""
        sizes = {"amplitude": self.amplitude, "spread": self.spread, "frequency": self.frequency}
        return paper_noise(t, (signals, robots), rng, **sizes)


@dataclass(frozen=True)
class Watch:
    """How many robots are released, how, and what is seen of them.

    Attributes:
        ranges: Of the loads.
        samples: Robots; 8:1:1 of them are for training, validation and test.
        length: Samples of a window, L.
        period: Time between them [s].
        lean: Robots start at a pitch of up to this size, uniformly drawn: no hand holds them exactly upright [rad].
        rail: Half its length; a robot that gets there, or falls by 1 rad, stays as it was then [m].
        noise: On the windows.
    """

    ranges: LoadRanges = field(default_factory=LoadRanges)
    samples: int = 1500
    length: int = 80
    period: float = 0.015
    lean: float = 3e-3
    rail: float = 1.8
    noise: ObservationNoise = field(default_factory=ObservationNoise)

    def __post_init__(self) -> None:
        check_positive(period=self.period, rail=self.rail)
        if self.samples < FEWEST:
            raise InputError(f"samples is {self.samples}, expected {FEWEST} or more, for training, validation and test")
        if self.length < 2:
            raise InputError(f"length is {self.length}, expected 2 samples or more")
        if not self.lean >= 0.0:
            raise InputError(f"lean is {self.lean:g}, expected zero or a positive angle in rad")


def generate(
    simulations: ModelBatch,
    regulator: tuple[StateFeedback, float],
    simulator: Simulator,
    watch: Watch,
    rng: np.random.Generator,
) -> TrainingSet:
    """Release simulated robots, each with a load of its own, and note what is seen and where they balance.

    Args:
        simulations: The robot without load: one model, or several of which every load gets the next in turn
            (domain randomisation: as many as there are samples).
        regulator: Of the robot without load, and its rate [Hz].
        simulator: The engine.
        watch: What is done.
        rng: Source of all random numbers.

    Returns:
        Windows of float32. The label is the angle of the centre of mass, whatever the simulation does. A robot that
        falls or reaches the end of the rail is kept: its window holds its last place from then on.

    Raises:
        InputError: the robot cannot carry a load, or samples follow each other faster than the regulator.
    """
    feedback, rate = regulator
    if watch.period * rate < 1.0:
        raise InputError(f"period is {watch.period:g} s, expected {1.0 / rate:.3g} s or more: one row of the regulator")
    loads = watch.ranges.draw(simulations.model, watch.samples, rng)
    robots = carrying(simulations, loads)
    start = rng.uniform(-watch.lean, watch.lean, size=watch.samples)
    part = rng.permutation(np.repeat(np.arange(len(PARTS)), _sizes(watch.samples)))
    windows, stopped = [], 0
    for some in chunks(watch.samples, AT_ONCE):
        batch = some_of(robots, some)
        seen, held = _released(batch, start[some], feedback, rate, simulator, watch, rng)
        windows.append(seen)
        stopped += held
    training = TrainingSet(np.concatenate(windows), equilibria(robots), loads, part, watch.period, {})
    card = asdict(watch) | {
        "parts": dict(zip(PARTS, _sizes(watch.samples), strict=True)),
        "regulator": {"gains": feedback.gains.tolist(), "rate": rate},
        "simulations": {"count": simulations.size, "digest": model_digest(simulations)},
        "stopped": stopped,
        "digest": digest_of(training),
    }
    plain = json.loads(json.dumps(card))  # what is read back from a file has lists for tuples too
    return TrainingSet(training.windows, training.pitch, loads, part, watch.period, plain)


def check_labels(
    simulations: ModelBatch, training: TrainingSet, simulator: Simulator, count: int, rng: np.random.Generator
) -> dict[str, float]:
    """Compare the labels of some robots with where they balance when they are released without command.

    Args:
        simulations: Those that the training set was made of.
        training: The robots.
        simulator: The engine.
        count: Robots that are compared.
        rng: Chooses them.

    Returns:
        Their number `robots`; `largest_difference` of a label to the middle of the pitches from which the robot does
        not fall; `largest_dead_band`, half the width of these; and by how much a label lies outside of them,
        `largest_miss` [rad].
    """
    chosen = rng.choice(len(training.pitch), size=min(count, len(training.pitch)), replace=False)
    robots = carrying(simulations, training.loads)
    label = training.pitch[chosen]
    balance = balance_of(some_of(robots, chosen), simulator)
    return {
        "robots": len(chosen),
        "largest_difference": float(np.abs(balance.middle - label).max()),
        "largest_dead_band": float(balance.dead_band.max()),
        "largest_miss": float(balance.misses(label).max()),
    }


def model_digest(models: ModelBatch) -> str:
    """Short name of what models are."""
    plain = [
        models.model.plant.kind,
        dict(models.model.parameters),
        {k: dict(v) for k, v in models.model.effects.items()},
    ]
    values = [] if models.values is None else models.values.tolist()
    return hashlib.sha256(json.dumps([plain, models.names, values], sort_keys=True).encode()).hexdigest()[:12]


def _released(
    robots: ModelBatch,
    start: np.ndarray,
    feedback: StateFeedback,
    rate: float,
    simulator: Simulator,
    watch: Watch,
    rng: np.random.Generator,
) -> tuple[np.ndarray, int]:
    """Windows of robots, shape (N, L, 2) [m, rad], and how many of them fell or reached the end of the rail."""
    rows = Sampling(np.arange(watch.length) * watch.period, rate).rows
    inputs = Inputs.regular(rows[-1] / rate, rate, len(robots.model.plant.commands))
    initial = np.zeros((4, robots.size, 1))
    initial[1, :, 0] = start
    rows_of_loop = len(inputs.t) - 1
    t = np.arange(rows_of_loop + 1) / rate
    if watch.noise.in_loop:
        noise = watch.noise.draw(t, 4, robots.size, rng)
        in_loop, on_window = noise[:-1, :, :, None], noise[rows, :2]
    else:
        in_loop, on_window = None, watch.noise.draw(t[rows], 2, robots.size, rng)
    run = simulator.close_loop(robots, inputs, initial, feedback, np.zeros((rows_of_loop, 4, 1)), in_loop)
    seen = run.coordinates[rows, :, :, 0]
    within = np.all(np.abs(seen) < np.array([watch.rail, FALLEN])[:, None], axis=1)  # NaN is not within
    going = np.logical_and.accumulate(within, axis=0)
    last = np.maximum(going.sum(axis=0) - 1, 0)
    at = np.minimum(np.arange(len(rows))[:, None], last)
    shown = np.take_along_axis(seen, at[:, None], axis=0) + on_window
    return np.moveaxis(shown, 2, 0).astype(np.float32), int(np.sum(~going[-1]))


def _sizes(samples: int) -> list[int]:
    """Robots of each of `PARTS`."""
    small = [round(share * samples) for share in SHARES[1:]]
    return [samples - sum(small), *small]
