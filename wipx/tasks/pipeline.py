"""`task=pipeline`: the whole chain on a robot: record, diagnose and complete, learn, balance and track a load.

Recording is done here. All that follows are stages: commands of this program, which stand in their folders.
"""

from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from wipx.control.lqr import Lqr
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.model import Model
from wipx.hardware.excitations import EXCITATIONS
from wipx.hardware.target import Target
from wipx.tasks.files.results import write_csv, written_together
from wipx.tasks.shared.control_scenarios import ScenarioName
from wipx.tasks.shared.driven import driven_target, excited_trial, logged_slower
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress
from wipx.tasks.shared.stages import Chain, Stage, claim
from wipx.tasks.shared.story import leave_story
from wipx.tasks.shared.trials import write_robot

OURS = "lqr_equilibrium"  # controller under a load, unless another one is asked for
EVERYWHERE = ("name", "plant", "seed", "sim", "tracking")  # what every stage may be told
FORWARDED = (*EVERYWHERE, "controller", "estimator", "target")  # what some stage may be told


@dataclass(frozen=True)
class Pipeline:
    """Take a robot that differs from its simulation to one that balances a load that it does not know.

    Attributes:
        fitted: Recordings of the robot without load, under `controller=lqr`, which with a load is the baseline.
        fresh: Further ones, which no fit sees.
        duration: Of each [s].
        log_every: Ticks of the loop per row of the log; a row has the mean of their commands.
        samples: Simulated robots that the estimator learns from.
        length: Samples of the estimator's window.
        loads: Names of the target's loads that the robot has to balance.
        per_load: Trials with each.
        scenarios: What is done with them.
    """

    fitted: int = 5
    fresh: int = 2
    duration: float = 8.0
    log_every: int = 6
    samples: int = 800
    length: int = 30
    loads: tuple[str, ...] = ("a2", "b5")
    per_load: int = 2
    scenarios: tuple[ScenarioName, ...] = ("balancing", "tracking")

    def __post_init__(self) -> None:
        check_positive(
            fitted=self.fitted,
            fresh=self.fresh,
            duration=self.duration,
            log_every=self.log_every,
            samples=self.samples,
            per_load=self.per_load,
        )
        for name, values in {"loads": self.loads, "scenarios": self.scenarios}.items():
            if not values:
                raise InputError(f"task.{name} is empty; name at least one")

    def run(self, job: Job) -> None:
        """Record, run all stages, tell the story."""
        target = self._target(job)
        forwarded = _forwarded(job)
        claim(job.out, job.overrides)
        self._record(job, target)
        with StageProgress("pipeline") as progress:
            chain = Chain(job.out, progress)
            chain.run(self._diagnosis(job, forwarded))
            training = (self._training(job, forwarded, name) for name in ("nominal", "estimator"))
            chain.run(self._prediction(job, forwarded), *training)
            chain.run(*self._driving(job, forwarded))
        print(leave_story(job.out, target, self.scenarios))

    def _target(self, job: Job) -> Target:
        """The robot, if it can be driven and has the loads."""
        target = driven_target(job, job.out)
        for name in self.loads:
            if name not in target.loads:
                raise unknown_name("load", name, target.loads, "task.loads")
        return target

    def _record(self, job: Job, target: Target) -> None:
        """Recordings of the robot without load, in the contract's format; made once."""
        names = [*(f"r{i + 1}.csv" for i in range(self.fitted)), *(f"fresh{i + 1}.csv" for i in range(self.fresh))]
        if (job.out / "recordings").is_dir():
            return
        nominal: Model = job.part("plant").nominal(target.nominal())
        controller = Lqr()
        rng = np.random.default_rng(job.seed)
        trials = [
            excited_trial(name, EXCITATIONS[k % len(EXCITATIONS)], self.duration, nominal, rng)
            for k, name in enumerate(names)
        ]
        with written_together(job.out) as folder:
            (folder / "recordings").mkdir()
            feedback = controller.feedback(nominal), controller.rate
            write_robot(folder / "recordings" / "robot.yaml", nominal, feedback, {}, emulated=target.emulated)
            runs = target.run(trials, controller.loop(nominal), rng)
            for recording in tqdm(runs, desc="record", total=len(trials), leave=False, disable=None):
                slow = logged_slower(recording, self.log_every, controller.rate)
                write_csv(folder / "recordings" / slow.name, dict(slow.columns))

    def _diagnosis(self, job: Job, forwarded: tuple[str, ...]) -> Stage:
        """What the nominal model lacks, from the recordings alone."""
        own = ("task=diagnose", f"recordings.path='{job.out}/recordings'", "recordings.files=['r*.csv']")
        return Stage("diagnosis", (*own, *_of_groups(forwarded, *EVERYWHERE)), 0.6)

    def _prediction(self, job: Job, forwarded: tuple[str, ...]) -> Stage:
        """How well nominal and completed model predict recordings that nothing has seen."""
        own = (
            "task=predict",
            f"recordings.path='{job.out}/recordings'",
            "recordings.files=['fresh*.csv']",
            f"model.path='{job.out}/diagnosis/model.yaml'",
        )
        return Stage("prediction", (*own, *_of_groups(forwarded, *EVERYWHERE)), 0.02)

    def _training(self, job: Job, forwarded: tuple[str, ...], name: str) -> Stage:
        """An estimator of the pitch at which a loaded robot balances, trained in simulation."""
        own = ("task=train", f"task.length={self.length}", *self._simulation(job, name))
        return Stage(name, (*own, *_of_groups(forwarded, *EVERYWHERE, "target", "estimator")), 0.07)

    def _simulation(self, job: Job, name: str) -> tuple[str, ...]:
        """The nominal simulation, or the completed one, and the robots that are simulated in it."""
        completed = ("method=diagnosed", f"model.path='{job.out}/diagnosis/model.yaml'")
        return (
            *(("method=pure_sim",) if name == "nominal" else completed),
            "objective=paper",
            "objective.at_rest=true",
            f"task.dataset.samples={self.samples}",
            "task.dataset.per_load=2",
        )

    def _driving(self, job: Job, forwarded: tuple[str, ...]) -> list[Stage]:
        """The robot under loads that nobody knows: baseline and ours in every scenario."""
        network = job.out / "estimator" / "estimator.onnx"
        trained = ("estimator=trained", f"estimator.path='{network}'")
        everywhere = _of_groups(forwarded, *EVERYWHERE, "target")
        ours = (
            *(_of_groups(forwarded, "controller") or (f"controller={OURS}",)),
            *(trained if network.is_file() else _of_groups(forwarded, "estimator")),
        )
        simulation = self._simulation(job, "estimator")
        loads = (f"task.loads=[{','.join(self.loads)}]", f"task.per_load={self.per_load}", f"task.length={self.length}")
        stages = []
        for scenario in self.scenarios:
            own = ("task=control", f"task.scenario={scenario}", *loads, *simulation, *everywhere)
            share = 0.24 / (2 * len(self.scenarios))
            stages.append(Stage(f"{scenario}-baseline", (*own, "controller=lqr"), share))
            stages.append(Stage(f"{scenario}-ours", (*own, *ours), share))
        return stages


def _forwarded(job: Job) -> tuple[str, ...]:
    """What the command line asked for that the stages are asked for too.

    Raises:
        InputError: it asked for something else than the chain can do.
    """
    kept = []
    for override in job.overrides:
        group = _group_of(override)
        if group != "task" and group not in FORWARDED:
            raise InputError(f"{override}: task=pipeline has no use for it; it takes task and {', '.join(FORWARDED)}")
        if group != "task":
            kept.append(override)
    return tuple(kept)


def _of_groups(overrides: tuple[str, ...], *groups: str) -> tuple[str, ...]:
    return tuple(override for override in overrides if _group_of(override) in groups)


def _group_of(override: str) -> str:
    """Group of an override such as `+controller.rate=500`, or of a part within one, `sim@target.engine=analytic`."""
    return override.lstrip("+~").partition("=")[0].rpartition("@")[2].partition(".")[0]
