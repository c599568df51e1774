"""`task=dataset`: simulated robots under random loads, to learn the equilibrium pitch from (paper, Sec. IV-B)."""

import hashlib
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wipx.core.errors import InputError
from wipx.core.locked import locked
from wipx.core.model import Model, ModelBatch
from wipx.identify.adaptation import AdaptationProblem, Adapted, LoadedTrials
from wipx.identify.method import Method
from wipx.learn.dataset import ObservationNoise, Watch, check_labels, generate
from wipx.learn.dataset_file import read_training_set, write_training_set
from wipx.learn.loads import LoadRanges
from wipx.learn.training_set import PARTS, TrainingSet
from wipx.recordings.model_file import model_from_mapping, read_model
from wipx.report.numbers import significant
from wipx.sim.cache import simulator_digest
from wipx.sim.simulator import StateFeedback
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run
from wipx.tasks.shared.adapted import adaptation_problem, adapted_simulation, loaded_trials
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.trials import TrialPlan, trials_of

FOLDER = Path("runs/datasets")
DECIDING = ("method", "friction", "sim", "objective", "optimizer", "plant", "effects", "bounds")  # beside the trials
TYPICAL_OF = 20  # draws of a method with random numbers, of which the one with the median loss is typical


@dataclass(frozen=True)
class Dataset:
    """Make the training set of one method.

    Attributes:
        samples: Robots, 8:1:1 for training, validation and test.
        length: Samples of a window.
        period: Time between them [s].
        mass: Range of the loads' masses [kg].
        height: Range of their heights above the wheel axis [m].
        side: Range of their places beside the body's axis [m].
        lean: Largest pitch from which robots start [rad].
        rail: Half its length [m].
        noise_amplitude: A of the paper's Eq. 6 [m and rad].
        noise_spread: B [1].
        noise_frequency: f [Hz].
        noise_in_loop: Whether the regulator measures with this noise.
        checked: Robots whose label is compared with where they really balance.
        held_out: Loads that the adaptation does not see.
        per_load: Trials with each load.
        duration: Of a trial [s].
        trial_seed: Of what differs between trials of an emulated robot.
    """

    samples: int = 1500
    length: int = 80
    period: float = 0.015
    mass: tuple[float, float] = LoadRanges.mass
    height: tuple[float, float] = LoadRanges.height
    side: tuple[float, float] = LoadRanges.side
    lean: float = Watch.lean
    rail: float = Watch.rail
    noise_amplitude: float = ObservationNoise.amplitude
    noise_spread: float = ObservationNoise.spread
    noise_frequency: float = ObservationNoise.frequency
    noise_in_loop: bool = False
    checked: int = 40
    held_out: tuple[str, ...] = ()
    per_load: int = 5
    duration: float = 1.25
    trial_seed: int = 0

    def __post_init__(self) -> None:
        if self.checked < 1:
            raise InputError(f"task.checked is {self.checked}, expected 1 or more robots")
        self.watch()  # refuses what is at fault before anything is recorded
        self.plan()

    def watch(self) -> Watch:
        """What is simulated."""
        noise = ObservationNoise(self.noise_amplitude, self.noise_spread, self.noise_frequency, self.noise_in_loop)
        ranges = LoadRanges(self.mass, self.height, self.side)
        return Watch(ranges, self.samples, self.length, self.period, self.lean, self.rail, noise)

    def plan(self) -> TrialPlan:
        """Trials to which the simulation is adapted."""
        return TrialPlan(self.per_load, self.duration, self.trial_seed)

    def run(self, job: Job) -> None:
        """Make the training set or find it, draw it; nothing where it was done before."""
        before = finished(job)
        if before is not None and Path(before["path"]).is_file():
            log_run(job)
            print(f"{job.out}: finished before, nothing to do")
            return
        started = time.perf_counter()
        training = training_set_of(job, self).training
        seconds = time.perf_counter() - started
        path = FOLDER / f"{training.card['name']}.parquet"
        with written_together(job.out) as folder:
            _draw(training, folder)
            finish(job, folder, {"path": str(path), "seconds": seconds, "card": training.card})
            _note(job, folder, training)
        log_run(job)
        print(_summary(training, path, seconds))


class SimulatedRobots(NamedTuple):
    """What a method gives to learn from.

    Attributes:
        training: The training set.
        model: The simulation that it comes from, without load; of a method with random numbers the draw
            whose loss is the median.
        feedback: The controller that closes their loop, and its rate [Hz].
    """

    training: TrainingSet
    model: Model
    feedback: tuple[StateFeedback, float]


def training_set_of(job: Job, settings: Dataset) -> SimulatedRobots:
    """The training set of the chosen method and target; made now if it does not exist.

    It is kept in `FOLDER` under a name that stands for everything that decides it: trials, settings, seed.
    Parallel jobs that need the same one wait until the first has made it.

    Raises:
        InputError: the target cannot be run, the settings or a file are at fault.
    """
    source = trials_of(job, settings.plan())
    trials = loaded_trials(source)
    name = _digest(job, settings, trials)
    path = FOLDER / f"{name}.parquet"
    with locked(FOLDER / f".{name}.lock"):
        if not path.is_file():
            problem = adaptation_problem(job, source, trials, settings.held_out)
            write_training_set(_made(job, settings, problem, name), path)
    training = read_training_set(path)
    return SimulatedRobots(training, _typical(training, path), trials.feedback)


