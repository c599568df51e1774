"""`task=ablation_rules`: what every rule of a diagnosis is worth, by leaving out one at a time.

Robots with hidden physics, exact and dirty ones, are drawn, and each is diagnosed with all rules and then with each
rule at its neutral value. Nothing is sealed: this compares rules with each other, it is no proof of the method. Every
answer is a file of its own, which is not made again.
"""

import multiprocessing
import signal
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from wipx.core.errors import InputError, unknown_name
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.rules import USUAL, Rules
from wipx.library import feedback_of
from wipx.proof.blind.drawing import seed_of
from wipx.proof.blind_robots.cases import DIRTY_TIERS, TIERS, draw_case, stratified
from wipx.proof.blind_robots.dirty import draw_dirty
from wipx.proof.blind_robots.folder import read_json
from wipx.proof.blind_robots.scenario import LENGTHS
from wipx.proof.blind_robots.score import CaseScore, failed, score
from wipx.proof.blind_robots.write import case_files, write_files
from wipx.recordings.source import RecordingSource
from wipx.report.diagnosis_json import diagnosis_json
from wipx.sim.analytic import AnalyticSimulator
from wipx.tasks.files.results import write_json
from wipx.tasks.shared.job import Job

ALL = "none"  # what is left out of the answers that the others are compared with
NEUTRAL = {name: note.neutral for name, _, note in USUAL.each() if note.neutral is not None}


@dataclass(frozen=True)
class Answer:
    """A diagnosis of a robot, with one rule left out or none.

    Attributes:
        named: Effects of the answer, sorted.
        verdict: Of the answer; "none" without one.
        right: Whether every hidden effect is named and nothing else; None where the vocabulary lacks the physics.
        false_alarm: Whether something is reported that is not hidden; None where the vocabulary lacks the physics.
        unexplained: Whether physics that the vocabulary lacks is called unexplained; None for other robots.
        numbers: diagnosis.json but for the time; empty without an answer.
        failure: Why there is no answer; empty where there is one.
    """

    named: tuple[str, ...]
    verdict: str
    right: bool | None
    false_alarm: bool | None
    unexplained: bool | None
    numbers: Mapping[str, Any]
    failure: str = ""


@dataclass(frozen=True)
class RuleAblation:
    """Draw robots, diagnose each with every rule left out in turn, and count what changes.

    An interrupted run goes on when it is started again in the same folder.

    Attributes:
        robots: How many.
        seed: Of the draws.
        lengths: Shortest and longest time that a recording lasts [s].
        tiers: Tiers to draw from; empty for all, of exact and of dirty robots.
        rules: To leave out, each as "part.rule"; empty for all that have a neutral value.
        workers: Processes.
        time_limit: For one diagnosis [s].
    """

    robots: int = 30
    seed: int = 0
    lengths: tuple[float, float] = LENGTHS
    tiers: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()
    workers: int = 2
    time_limit: float = 900.0

    def __post_init__(self) -> None:
        for name, value in (("task.robots", self.robots), ("task.workers", self.workers)):
            if value < 1:
                raise InputError(f"{name} is {value}, expected 1 or more")
        for tier in self.tiers:
            if tier not in {**TIERS, **DIRTY_TIERS}:
                raise unknown_name("tier", tier, (*TIERS, *DIRTY_TIERS), "task.tiers")
        for rule in self.rules:
            if rule not in NEUTRAL:
                raise unknown_name("rule", rule, NEUTRAL, "task.rules")

    def run(self, job: Job) -> None:
        """Draw, diagnose and write the table."""
        rules: Rules = job.part("diagnosis")
        self._begin(job.out, rules)
        tiers = stratified(
            self.robots, 0, self.tiers or (*TIERS, *DIRTY_TIERS), np.random.default_rng([self.seed, self.robots])
        )
        cases = {f"case{number:04d}": tier for number, tier in enumerate(tiers, start=1)}
        left_out = (ALL, *(self.rules or NEUTRAL))
        context = multiprocessing.get_context("spawn")  # compiled code and threads do not survive a fork
        with ProcessPoolExecutor(self.workers, mp_context=context) as pool:
            drawn = [
                pool.submit(draw, job.out, case, tier, seed_of(self.seed, case), self.lengths)
                for case, tier in cases.items()
            ]
            _wait(drawn, "draw")
            todo = [
                pool.submit(answer, job.out, case, rule, rules, self.time_limit)
                for case in cases
                for rule in left_out
                if not _place(job.out, case, rule).is_file()
            ]
            _wait(todo, "diagnose")
        answers = {rule: [read(_place(job.out, case, rule)) for case in cases] for rule in left_out}
        table = markdown(answers)
        (job.out / "table.md").write_text(table, encoding="utf-8")
        print(table)

    def _begin(self, folder: Path, rules: Rules) -> None:
        """Note the settings.

        Raises:
            InputError: the folder holds answers of other settings.
        """
        settings = {
            "robots": self.robots,
            "seed": self.seed,
            "lengths": list(self.lengths),
            "tiers": list(self.tiers),
            "time_limit": self.time_limit,
            "rules": asdict(rules),
        }
        noted = folder / "settings.json"
        if noted.is_file() and read_json(noted) != settings:
            raise InputError(f"{noted}: answers of other settings are here; set another hydra.run.dir")
        write_json(noted, settings)


