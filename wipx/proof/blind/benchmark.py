"""`task=blind`: diagnoses of robots drawn at random, whose physics no model of this package has produced.

Three processes that do not see each other's secrets: `drawing` seals what is hidden, `diagnosing` sees
recordings only, `judging` opens the seals of answered cases. This module holds the keys, in memory, and hands
each to the judge once the digests of the case's answers are written down. Tables and page are in `page`.
"""

import multiprocessing
import os
import secrets
import shutil
import signal
import sys
import threading
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from wipx.core.errors import InputError, unknown_name
from wipx.proof.blind.answering import LaunchedDiagnosers
from wipx.proof.blind.diagnosing import Diagnosers, check_methods, now
from wipx.proof.blind.drawing import draw_and_seal
from wipx.proof.blind.evidence import Account
from wipx.proof.blind.judging import Opened, judge, read_opened
from wipx.proof.blind.page import write_results
from wipx.proof.blind_robots.cases import DIRTY_TIERS, TIERS, stratified
from wipx.proof.blind_robots.folder import RunFolder, read_json
from wipx.proof.blind_robots.scenario import LENGTHS
from wipx.proof.blind_robots.trees.cases import TREE_TIERS
from wipx.tasks.files.results import write_json
from wipx.tasks.shared.job import Job

EARLIER = "earlier"  # folder that takes finished runs
DRAWING = ".drawing"  # begins the name of the folder of cases that are not all sealed yet
RUNNING = "running.pid"
SHORTEST, LONGEST = 4.0, 60.0  # [s], of recordings: in less the slow excitations hardly move a robot
PARTS = ("recordings", "sealed", "answers", "opened")


@dataclass(frozen=True)
class Secrets:
    """What only this process knows while cases are diagnosed.

    Attributes:
        seed: Of all draws; None where it was lost with an earlier process.
        given: Whether the seed was given by the user, not drawn.
        keys: Of the seals that are not opened yet, by case.
        pauses: How often the run was interrupted, and the keys written to disk until it went on.
    """

    seed: int | None
    given: bool
    keys: dict[str, str] = field(repr=False)
    pauses: int = 0


