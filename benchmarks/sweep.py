"""What a sweep costs beside the work of its jobs: composing, importing, noting, logging to MLflow.

    python benchmarks/sweep.py [JOBS]        (1000 unless given)

The jobs do nothing but note a run with ten metrics. Printed is the processor time of the whole program, per job and for
its start, which a launcher with a process for each job (submitit, Slurm) pays for every job.
"""

import resource
import subprocess
import sys
import tempfile
import types
from dataclasses import dataclass
from pathlib import Path

from wipx.app import main
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run
from wipx.tasks.shared.job import Job

CHILD = "--child"


@dataclass(frozen=True)
class Nothing:
    """A job without work."""

    def run(self, job: Job) -> None:
        """Note and log a run."""
        if finished(job) is not None:
            return
        with written_together(job.out) as folder:
            finish(job, folder, {"seed": job.seed})
            note_run(job, folder, f"seed {job.seed}", metrics={f"m{i}": float(i) for i in range(10)}, tags={})
        log_run(job)


def sweep() -> int:
    """Run the sweep that the command line asks for, with `Nothing` among the tasks."""
    sys.argv.remove(CHILD)
    Nothing.__module__ = "wipx.nothing"
    module = types.ModuleType("wipx.nothing")
    vars(module)["Nothing"] = Nothing
    sys.modules["wipx.nothing"] = module
    return main()


def processor_seconds(folder: Path, jobs: int) -> float:
    """Processor time of a sweep of so many jobs, in a process of its own [s]."""
    options = folder / "options" / "task"
    options.mkdir(parents=True, exist_ok=True)
    (options / "nothing.yaml").write_text("_target_: wipx.nothing.Nothing\n")
    arguments = ["task=nothing", f"name=jobs{jobs}", f"seed=range({jobs})", "-m", "--config-dir", str(options.parent)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, str(Path(__file__).resolve()), CHILD, *arguments], cwd=folder, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def report(jobs: int) -> None:
    """Print what a sweep costs."""
    with tempfile.TemporaryDirectory() as place:
        processor_seconds(Path(place), 2)  # makes the database
        one, all_of_them = (processor_seconds(Path(place), count) for count in (1, jobs))
    per_job = (all_of_them - one) / (jobs - 1)
    print(f"{jobs} jobs: {per_job:.3f} s of processor time for each; start and one job: {one:.2f} s")


if __name__ == "__main__":
    if CHILD in sys.argv:
        sys.exit(sweep())
    report(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
