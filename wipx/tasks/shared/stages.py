"""Stages of a chain: commands of this program, each in a process and a folder of its own.

A stage is what a user could type; the command stands in its folder, with what it printed.
"""

import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

from wipx.core.errors import InputError
from wipx.tasks.files.finished import SETTINGS

COMMAND, LOG = "command.txt", "log.txt"
INPUT_AT_FAULT = 2
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # of linear algebra on small matrices


@dataclass(frozen=True)
class Stage:
    """One command.

    Attributes:
        name: Of its folder.
        overrides: What it is given, as KEY=VALUE.
        share: Of the chain's time that it usually takes.
    """

    name: str
    overrides: tuple[str, ...]
    share: float


@dataclass
class Chain:
    """Stages one after the other, and some of them side by side.

    Attributes:
        out: Folder of their folders.
        watcher: Told which stages are at work and what share of the chain is done.
        done: That share.
    """

    out: Path
    watcher: Callable[[str, float], None]
    done: float = 0.0
    _running: set[subprocess.Popen] = field(default_factory=set)

    def run(self, *stages: Stage) -> None:
        """Run stages that do not need each other, as many at once as there are cores; finished ones are not repeated.

        Raises:
            InputError: a stage refuses its input, or its folder holds the results of another command.
        """
        workers = min(len(stages), os.cpu_count() or 1)
        self.watcher(" and ".join(stage.name for stage in stages[:workers]), self.done)
        with ThreadPoolExecutor(workers) as pool:
            begun = {pool.submit(self._run, stage, workers): stage for stage in stages}
            try:
                for future in as_completed(begun):
                    future.result()
                    self.done += begun[future].share
                    open_ones = [stage.name for other, stage in begun.items() if not other.done()]
                    self.watcher(" and ".join(open_ones[:workers]), self.done)
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for process in tuple(self._running):
                    process.send_signal(signal.SIGINT)
                raise

    def _run(self, stage: Stage, beside: int) -> None:
        """Run one stage on its share of the cores."""
        folder = self.out / stage.name
        folder.mkdir(parents=True, exist_ok=True)
        arguments = (*stage.overrides, f"hydra.run.dir='{folder}'")
        claim(folder, arguments)
        if (folder / SETTINGS).is_file():
            return
        threads = str(max(1, (os.cpu_count() or 1) // beside))
        environment = {**os.environ, **ONE_THREAD, "NUMBA_NUM_THREADS": threads}
        with (folder / LOG).open("w", encoding="utf-8") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "wipx", *arguments],
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # Ctrl-C reaches this process alone, which then ends the others
            )
            self._running.add(process)
            status = process.wait()
            self._running.discard(process)
        if status == INPUT_AT_FAULT:
            raise InputError(f"stage {stage.name}: {_last_line(folder / LOG)}")
        if status != 0:
            raise RuntimeError(f"stage {stage.name}: exit status {status}, see {folder / LOG}")


def claim(folder: Path, arguments: Sequence[str]) -> None:
    """Note the command whose results a folder takes.

    Raises:
        InputError: the folder belongs to another command.
    """
    line = shlex.join(["python", "-m", "wipx", *arguments])
    note = folder / COMMAND
    before = note.read_text(encoding="utf-8").strip() if note.is_file() else line
    if before != line:
        raise InputError(f"{folder}: made by another command, {before}; set another hydra.run.dir")
    note.write_text(f"{line}\n", encoding="utf-8")


def _last_line(log: Path) -> str:
    return (log.read_text(encoding="utf-8").strip().splitlines() or ["no message"])[-1]