@dataclass(frozen=True)
class BlindBenchmark:
    """Draw cases, seal their answers, diagnose each, open the seals and count what was found.

    An interrupted run goes on when it is started again in the same folder; a finished one is kept beside a fresh one.

    Attributes:
        cases: How many.
        seed: Of the draws; None for a fresh one.
        lengths: Shortest and longest time that a recording lasts [s].
        workers: Processes that draw and diagnose.
        tiers: Tiers to draw from; empty for all of exact robots of the five plants.
        baselines: Other methods that diagnose the same recordings, options of the group `baseline`.
        baselines_cases: On how many of the cases; a sample of all tiers.
        time_limit: For one diagnosis [s].
        page: Markdown page whose table is renewed; None for none.
    """

    cases: int = 30
    seed: int | None = None
    lengths: tuple[float, float] = LENGTHS
    workers: int = 2
    tiers: tuple[str, ...] = ()
    baselines: tuple[str, ...] = ()
    baselines_cases: int = 8
    time_limit: float = 900.0
    page: str | None = None

    def __post_init__(self) -> None:
        for name, value in (("task.cases", self.cases), ("task.workers", self.workers)):
            if value < 1:
                raise InputError(f"{name} is {value}, expected 1 or more")
        if self.baselines_cases < 0:
            raise InputError(f"task.baselines_cases is {self.baselines_cases}, expected 0 or more")
        if not SHORTEST <= self.lengths[0] <= self.lengths[1] <= LONGEST:
            raise InputError(
                f"task.lengths is {list(self.lengths)}, expected the shortest and the longest time of a recording, "
                f"both from {SHORTEST:g} to {LONGEST:g} s"
            )
        for tier in self.tiers:
            if tier not in {**TIERS, **DIRTY_TIERS, **TREE_TIERS}:
                raise unknown_name("tier", tier, (*TIERS, *DIRTY_TIERS, *TREE_TIERS), "task.tiers")

    def run(self, job: Job) -> None:
        """Diagnose all cases and write the tables and the page."""
        if self.page is not None and not Path(self.page).is_file():
            raise InputError(f"task.page: there is no file {self.page}; correct it")
        check_methods(self.baselines if self._compared else ())
        folder = RunFolder(job.out)
        with _alone(folder), _ended_like_interrupted():
            held = self._resumed(folder) if folder.commitments.is_file() else self._drawn(folder)
            try:
                folder.keys.unlink(missing_ok=True)  # before the next diagnosis starts
                with closing(self._opened(folder, held.keys, job.launcher)) as cases:
                    for opened in cases:
                        held.keys.pop(opened.case)
            except BaseException:
                _keep(held, folder)
                self._write(folder, held, None)
                print(f"the cases that are done are in {job.out / 'index.html'}; the same command goes on", flush=True)
                raise
        self._write(folder, held, self.page)

    def _settings(self) -> dict[str, Any]:
        """What a run that goes on must have in common with the one that was begun."""
        tiers, compared = self.tiers or tuple(TIERS), self._compared
        return {
            "cases": self.cases,
            "lengths": list(self.lengths),
            "tiers": list(tiers),
            "baselines": list(self.baselines) if compared else [],
            "baselines_cases": compared,
        }

    @property
    def _compared(self) -> int:
        return min(self.baselines_cases, self.cases) if self.baselines else 0

    def _resumed(self, folder: RunFolder) -> Secrets:
        """The secrets of the run in a folder; of a fresh run where that one is finished."""
        content = read_json(folder.commitments)
        names = [entry["case"] for entry in content["cases"]]
        still_open = [name for name in names if not folder.opened(name).is_file()]
        if not still_open:
            _set_aside(folder, content["written"])
            return self._drawn(folder)
        if not folder.keys.is_file():
            print(f"{len(still_open)} of {len(names)} seals stay closed: the process that held their keys was killed")
            self._write(folder, Secrets(None, False, {}), None)
            _set_aside(folder, content["written"])
            return self._drawn(folder)
        if content["settings"] != self._settings():
            raise InputError(
                f"{folder.commitments}: an unfinished run of other settings ({content['settings']}); "
                "go on with those, or set another hydra.run.dir"
            )
        kept = read_json(folder.keys)
        if self.seed not in (None, kept["seed"]):
            raise InputError(f"{folder.keys}: the run here is not of seed {self.seed}; set another hydra.run.dir")
        print(f"going on with {len(still_open)} of {len(names)} cases in {folder.path}")
        keys = {name: kept["keys"][name] for name in still_open}
        return Secrets(kept["seed"], kept["given"], keys, kept["pauses"])

    def _drawn(self, folder: RunFolder) -> Secrets:
        """Draw and seal all cases, and publish the commitments."""
        unknown = [name for name in PARTS if (folder.path / name).exists()]
        if unknown:
            raise InputError(
                f"{folder.path}: holds {', '.join(unknown)} but no commitments.json; set another hydra.run.dir"
            )
        for stopped in folder.path.glob(f"{DRAWING}*"):  # before all was sealed
            shutil.rmtree(stopped, ignore_errors=True)
        # Of this process alone: what draws for a process that was killed may go on for a while.
        draft = RunFolder(folder.path / f"{DRAWING}{os.getpid()}")
        seed = secrets.randbits(64) if self.seed is None else self.seed
        tiers = stratified(self.cases, self._compared, self.tiers or tuple(TIERS), np.random.default_rng(seed))
        names = [f"case{number:04d}" for number in range(1, self.cases + 1)]
        with _processes(self.workers) as pool:
            begun = [
                pool.submit(draw_and_seal, draft.path, name, tier, seed, self.lengths)
                for name, tier in zip(names, tiers, strict=True)
            ]
            sealed = sorted(_shown(begun, "draw and seal"), key=lambda one: one.commitment.case)
        commitments = [asdict(one.commitment) for one in sealed]
        write_json(
            draft.commitments, {"schema": 1, "written": now(), "settings": self._settings(), "cases": commitments}
        )
        for path in sorted(draft.path.iterdir(), reverse=True):  # commitments.json last
            path.rename(folder.path / path.name)
        draft.path.rmdir()
        print(f"{self.cases} cases are sealed; what is hidden is fixed by {folder.commitments}")
        return Secrets(seed, self.seed is not None, {one.commitment.case: one.key for one in sealed})

    def _opened(
        self, folder: RunFolder, keys: dict[str, str], launcher: tuple[str, ...]
    ) -> Generator[Opened, None, None]:
        """Let every case be diagnosed and opened."""
        if launcher:
            diagnosers, at_once = LaunchedDiagnosers(folder, tuple(keys), self.time_limit, launcher), len(keys)
        else:
            diagnosers, at_once = Diagnosers(folder, self.time_limit), self.workers
        with _processes(1) as judging, ThreadPoolExecutor(at_once) as watching:

            def finish(case: str, key: str) -> Opened:
                diagnosers.answer(case)
                return judging.submit(judge, folder.path, case, key).result()

            begun = [watching.submit(finish, case, key) for case, key in keys.items()]
            try:
                yield from _shown(begun, "diagnose and open")
            except BaseException:
                watching.shutdown(wait=False, cancel_futures=True)
                diagnosers.stop()
                raise

    def _write(self, folder: RunFolder, held: Secrets, page: str | None) -> None:
        names = [entry["case"] for entry in read_json(folder.commitments)["cases"]]
        cases = [read_opened(folder.opened(name)) for name in names if folder.opened(name).is_file()]
        account = Account(held.seed, held.given, held.pauses, len(names))
        if cases:
            print(write_results(folder, cases, account, None if page is None else Path(page)))


