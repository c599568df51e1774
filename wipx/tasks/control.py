"""`task=control`: balance or track under loads that the controller does not know (paper, Sec. V-C and VI-B)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from wipx.control.controller import Controller
from wipx.control.loop import ControlLoop
from wipx.core.control_result import ControlResult, ControlTrial
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.hardware.target import Target
from wipx.hardware.testbed import EmulatedTestbed
from wipx.learn.estimator import Recipe, Workshop
from wipx.report.numbers import significant
from wipx.tasks.dataset import Dataset, SimulatedRobots, training_set_of
from wipx.tasks.files.control import plain_control, write_courses
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run, training_data
from wipx.tasks.shared.control_metrics import TrialJudge
from wipx.tasks.shared.control_scenarios import SCENARIOS, Scenario, ScenarioName
from wipx.tasks.shared.driven import driven_target
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress


@dataclass(frozen=True)
class Control:
    """Drive a target by one controller in one scenario.

    Model and, for a controller that asks one, estimator come from the simulation of the chosen method. Every
    controller has the same state estimate with that model, so that they differ in nothing else.

    Attributes:
        dataset: Settings of the training set, as of task=dataset.
        recorded_with: Controller of the trials that the simulation is adapted to.
        scenario: What is done.
        loads: Names of the target's loads.
        per_load: Trials with each.
        length: Samples of the estimator's window.
        trial_seed: Of what differs between trials of an emulated robot; the same for every controller.
        short_rail: Half the rail of an emulated robot [m].
        long_rail: Likewise, where a trial is judged only after the robot has settled.
        step: Of an emulated robot's engine [s].
        near: Distance to the reference within which a robot has recovered [m].
        upright: Distance to its balance, likewise [rad].
    """

    dataset: dict[str, Any] = field(default_factory=dict)
    recorded_with: dict[str, Any] = field(default_factory=dict)
    scenario: ScenarioName = "balancing"
    loads: tuple[str, ...] = ("a1", "a2", "a3", "b4", "b5")
    per_load: int = 5
    length: int = 30
    trial_seed: int = 2
    short_rail: float = 2.25
    long_rail: float = 4.0
    step: float = 2e-4
    near: float = 0.4
    upright: float = 0.06

    def __post_init__(self) -> None:
        check_positive(per_load=self.per_load, short_rail=self.short_rail, long_rail=self.long_rail, step=self.step)
        self.judge()
        if not self.loads:
            raise InputError("task.loads is empty; name loads of the target")

    def judge(self) -> TrialJudge:
        """What counts."""
        return TrialJudge(SCENARIOS[self.scenario], self.near, self.upright)

    def run(self, job: Job) -> None:
        """Prepare model and controller, run all trials, judge, write; nothing where it was done before."""
        if finished(job) is not None:
            log_run(job)
            print(f"{job.out}: finished before, nothing to do")
            return
        target = self._target(job)
        settings: Dataset = job.build(self.dataset, "task.dataset")
        if not 2 <= self.length <= settings.length:
            raise InputError(
                f"task.length is {self.length}, expected 2 to {settings.length}, the samples of the training set"
            )
        with written_together(job.out) as folder:
            robots = training_set_of(self._recording(job), settings)
            controller: Controller = job.part("controller")
            trials = self._trials(target, self.loop(job, controller, robots, folder))
            result = self._result(job, robots, target, trials, estimates=controller.asks_estimator)
            _write(job, folder, result)
            _note(job, folder, result, robots.training.card)
        log_run(job)
        print(_summary(result))

    def _target(self, job: Job) -> Target:
        """The robot; an emulated one with the rail, the step and the loads of the scenario."""
        target, scenario = driven_target(job, job.out), SCENARIOS[self.scenario]
        for name in self.loads:
            if name not in target.loads:
                raise unknown_name("load", name, target.loads, "task.loads")
        if isinstance(target, EmulatedTestbed):
            placed = replace(target, rail=self._rail, weights=_placed(target.weights, scenario))
            return placed.stepping(self.step)
        if scenario.has_events or scenario.mirrored:
            raise InputError(
                f"task.scenario={self.scenario} needs target=emulated; a robot can do balancing or tracking"
            )
        return target

    @property
    def _rail(self) -> float:
        """Half the rail of the scenario [m]."""
        return self.long_rail if SCENARIOS[self.scenario].needs_room else self.short_rail

    def _recording(self, job: Job) -> Job:
        """The same job with the controller under which trials for the adaptation are recorded."""

        def part(group: str) -> Any:
            return job.build(self.recorded_with, "task.recorded_with") if group == "controller" else job.part(group)

        return replace(job, part=part, settings={**job.settings, "controller": self.recorded_with})

    def loop(self, job: Job, controller: Controller, robots: SimulatedRobots, folder: Path) -> ControlLoop:
        """A controller on the adapted simulation; its estimator is trained now where it needs one.

        Args:
            job: Has estimator, simulator and seed.
            controller: What drives the robot.
            robots: The simulation, and what is learned from.
            folder: Takes what the estimator keeps.
        """
        controller = controller.on_rail(self._rail)
        if not controller.asks_estimator:
            return controller.loop(robots.model)
        recipe: Recipe = job.part("estimator")
        training = robots.training.first(self.length)
        workshop = Workshop(training, robots.model, job.part("sim"), robots.feedback, job.seed, folder)
        with StageProgress("train") as progress:
            return controller.loop(robots.model, recipe.prepare(workshop, progress))

    def _trials(self, target: Target, loop: ControlLoop) -> tuple[ControlTrial, ...]:
        """All trials, judged as they come."""
        judge, scenario, nominal = self.judge(), SCENARIOS[self.scenario], target.nominal()
        pitches = {name: target.loads[name].equilibrium(nominal) for name in self.loads}
        planned = [(i, name, k) for i, name in enumerate(self.loads) for k in range(self.per_load)]
        judged = []
        for i, name, k in tqdm(planned, desc=self.scenario, leave=False, disable=None):
            trial = scenario.trial(f"{name}_{k + 1}.csv", name)
            (recording,) = target.run([trial], loop, np.random.default_rng([self.trial_seed, i, k]))
            trial = judge.judged(recording, name, k + 1, pitches[name], loop.balance)
            judged.append(replace(trial, notes=loop.notes))
        return tuple(judged)

    def _result(
        self, job: Job, robots: SimulatedRobots, target: Target, trials: tuple[ControlTrial, ...], *, estimates: bool
    ) -> ControlResult:
        scenario = SCENARIOS[self.scenario]
        card: Any = robots.training.card
        return ControlResult(
            controller=str(job.chosen["controller"]),
            method=str(job.chosen["method"]),
            estimator=str(job.chosen["estimator"]) if estimates else "",
            scenario=self.scenario,
            target=str(job.chosen["target"]),
            seed=job.seed,
            gap=float(card["gap"]["value"]),
            begin=scenario.begin,
            duration=scenario.duration,
            rail=self._rail,
            wheel_radius=robots.model.parameters["wheel_radius"],
            loads={name: target.loads[name] for name in self.loads},
            trials=trials,
        )


def _placed(weights: Mapping[str, Mapping[str, float]], scenario: Scenario) -> dict[str, dict[str, float]]:
    """The weights where the scenario has them."""
    sign = -1.0 if scenario.mirrored else 1.0
    return {name: {**place, "side": sign * place["side"]} for name, place in weights.items()}


def _write(job: Job, folder: Path, result: ControlResult) -> None:
    from wipx.report.control_figures import draw_errors

    write_courses(result, folder)
    draw_errors([result], folder / "errors.png")
    finish(job, folder, plain_control(result))


def _summary(result: ControlResult) -> str:
    by = f", {result.estimator} trained in {result.method}" if result.estimator else ""
    lines = [
        f"{result.controller}{by}: {result.scenario}, {len(result.trials)} trials, {result.failures} stopped; "
        "RMSE of position and of pitch from balance"
    ]
    for name in result.loads:
        own = result.of(name)
        x, pitch = (float(np.mean(v)) for v in ([t.rmse_x for t in own], [t.rmse_pitch for t in own]))
        stopped = sum(trial.failure is not None for trial in own)
        lines.append(
            f"  {name} at {own[0].pitch:+.3f} rad: {significant(x)} m, {significant(pitch)} rad, "
            f"{stopped} of {len(own)} stopped"
        )
    return "\n".join(lines)


def _note(job: Job, folder: Path, result: ControlResult, card: Mapping[str, Any]) -> None:
    trials = result.trials
    figures = {
        "trials stopped": float(result.failures),
        "reality gap": result.gap,
        "rmse/position in m": float(np.mean([trial.rmse_x for trial in trials])),
        "rmse/pitch from balance in rad": float(np.mean([trial.rmse_pitch for trial in trials])),
        "rmse/pitch from target in rad": float(np.mean([trial.rmse_target for trial in trials])),
    }
    errors = [trial.estimate - trial.pitch for trial in trials if trial.estimate is not None]
    times = [trial.recovery for trial in trials if trial.recovery is not None]
    figures["trials recovered"] = float(len(times))
    if times:
        figures["recovery/median time in s"] = float(np.median(times))
    if errors:
        figures["estimate/rmse in rad"] = float(np.sqrt(np.mean(np.square(errors))))
    note_run(
        job,
        folder,
        f"{result.controller} {result.scenario} {result.method} seed {result.seed}",
        metrics=figures,
        tags={"controller": result.controller, "scenario": result.scenario, "method": result.method},
        data=[training_data(card)],
    )
