"""`task=blind_answer`: one case of a blind run as a job of a sweep, so that any launcher hands out cases.

The process that holds the keys starts the sweep and sees in the folder which cases are answered. No job is given a key.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.proof.blind.diagnosing import Diagnosers, StoppedError
from wipx.proof.blind_robots.folder import RunFolder
from wipx.tasks.files.sweep_folder import PLAN, read_plan, states
from wipx.tasks.shared.job import Job

PERIOD = 0.5  # [s] between two looks at the folder


@dataclass(frozen=True)
class BlindAnswer:
    """Let all methods answer one case.

    Attributes:
        folder: Of the run.
        case: Name of the case.
        time_limit: For one diagnosis [s].
    """

    folder: str
    case: str
    time_limit: float = 900.0

    def run(self, job: Job) -> None:
        """Answer, unless the run is interrupted: its keys are on disk then.

        Raises:
            InputError: it is.
        """
        folder = RunFolder(Path(self.folder))
        if folder.paused.is_file():
            raise InputError(f"{folder.path}: the run is interrupted; start it again, which answers {self.case} too")
        Diagnosers(folder, self.time_limit).answer(self.case)


class LaunchedDiagnosers:
    """Jobs that diagnose, one for each case; they take the place of `Diagnosers`."""

    def __init__(self, folder: RunFolder, cases: Sequence[str], time_limit: float, launcher: Sequence[str]) -> None:
        """Start the sweep.

        Args:
            folder: Of the run.
            cases: To be answered.
            time_limit: For one answer [s].
            launcher: What the command line asks of hydra/launcher.
        """
        self._folder, self._stopped = folder, False
        folder.paused.unlink(missing_ok=True)
        place = folder.path.resolve()
        self._log = folder.path / "jobs.log"
        command = [sys.executable, "-m", "wipx", "task=blind_answer", "-m", f"task.folder='{place}'"]
        command += [f"task.case={','.join(cases)}", "label=${task.case}", f"task.time_limit={time_limit}"]
        command += ["tracking=none", f"hydra.sweep.dir='{place / 'jobs'}'", *launcher]
        with self._log.open("w", encoding="utf-8") as log:
            self._sweep = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)

    def answer(self, case: str) -> None:
        """Wait until a case is answered.

        Raises:
            InputError: the sweep has ended without the answer.
            StoppedError: `stop` was called.
        """
        ended = False
        while not self._folder.answers(case).is_file():
            if self._stopped:
                raise StoppedError
            if ended:
                told = self._log.read_text(encoding="utf-8").strip().splitlines() or ["no message"]
                raise InputError(
                    f"{case} was not answered: {told[-1]}; see {self._log}, and run the same command again"
                )
            time.sleep(PERIOD)
            ended = self._sweep.poll() is not None  # then looks once more

    def stop(self) -> None:
        """Let no further job begin, and wait for those at work, since keys are written to disk afterwards."""
        self._folder.paused.touch()
        self._stopped = True
        if self._sweep.poll() is None:
            os.killpg(self._sweep.pid, signal.SIGINT)
        jobs = self._folder.path / "jobs"
        while (jobs / PLAN).is_file() and any(job.state == "running" for job in states(jobs, read_plan(jobs))):
            time.sleep(PERIOD)
        self._sweep.wait()
