"""`task=log_runs`: log finished runs that MLflow does not have yet, from their folders."""

from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from wipx.core.errors import InputError
from wipx.tasks.shared.job import Job
from wipx.tracking.run_note import RUN


@dataclass(frozen=True)
class LogRuns:
    """Log runs that could not be logged when they finished.

    Attributes:
        experiment: Name of a sweep, whose folder is runs/NAME.
        folder: That holds runs, at any depth, in place of a name.
    """

    experiment: str | None = None
    folder: str | None = None

    def run(self, job: Job) -> None:
        """Log run after run; those that the tracking store has are left alone.

        Raises:
            InputError: the folder has no run, or the store cannot be reached.
        """
        place = Path(self.folder) if self.folder is not None else Path("runs") / (self.experiment or "")
        folders = sorted(path.parent for path in place.rglob(RUN))
        if not folders:
            raise InputError(f"{place}: no finished run here; give task.folder=FOLDER")
        tracking = job.part("tracking")
        logged = 0
        for folder in tqdm(folders, desc="log", leave=False, disable=None):
            logged += tracking.send(folder)
        print(f"{len(folders)} runs in {place}: {logged} logged, {len(folders) - logged} logged before")
