"""The folder of a sweep: what its jobs are, and how far each of them is.

sweep.json        the jobs, as what the command line would ask of each
LABEL/job.json    which of them the folder belongs to, who works on it since when, how long it took
LABEL/.running    held while somebody works on it
LABEL/error.txt   why it failed
LABEL/config.yaml it is done
"""

import json
import os
import socket
import time
import uuid
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from wipx.core.errors import InputError
from wipx.core.locked import EXPIRY
from wipx.core.whole_file import write_whole
from wipx.tasks.files.finished import ERROR, SETTINGS

PLAN, JOB, RUNNING = "sweep.json", "job.json", ".running"


@dataclass(frozen=True)
class SweepPlan:
    """The jobs of a sweep.

    Attributes:
        jobs: What each is asked to do, as KEY=VALUE.
        launcher: Option of the group hydra/launcher.
        started: Time at which the sweep was started [s since the epoch].
        identity: Of this start of the sweep.
    """

    jobs: list[list[str]]
    launcher: str
    started: float = field(default_factory=time.time)
    identity: str = field(default_factory=lambda: uuid.uuid4().hex)


@dataclass(frozen=True)
class JobNote:
    """What is noted of a job in its folder.

    Attributes:
        overrides: What it was asked to do, as KEY=VALUE.
        sweep: Identity of the start of the sweep that began it.
        host: Machine that works on it.
        process: Id of the process there.
        started: Time at which it began [s since the epoch].
        seconds: Time that it took [s]; None while it is not done.
    """

    overrides: list[str]
    sweep: str
    host: str = field(default_factory=socket.gethostname)
    process: int = field(default_factory=os.getpid)
    started: float = field(default_factory=time.time)
    seconds: float | None = None


@dataclass(frozen=True)
class JobState:
    """How far a job is.

    Attributes:
        name: Its folder, or what it is asked to do where it has none yet.
        state: Missing is a job that nobody works on and that is neither done nor failed.
        note: None where it was never begun.
        error: First line of what went wrong.
    """

    name: str
    state: Literal["done", "running", "failed", "missing"]
    note: JobNote | None = None
    error: str = ""


def write_plan(sweep: Path, plan: SweepPlan) -> None:
    """Write down the jobs of a sweep."""
    sweep.mkdir(parents=True, exist_ok=True)
    write_whole(sweep / PLAN, json.dumps({"schema": 1, **asdict(plan)}, indent=1))


def read_plan(sweep: Path) -> SweepPlan:
    """The jobs of a sweep.

    Raises:
        InputError: it was never started, or the file is damaged.
    """
    content = _read(sweep / PLAN)
    if content is None:
        raise InputError(f"{sweep / PLAN}: no sweep was started here; run it first, or give task.folder=FOLDER")
    return SweepPlan(**{key: value for key, value in content.items() if key != "schema"})


def begin_job(out: Path, overrides: Sequence[str]) -> JobNote:
    """Note that this process works on a job.

    Raises:
        InputError: another job of the same sweep has the same folder.
    """
    plan = _read(out.parent / PLAN) or {}
    before = job_note(out)
    note = JobNote(list(overrides), str(plan.get("identity", "")))
    if before is not None and before.overrides != note.overrides and before.sweep == note.sweep:
        raise InputError(
            f"{out}: two jobs of this sweep have one folder ({' '.join(_own(before, note))} and "
            f"{' '.join(_own(note, before))}); give a label=... that differs"
        )
    if before is None or before.overrides != note.overrides or before.seconds is None:
        write_job_note(out, note)
    (out / ERROR).unlink(missing_ok=True)
    return note


def end_job(out: Path, note: JobNote) -> None:
    """Note that a job is done, and how long it took; of a job that was done before the time is kept."""
    before = job_note(out)
    if before is None or before.seconds is None:
        write_job_note(out, JobNote(**{**asdict(note), "seconds": time.time() - note.started}))


def write_job_note(out: Path, note: JobNote) -> None:
    """Write the note of a job."""
    write_whole(out / JOB, json.dumps({"schema": 1, **asdict(note)}))


def job_note(out: Path) -> JobNote | None:
    """The note of a job; None where there is none that can be read."""
    content = _read(out / JOB)
    return None if content is None else JobNote(**{key: value for key, value in content.items() if key != "schema"})


def states(sweep: Path, plan: SweepPlan) -> list[JobState]:
    """How far every job of a sweep is; it may be running meanwhile."""
    found = {}
    for folder in sorted(path.parent for path in sweep.glob(f"*/{JOB}")):
        note = job_note(folder)
        if note is not None:
            found[tuple(note.overrides)] = _state(folder, note)
    shared = set.intersection(*(set(job) for job in plan.jobs)) if len(plan.jobs) > 1 else set()
    return [
        found.get(tuple(job)) or JobState(" ".join(key for key in job if key not in shared), "missing")
        for job in plan.jobs
    ]


def _state(folder: Path, note: JobNote) -> JobState:
    if _at_work(folder, note):
        return JobState(folder.name, "running", note)
    error = folder / ERROR
    if error.is_file():
        line = (error.read_text(encoding="utf-8").splitlines() or ["no message"])[0]
        return JobState(folder.name, "failed", note, line)
    return JobState(folder.name, "done" if (folder / SETTINGS).is_file() else "missing", note)


def _at_work(folder: Path, note: JobNote) -> bool:
    """Whether a living process holds a job's folder; of another machine it shows a sign of life now and then."""
    try:
        age = time.time() - (folder / RUNNING).stat().st_mtime
    except OSError:
        return False
    if note.host != socket.gethostname():
        return age < 2.0 * EXPIRY
    try:
        os.kill(note.process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _own(one: JobNote, other: JobNote) -> list[str]:
    return [key for key in one.overrides if key not in other.overrides]


def _read(path: Path) -> dict[str, Any] | None:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise InputError(f"{path}: damaged ({error}); remove it and start the sweep again") from error
