"""`task=train`: make an estimator of the equilibrium pitch in simulation, judge it there and on a robot."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError
from wipx.core.estimation import EstimationResult, Judged
from wipx.identify.adaptation import LoadedTrials
from wipx.identify.closed_loop import Sampling
from wipx.learn.estimator import Estimator, Recipe, Workshop
from wipx.report.numbers import significant
from wipx.tasks.dataset import Dataset, SimulatedRobots, training_set_of
from wipx.tasks.files.estimation import plain_estimation
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run, recorded_data, training_data
from wipx.tasks.shared.adapted import loaded_trials
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress
from wipx.tasks.shared.trials import trials_of
from wipx.tracking.run_note import DataNote

NETWORK = "estimator.onnx"  # where an estimator leaves its graph
TIMED = 200  # estimates of one window each, of which the median time is taken


@dataclass(frozen=True)
class Train:
    """Train one estimator on one method's training set and judge it.

    Attributes:
        dataset: Settings of the training set, as of task=dataset.
        length: Samples of the window that the estimator sees.
        judged_seed: Of the trials by which it is judged; other ones than those of the adaptation.
    """

    dataset: dict[str, Any] = field(default_factory=dict)
    length: int = 80
    judged_seed: int = 1

    def run(self, job: Job) -> None:
        """Make or read the training set, train, judge, write; nothing where it was done before."""
        if finished(job) is not None:
            log_run(job)
            print(f"{job.out}: finished before, nothing to do")
            return
        settings: Dataset = job.build(self.dataset, "task.dataset")
        if not 2 <= self.length <= settings.length:
            raise InputError(
                f"task.length is {self.length}, expected 2 to {settings.length}, the samples of the training set; "
                "give task.dataset.length=... for longer windows"
            )
        robots = training_set_of(job, settings)
        source = trials_of(job, replace(settings.plan(), seed=self.judged_seed))
        trials = loaded_trials(source)
        with written_together(job.out) as folder:
            result = self._result(job, robots, trials, folder)
            _draw(result, folder)
            finish(job, folder, plain_estimation(result))
            judged_by = recorded_data(source, trials.recordings, "judgement")
            _note(job, folder, result, [training_data(robots.training.card), judged_by])
        log_run(job)
        print(_summary(result))

    def _result(self, job: Job, robots: SimulatedRobots, trials: LoadedTrials, folder: Path) -> EstimationResult:
        training = robots.training.first(self.length)
        recipe: Recipe = job.part("estimator")
        workshop = Workshop(training, robots.model, job.part("sim"), trials.feedback, job.seed, folder)
        begun = time.perf_counter()
        with StageProgress("train") as progress:
            estimator = recipe.prepare(workshop, progress)
        seconds = time.perf_counter() - begun
        test = training.of("test")
        sampling = Sampling(np.arange(self.length) * training.period, trials.feedback[1], at_rest=True)
        columns = robots.model.plant.coordinates
        windows = np.stack([sampling.trajectory(recording, columns) for recording in trials.recordings])
        balance = [0.0 if load is None else load.equilibrium(robots.model) for load in trials.loads]
        return EstimationResult(
            method=str(job.chosen["method"]),
            estimator=str(job.chosen["estimator"]),
            length=self.length,
            period=training.period,
            seed=job.seed,
            target=str(job.chosen["target"]),
            simulated=_judged(estimator, test.windows, test.pitch),
            recorded=_judged(estimator, windows, np.array(balance)),
            latency=_latency(estimator, windows),
            seconds=seconds,
            card=training.card,
        )


def _judged(estimator: Estimator, windows: np.ndarray, pitch: np.ndarray) -> Judged:
    found = estimator.estimate(windows)
    return Judged(pitch, found.pitch, found.low, found.high)


def _latency(estimator: Estimator, windows: np.ndarray) -> float:
    """Median time of one estimate of one window [s]."""
    spent = []
    for i in range(TIMED):
        one = windows[i % len(windows)][None]
        begun = time.perf_counter()
        estimator.estimate(one)
        spent.append(time.perf_counter() - begun)
    return float(np.median(spent))


def _draw(result: EstimationResult, folder: Path) -> None:
    from wipx.report.estimation_figures import draw_estimates

    draw_estimates([result], folder / "estimates.png")


def _summary(result: EstimationResult) -> str:
    lines = [f"{result.estimator}, {result.length} samples, trained in {result.method}, seed {result.seed}"]
    for name, judged in (("simulated robots", result.simulated), (f"{result.target} trials", result.recorded)):
        lines.append(
            f"  {len(judged.pitch)} {name}: RMSE {significant(judged.rmse)} rad, MSE {significant(judged.mse)} rad^2, "
            f"{100.0 * judged.coverage:.0f} % within their 90 % intervals"
        )
    return "\n".join([*lines, f"  one estimate takes {significant(1e3 * result.latency)} ms"])


def _note(job: Job, folder: Path, result: EstimationResult, data: Sequence[DataNote]) -> None:
    figures = {"estimate/time in ms": 1e3 * result.latency, "training/time in s": result.seconds}
    for name, judged in (("sim", result.simulated), ("real", result.recorded)):
        figures |= {
            f"{name}/rmse in rad": judged.rmse,
            f"{name}/mse in rad2": judged.mse,
            f"{name}/coverage of 90 per cent": judged.coverage,
        }
    note_run(
        job,
        folder,
        f"{result.method} {result.estimator} {result.length} seed {result.seed}",
        metrics=figures,
        tags={"method": result.method, "estimator": result.estimator, "target": result.target},
        data=data,
        models={f"pitch-{result.estimator}-{result.length}": NETWORK} if (folder / NETWORK).is_file() else None,
    )