def _made(job: Job, settings: Dataset, problem: AdaptationProblem, name: str) -> TrainingSet:
    """Adapt, simulate, check."""
    method: Method = job.part("method")
    adapted = adapted_simulation(job, problem, TYPICAL_OF)
    rng = np.random.default_rng((job.seed, 1))  # not the numbers of the search
    simulations = _simulations(adapted, problem, method, settings.samples, rng)
    simulator, watch = job.part("sim"), settings.watch()
    training = generate(simulations, problem.trials.feedback, simulator, watch, rng)
    check = check_labels(simulations, training, simulator, settings.checked, rng)
    space = problem.fit.space
    card = {
        **training.card,
        "name": name,
        "seed": job.seed,
        "method": job.chosen.get("method"),
        "physics": method.physics,
        "values": method.values,
        "reach": method.reach if method.values == "random" else None,
        "optimizer": job.chosen.get("optimizer") if method.values == "optimised" else None,
        "engine": job.chosen.get("sim"),
        "gap": asdict(adapted.fit),
        "numbers": {p.name: [p.low, p.high] for p in space.free},
        "model": _plain(adapted.models[0]),
        "label_check": check,
    }
    return replace(training, card=card)


def _simulations(
    adapted: Adapted, problem: AdaptationProblem, method: Method, samples: int, rng: np.random.Generator
) -> ModelBatch:
    """One simulation, or as many as there are samples where numbers are drawn at random."""
    if method.values != "random":
        return ModelBatch(adapted.models[0])
    return problem.fit.space.batch(problem.fit.space.sample(samples, rng, method.reach))


def _digest(job: Job, settings: Dataset, trials: LoadedTrials) -> str:
    """Short name of everything that decides a training set."""
    feedback, rate = trials.feedback
    deciding = {key: job.settings[key] for key in DECIDING}
    deciding["model"] = None if job.model_path is None else _plain(read_model(job.model_path))
    deciding |= {"seed": job.seed, "dataset": asdict(settings), "loop": [feedback.gains.tolist(), rate]}
    deciding["simulator"] = simulator_digest()
    digest = hashlib.sha256(json.dumps(deciding, sort_keys=True).encode())
    for recording, load in zip(trials.recordings, trials.loads, strict=True):
        digest.update(f"{recording.name} {load}".encode())
        for column in recording.columns.values():
            digest.update(column.tobytes())
    return digest.hexdigest()[:12]


def _typical(training: TrainingSet, path: Path) -> Model:
    content: Any = training.card.get("model")
    if not isinstance(content, dict):
        raise InputError(f"{path}: the card has no model; remove the file and run task=dataset again")
    return model_from_mapping(content, str(path))


def _plain(model: Model) -> dict[str, object]:
    effects = {name: dict(values) for name, values in model.effects.items()}
    return {"plant": model.plant.kind, "parameters": dict(model.parameters), "effects": effects}


def _draw(training: TrainingSet, folder: Path) -> None:
    from wipx.report.training_figures import draw_labels, draw_windows

    t = training.period * np.arange(training.windows.shape[1])
    draw_labels({part: training.of(part).pitch for part in PARTS}, folder / "labels.png")
    draw_windows(t, training.windows, training.pitch, folder / "windows.png")


def _summary(training: TrainingSet, path: Path, seconds: float) -> str:
    card: Any = training.card
    check, pitch = card["label_check"], training.pitch
    sizes = ", ".join(f"{count} {part}" for part, count in card["parts"].items())
    off, band, miss = (significant(check[key]) for key in ("largest_difference", "largest_dead_band", "largest_miss"))
    return "\n".join(
        [
            f"training set: {path} ({sizes}; digest {card['digest']}), {seconds:.1f} s",
            f"  {card['method']} in {card['engine']}, seed {card['seed']}; balance at {pitch.min():.3f} to "
            f"{pitch.max():.3f} rad; {card['stopped']} robots fell or reached the end of the rail",
            f"  {check['robots']} labels compared with the simulated balance: at most {off} rad from the middle of a "
            f"dead band of +-{band} rad, {miss} rad outside of it",
        ]
    )


def _note(job: Job, folder: Path, training: TrainingSet) -> None:
    card: Any = training.card
    figures = {_check_metric(key): float(value) for key, value in card["label_check"].items()}
    figures |= {"robots stopped": float(card["stopped"]), "reality gap": float(card["gap"]["value"])}
    note_run(
        job,
        folder,
        f"training set {card['method']} seed {job.seed}",
        metrics=figures,
        tags={"method": str(card["method"]), "engine": str(card["engine"]), "training_set": str(card["name"])},
    )


def _check_metric(key: str) -> str:
    return f"label check/{key}" if key == "robots" else f"label check/{key.replace('_', ' ')} in rad"