def _keep(held: Secrets, folder: RunFolder) -> None:
    """Write the keys that are left to a file that only this user can read; nothing is diagnosed any more."""
    folder.keys.touch(mode=0o600)
    write_json(folder.keys, {"schema": 1, **asdict(held), "pauses": held.pauses + 1})


def _set_aside(folder: RunFolder, written: str) -> None:
    """Move a finished run to a folder of its own inside the folder."""
    place = folder.path / EARLIER / written.replace(":", "")
    content = [path for path in folder.path.iterdir() if path.name not in (EARLIER, RUNNING)]
    place.mkdir(parents=True)
    for path in content:
        path.rename(place / path.name)
    print(f"the finished run of {written} is now in {place}")


@contextmanager
def _alone(folder: RunFolder) -> Iterator[None]:
    """Refuse to work in a folder in which another process is at work."""
    mark = folder.path / RUNNING
    if mark.is_file() and _lives(int(mark.read_text(encoding="utf-8"))):
        raise InputError(f"{mark}: another process is at work on this run; wait for it, or set another hydra.run.dir")
    mark.write_text(str(os.getpid()), encoding="utf-8")
    try:
        yield
    finally:
        mark.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


@contextmanager
def _processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that are asked to stop by this one alone; jobs that have not begun are dropped then."""
    context = multiprocessing.get_context("spawn")  # compiled code and threads do not survive a fork
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=_ignore_interrupts)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _ended_like_interrupted() -> Iterator[None]:
    """Let a request to end (SIGTERM) be met like Ctrl-C, so that the keys are kept."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _shown(begun: list[Future[Any]], label: str) -> Iterator[Any]:
    """Results as they come, with a bar that tells the time left."""
    with tqdm(
        total=len(begun),
        desc=label,
        bar_format="{desc} |{bar:24}| {n_fmt}/{total_fmt}, {elapsed} gone, about {remaining} left",
        file=sys.stderr,
        leave=False,
        disable=None,
    ) as bar:
        for done in as_completed(begun):
            yield done.result()
            bar.update()
