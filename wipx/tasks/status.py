"""`task=status`: how far a sweep is; reads its folder only, so that it can be asked anywhere and at any time."""

from dataclasses import asdict, dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.tasks.files.results import write_json, written_together
from wipx.tasks.files.sweep_folder import JobState, read_plan, states
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.sweep_progress import SweepProgress, duration

SHOWN = 10  # jobs of a state that are listed; status.json has all


@dataclass(frozen=True)
class Status:
    """Tell how far a sweep is.

    Attributes:
        experiment: Name of the sweep, whose folder is runs/NAME.
        folder: Of the sweep, in place of a name.
    """

    experiment: str | None = None
    folder: str | None = None

    def run(self, job: Job) -> None:
        """Print counts, time left, and the jobs that are not done; write status.json.

        Raises:
            InputError: no sweep was started there.
        """
        sweep = self._sweep()
        plan = read_plan(sweep)
        progress = SweepProgress.of(states(sweep, plan))
        print(f"{sweep}, {plan.launcher}, started {duration(progress.now - plan.started)} ago")
        print(progress.line())
        for state in ("failed", "running", "missing"):
            for line in _listed(progress, state):
                print(line)
        if progress.named("failed") or (progress.named("missing") and not progress.named("running")):
            print("run the sweep again, which does the missing and the failed jobs only")
        with written_together(job.out) as folder:
            content = [asdict(one) for one in progress.jobs]
            write_json(folder / "status.json", {"schema": 1, "seconds_left": progress.seconds_left, "jobs": content})

    def _sweep(self) -> Path:
        if self.folder is not None:
            return Path(self.folder)
        if self.experiment is None:
            raise InputError("task=status: which sweep? give experiment=NAME, or task.folder=FOLDER")
        return Path("runs") / self.experiment


def _listed(progress: SweepProgress, state: str) -> list[str]:
    jobs = progress.named(state)
    lines = [f"  {state:8}{job.name}{_detail(job, progress.now)}" for job in jobs[:SHOWN]]
    return lines if len(jobs) <= SHOWN else [*lines, f"  {state:8}and {len(jobs) - SHOWN} more"]


def _detail(job: JobState, now: float) -> str:
    if job.state == "running" and job.note is not None:
        return f" on {job.note.host}, for {duration(now - job.note.started)}"
    return f": {job.error}" if job.error else ""
