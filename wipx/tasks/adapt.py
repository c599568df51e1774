"""`task=adapt`: make the simulation resemble trials of a robot with known loads (paper, Algorithm 1)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wipx.core.adaptation import AdaptationResult
from wipx.core.errors import check_positive
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.identify.adaptation import AdaptationProblem, Adapted
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.report.numbers import significant
from wipx.tasks.files.adaptation import plain_adaptation, write_trajectories
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run, parameter_metrics, recorded_data
from wipx.tasks.shared.adapted import adaptation_problem, adapted_simulation, loaded_trials
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.trials import TrialPlan, trials_of
from wipx.tracking.run_note import DataNote


@dataclass(frozen=True)
class Adapt:
    """Adapt a simulation to a target, by one method.

    Attributes:
        held_out: Loads by which the simulation is judged; the search does not see them.
        draws: Simulations of a method with random numbers.
        per_load: Trials with each load.
        duration: Of a trial [s].
        trial_seed: Of what differs between trials of an emulated robot.
    """

    held_out: tuple[str, ...] = ()
    draws: int = 20
    per_load: int = 5
    duration: float = 1.25
    trial_seed: int = 0

    def __post_init__(self) -> None:
        check_positive(draws=self.draws, per_load=self.per_load, duration=self.duration)

    def run(self, job: Job) -> None:
        """Record or read the trials, adapt, write; nothing where it was done before."""
        if finished(job) is not None:
            log_run(job)
            print(f"{job.out}: finished before, nothing to do")
            return
        source = trials_of(job, TrialPlan(self.per_load, self.duration, self.trial_seed))
        problem = adaptation_problem(job, source, loaded_trials(source), self.held_out)
        adapted = adapted_simulation(job, problem, self.draws)
        result = _result(job, source, adapted, problem)
        with written_together(job.out) as folder:
            _write(job, folder, result, adapted.models[0])
            data = recorded_data(source, problem.trials.recordings, "adaptation")
            _note(job, folder, result, problem.nominal.plant, data)
        log_run(job)
        print(_summary(result))


def _result(job: Job, source: RecordingSource, adapted: Adapted, problem: AdaptationProblem) -> AdaptationResult:
    history = adapted.history
    return AdaptationResult(
        method=str(job.chosen["method"]),
        optimizer=str(job.chosen["optimizer"]) if history is not None else "",
        engine=str(job.chosen["sim"]),
        seed=job.seed,
        target=source.place,
        fit=adapted.fit,
        held_out=adapted.held_out,
        parameters=adapted.parameters,
        intervals=adapted.intervals,
        history=history,
        coordinates=problem.nominal.plant.coordinates,
        classes=adapted.classes,
    )


def _write(job: Job, folder: Path, result: AdaptationResult, model: Model) -> None:
    from wipx.report.adaptation_figures import draw_convergence, draw_trajectories

    write_model(model, folder / "model.yaml")
    draw_trajectories([result], folder / "trajectories.png")
    if result.history is not None:
        draw_convergence([result], folder / "search.png")
    write_trajectories(result, folder)
    finish(job, folder, plain_adaptation(result))


def _summary(result: AdaptationResult) -> str:
    how = f", {result.optimizer}" if result.optimizer else ""
    lines = [f"{result.method} in {result.engine}{how}, seed {result.seed}; Eq. 7 in m^2 and rad^2"]
    parts = {"fitted loads": result.fit, "held-out loads": result.held_out}
    for name, loss in parts.items():
        if loss is not None:
            spread = "" if loss.low == loss.high else f" [{significant(loss.low)}, {significant(loss.high)}]"
            lines.append(f"  {name}: {significant(loss.value)}{spread}, noise floor {significant(loss.floor)}")
    return "\n".join(lines)


def _note(job: Job, folder: Path, result: AdaptationResult, plant: Plant, data: DataNote) -> None:
    losses = {"fit": result.fit, "heldout": result.held_out}
    figures = {f"{part}/loss": loss.value for part, loss in losses.items() if loss is not None}
    figures |= {f"{part}/floor": loss.floor for part, loss in losses.items() if loss is not None}
    figures |= parameter_metrics(result.parameters, plant)
    history, histories = result.history, {}
    if history is not None:
        histories["search/best_loss"] = np.column_stack([history.evaluations, history.best_loss])
        figures["search/evaluations"] = float(history.evaluations[-1])
        figures["search/time in s"] = float(history.seconds[-1])
    note_run(
        job,
        folder,
        f"{result.method} {result.optimizer} seed {result.seed}".replace("  ", " "),
        metrics=figures,
        histories=histories,
        tags={"method": result.method, "optimizer": result.optimizer, "engine": result.engine, "target": result.target},
        data=[data],
    )
