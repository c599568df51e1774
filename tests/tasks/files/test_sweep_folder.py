"""How far every job of a sweep is, told from its folder alone."""

import json
import os
import socket
import time
from dataclasses import replace
from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.core.locked import EXPIRY, locked
from wipx.tasks.files.finished import ERROR, SETTINGS
from wipx.tasks.files.sweep_folder import (
    JOB,
    RUNNING,
    SweepPlan,
    begin_job,
    end_job,
    job_note,
    read_plan,
    states,
    write_job_note,
    write_plan,
)

JOBS = [["seed=1", "name=a"], ["seed=2", "name=a"], ["seed=3", "name=a"], ["seed=4", "name=a"]]


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    write_plan(tmp_path / "a", SweepPlan(JOBS, "basic"))
    return tmp_path / "a"


def begun(sweep: Path, number: int) -> Path:
    out = sweep / f"s{number}"
    out.mkdir(exist_ok=True)
    begin_job(out, JOBS[number - 1])
    return out


def told(sweep: Path) -> dict[str, str]:
    return {job.name: job.state for job in states(sweep, read_plan(sweep))}


def test_a_sweep_that_was_not_started_is_named(tmp_path: Path):
    with pytest.raises(InputError, match=r"sweep\.json: no sweep was started here"):
        read_plan(tmp_path)


def test_jobs_are_done_running_failed_or_missing(sweep: Path):
    end_job(done := begun(sweep, 1), begin_job(done, JOBS[0]))
    (done / SETTINGS).write_text("")
    (begun(sweep, 2) / ERROR).write_text("r3.csv row 812: t decreases\n\ntrace")
    with locked(begun(sweep, 3) / RUNNING):
        found = states(sweep, read_plan(sweep))
    assert [(job.name, job.state) for job in found] == [
        ("s1", "done"),
        ("s2", "failed"),
        ("s3", "running"),
        ("seed=4", "missing"),
    ]
    assert found[1].error == "r3.csv row 812: t decreases"


def test_a_job_whose_process_was_killed_is_missing(sweep: Path):
    out = begun(sweep, 1)
    note = job_note(out)
    assert note is not None
    (out / RUNNING).write_text("")
    write_job_note(out, replace(note, process=2**22 + 1))  # beyond the largest id of a process
    assert told(sweep)["s1"] == "missing"
    write_job_note(out, replace(note, process=os.getpid()))
    assert told(sweep)["s1"] == "running"


def test_a_job_on_another_machine_runs_while_it_shows_signs_of_life(sweep: Path):
    out = begun(sweep, 1)
    content = json.loads((out / JOB).read_text())
    (out / JOB).write_text(json.dumps({**content, "host": f"not-{socket.gethostname()}"}))
    (out / RUNNING).write_text("")
    assert told(sweep)["s1"] == "running"
    long_ago = time.time() - 3.0 * EXPIRY
    os.utime(out / RUNNING, (long_ago, long_ago))
    assert told(sweep)["s1"] == "missing"


def test_a_job_that_is_done_keeps_its_time(sweep: Path):
    out = begun(sweep, 1)
    note = job_note(out)
    assert note is not None
    end_job(out, replace(note, started=note.started - 100.0))
    end_job(out, begin_job(out, JOBS[0]))
    after = job_note(out)
    assert after is not None
    assert after.seconds is not None
    assert after.seconds >= 100.0


def test_two_jobs_of_a_sweep_in_one_folder_are_refused(sweep: Path):
    begun(sweep, 1)
    with pytest.raises(InputError, match=r"two jobs of this sweep have one folder \(seed=1 and seed=2\)"):
        begin_job(sweep / "s1", JOBS[1])
