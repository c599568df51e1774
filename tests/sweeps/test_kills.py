"""A sweep that is disturbed at random moments and started again ends like one that is left alone.

Disturbed are the launcher and its jobs (SIGKILL), the disk (full) and MLflow's database (locked); `make test-kill`.
"""

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pytest
from sweeps.small_sweep import command, environment, logged, results, run

SEEDS, ROUNDS = 12, 20  # 24 jobs
FIRST, LAST = 2.0, 14.0  # [s] after its start at which a sweep is disturbed
SIZE = "200m"  # of the disk


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    answer = run(folder, SEEDS)
    assert answer.returncode == 0, answer.stderr
    return folder


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A folder on a small disk of its own, where this user may mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(folder)], check=False)
    yield folder
    if mounted.returncode == 0:
        subprocess.run(["umount", "-l", str(folder)], check=False)


def children(process: int) -> list[int]:
    """Processes that a process has started, with those that these have started."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            if int(path.read_text().rpartition(")")[2].split()[1]) == process:
                found += [int(path.parent.name), *children(int(path.parent.name))]
    return found


def kill_launcher(sweep: subprocess.Popen, folder: Path, rng: np.random.Generator) -> None:
    sweep.kill()  # its jobs may go on
    sweep.wait()


def kill_job(sweep: subprocess.Popen, folder: Path, rng: np.random.Generator) -> None:
    jobs = children(sweep.pid)
    if jobs:
        with suppress(ProcessLookupError):
            os.kill(int(rng.choice(jobs)), signal.SIGKILL)
    sweep.wait()


def fill_disk(sweep: subprocess.Popen, folder: Path, rng: np.random.Generator) -> None:
    filler = folder / "filler"
    with suppress(OSError), filler.open("wb", buffering=0) as file:
        while True:
            file.write(b"0" * 65536)
    sweep.wait()
    filler.unlink()


def lock_database(sweep: subprocess.Popen, folder: Path, rng: np.random.Generator) -> None:
    with closing(sqlite3.connect(folder / "runs" / "mlflow.db", timeout=60.0)) as database:
        database.execute("begin exclusive")
        time.sleep(rng.uniform(5.0, 15.0))
        sweep.kill()
        sweep.wait()


@pytest.mark.slow
@pytest.mark.kill
def test_a_disturbed_sweep_that_is_started_again_ends_like_an_undisturbed_one(
    undisturbed: Path, disk: Path, fresh_seed: int
):
    rng = np.random.default_rng(fresh_seed)
    shutil.copytree(undisturbed / "runs" / "trials", disk / "runs" / "trials")
    kinds: list[Callable] = [kill_launcher, kill_job, lock_database, *([fill_disk] if disk.is_mount() else [])]
    hit = 0
    for number in range(ROUNDS):
        sweep = subprocess.Popen(
            command(SEEDS), cwd=disk, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        with suppress(subprocess.TimeoutExpired):
            sweep.wait(rng.uniform(FIRST, LAST))
        hit += sweep.poll() is None
        disturb = kinds[number % len(kinds)]
        if disturb is lock_database and not (disk / "runs" / "mlflow.db").is_file():
            disturb = kill_launcher
        disturb(sweep, disk, rng)
    assert hit >= ROUNDS // 2, "the sweep was over before it could be disturbed"

    for _ in range(2):  # the second time there is nothing to do
        answer = run(disk, SEEDS)
        assert answer.returncode == 0, answer.stderr
    assert results(disk) == results(undisturbed)
    assert logged(disk) == logged(undisturbed)
    assert not list((disk / "runs").rglob(".unfinished-*"))