def draw(folder: Path, case: str, tier: str, seed: int, lengths: tuple[float, float]) -> None:
    """Draw a robot, and write its recordings and what is hidden in it; nothing where that is done."""
    truth = folder / "truth" / f"{case}.json"
    if truth.is_file():
        return
    drawer = draw_dirty if tier in DIRTY_TIERS else draw_case
    files = case_files(drawer(np.random.default_rng(seed), tier, lengths))
    write_files(folder / "recordings" / case, files.visible)
    _write(truth, dict(files.truth))


def answer(folder: Path, case: str, left_out: str, rules: Rules, time_limit: float) -> None:
    """Diagnose a robot without a rule, judge the answer and write it.

    Args:
        folder: Of the run.
        case: Name of the robot.
        left_out: Name of the rule; `ALL` for none.
        rules: All of them.
        time_limit: Of the diagnosis [s].
    """
    truth = read_json(folder / "truth" / f"{case}.json")
    begun = time.perf_counter()
    content: Mapping[str, Any] = {}
    try:
        with _limited(time_limit):
            content = _diagnosis(folder / "recordings" / case, rules if left_out == ALL else rules.without(left_out))
        judged = score(case, truth, content, time.perf_counter() - begun)
    except (InputError, TimeoutError, ArithmeticError, np.linalg.LinAlgError) as error:
        judged = failed(case, truth, time.perf_counter() - begun, str(error) or type(error).__name__)
    _write(_place(folder, case, left_out), asdict(_answer_of(judged, content)))


def _diagnosis(recordings: Path, rules: Rules) -> Mapping[str, Any]:
    source = RecordingSource(path=str(recordings))
    described = source.describe()
    robot = KnownRobot(described.model, described.uncertainty, feedback_of(described))
    found = diagnosis_json(diagnose(source.load(), robot, AnalyticSimulator(threads=1), rules=rules))
    return {**found, "seconds": 0.0}


def _answer_of(judged: CaseScore, content: Mapping[str, Any]) -> Answer:
    named = tuple(sorted(judged.answer))
    right, alarm = judged.exact, judged.accused
    return Answer(named, judged.verdict, right, alarm, judged.flagged, content, judged.failure)


def read(path: Path) -> Answer:
    """An answer from its file.

    Raises:
        InputError: the file is missing or damaged.
    """
    content = read_json(path)
    try:
        return Answer(**{**content, "named": tuple(content["named"])})
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: no answer ({error}); remove it and run again") from error


def markdown(answers: Mapping[str, Sequence[Answer]]) -> str:
    """What each rule is worth, as a table: those that change most first.

    Args:
        answers: Of the same robots in the same order, by the rule that was left out; with all rules under `ALL`.
    """
    usual = answers[ALL]
    rows = []
    for rule, found in answers.items():
        pairs = list(zip(usual, found, strict=True))
        told = sum((a.named, a.verdict) != (b.named, b.verdict) for a, b in pairs)
        any_number = sum(a.numbers != b.numbers or a.failure != b.failure for a, b in pairs)
        counts = [sum(getattr(one, what) is True for one in found) for what in ("right", "false_alarm", "unexplained")]
        rows.append((rule, told, any_number, *counts, sum(bool(one.failure) for one in found)))
    rows = [rows[0], *sorted(rows[1:], key=lambda row: (-row[1], -row[2]))]
    asked = [sum(getattr(one, what) is not None for one in usual) for what in ("right", "false_alarm", "unexplained")]
    columns = (
        "left out",
        f"other names or verdict (of {len(usual)})",
        f"any other number (of {len(usual)})",
        f"names right (of {asked[0]})",
        f"false alarms (of {asked[1]})",
        f"called unexplained (of {asked[2]})",
        "no answer",
    )
    lines = [f"| {' | '.join(columns)} |", "| --- |" + " ---: |" * 6]
    lines += [f"| {' | '.join(map(str, row))} |" for row in rows]
    idle = [row[0] for row in rows[1:] if not row[2]]
    last = f"\nRules that change nothing here: {', '.join(idle) or 'none'}.\n"
    return "\n".join(lines) + "\n" + last


def _place(folder: Path, case: str, rule: str) -> Path:
    return folder / "answers" / case / f"{rule}.json"


def _write(path: Path, content: Mapping[str, object]) -> None:
    """Write JSON at once or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".part")
    write_json(draft, content)
    draft.replace(path)


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """End what takes longer by a `TimeoutError`; in the main thread of a process."""

    def end(number: int, frame: object) -> None:
        raise TimeoutError(f"no answer within {seconds:g} s")

    signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _wait(begun: Sequence[Future[None]], label: str) -> None:
    """Wait for jobs, with a bar; the first one that fails ends the rest."""
    try:
        for done in tqdm(as_completed(begun), total=len(begun), desc=label, disable=None):
            done.result()
    except BaseException:
        for job in begun:
            job.cancel()
        raise
