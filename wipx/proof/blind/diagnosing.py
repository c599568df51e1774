"""Second process of a blind run: a method diagnoses one case, watched, and sees nothing but its recordings."""

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import wipx.proof.blind_robots
from wipx.core.errors import InputError
from wipx.proof.blind_robots import witness
from wipx.proof.blind_robots.folder import RunFolder, read_json
from wipx.proof.blind_robots.seal import digest_of_folder
from wipx.proof.blind_robots.witness import READ, REFUSED
from wipx.tasks.files.results import write_json

OURS = "wipx"
ONE_THREAD = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # a worker has one core


class StoppedError(Exception):
    """The run was interrupted while a method was at work."""


@dataclass(frozen=True)
class Answer:
    """What is noted of an answer before its case is opened.

    Attributes:
        sha256: Digest of all its files, see `seal.digest_of_folder`.
        seconds: Time that it took [s].
        failure: Why there is none; empty where there is one.
        opened: Files of the run that the method opened to read or write.
        refused: What it asked for and was refused.
    """

    sha256: str
    seconds: float
    failure: str
    opened: int
    refused: tuple[str, ...]


class Diagnosers:
    """The processes that diagnose, which can all be stopped at once.

    Attributes:
        folder: Of the run.
        time_limit: For one answer [s].
    """

    def __init__(self, folder: RunFolder, time_limit: float) -> None:
        self.folder = folder
        self.time_limit = time_limit
        self._running: set[subprocess.Popen[str]] = set()
        self._stopped = threading.Event()

    def answer(self, case: str) -> None:
        """Let all methods answer a case, one after the other, and note digests of their answers.

        Raises:
            StoppedError: `stop` was called.
        """
        if self.folder.answers(case).is_file():
            return
        answers = {method: asdict(self._answer_of(case, method)) for method in methods_of(self.folder, case)}
        draft = self.folder.answers(case).with_suffix(".part")
        write_json(draft, {"schema": 1, "written": now(), "answers": answers})
        draft.replace(self.folder.answers(case))

    def stop(self) -> None:
        """End what is at work; further answers are refused."""
        self._stopped.set()
        for process in tuple(self._running):
            process.terminate()

    def _answer_of(self, case: str, method: str) -> Answer:
        place, log = self.folder.answer(case, method), self.folder.witnessed(case, method)
        shutil.rmtree(place, ignore_errors=True)  # of an interrupted run
        place.mkdir(parents=True)
        begun = time.perf_counter()
        failure = self._watched(self._settings(case, method), _arguments(self.folder.recordings(case), method, place))
        seconds = time.perf_counter() - begun
        lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
        own = f"{READ} {self.folder.path.resolve()}{os.sep}"
        return Answer(
            digest_of_folder(place),
            seconds,
            failure,
            sum(line.startswith(own) for line in lines),
            tuple(line.removeprefix(f"{REFUSED} ") for line in lines if line.startswith(REFUSED)),
        )

    def _settings(self, case: str, method: str) -> str:
        """Of the witness: nothing of the run but the case's recordings, and nothing of the code that drew them."""
        folder = self.folder
        return json.dumps(
            {
                "guarded": [str(folder.path.resolve()), str(Path(wipx.proof.blind_robots.__file__).parent)],
                "allowed": [
                    str(folder.recordings(case).resolve()),
                    str(folder.answer(case, method).resolve()),
                    witness.__file__,  # warnings show the line of the program that was started
                ],
                "log": str(folder.witnessed(case, method).resolve()),
            }
        )

    def _watched(self, settings: str, arguments: list[str]) -> str:
        """Run a task under the witness; returns why it failed, empty where it did not."""
        if self._stopped.is_set():
            raise StoppedError
        process = subprocess.Popen(
            [sys.executable, "-m", "wipx.proof.blind_robots.witness", settings, *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=ONE_THREAD,
            start_new_session=True,  # Ctrl-C reaches this process alone, which then ends the others
        )
        self._running.add(process)
        try:
            _, error = process.communicate(timeout=self.time_limit)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return f"no answer within {self.time_limit:g} s"
        except KeyboardInterrupt:
            process.kill()
            raise
        finally:
            self._running.discard(process)
        if self._stopped.is_set():
            raise StoppedError
        return _failure(process.returncode, error)


def methods_of(folder: RunFolder, case: str) -> tuple[str, ...]:
    """The methods that answer a case, as the published settings of the run say."""
    content = read_json(folder.commitments)
    compared = [entry["case"] for entry in content["cases"]][: content["settings"]["baselines_cases"]]
    return (OURS, *(content["settings"]["baselines"] if case in compared else ()))


def check_methods(methods: Iterable[str]) -> None:
    """Refuse methods that do not exist, before any robot is drawn.

    Raises:
        InputError: the program does not know one of them.
    """
    begun = {
        method: subprocess.Popen(
            [sys.executable, "-m", "wipx", *_task(method), "--cfg", "job"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        for method in methods
    }
    errors = {method: process.communicate()[1] for method, process in begun.items()}
    for method, process in begun.items():
        if process.returncode != 0:
            raise InputError(f"task.baselines: {method}: {_last_line(errors[method])}")


def _task(method: str) -> list[str]:
    return ["task=diagnose"] if method == OURS else ["task=baseline", f"baseline={method}"]


def _arguments(recordings: Path, method: str, out: Path) -> list[str]:
    places = [f"recordings.path='{recordings.resolve()}'", f"hydra.run.dir='{out.resolve()}'"]
    return [*_task(method), "tracking=none", "sim.threads=1", *places]


def _failure(status: int, error: str) -> str:
    """Why a run of this program failed, from its exit status and standard error; empty where it did not."""
    return "" if status == 0 else f"exit status {status}: {_last_line(error)}"


def _last_line(error: str) -> str:
    return (error.strip().splitlines() or ["no message"])[-1]


def read_answers(path: Path) -> dict[str, Answer]:
    """The answers that are noted in a file, by method.

    Raises:
        InputError: the file is missing or damaged.
    """
    content = read_json(path)
    try:
        return {
            method: Answer(**{**noted, "refused": tuple(noted["refused"])})
            for method, noted in content["answers"].items()
        }
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no list of answers ({error}); restore it, or start another run") from error


def now() -> str:
    """The time of day, UTC, to the second."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
