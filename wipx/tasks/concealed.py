"""`task=concealed`: diagnoses of robots drawn at random, whose physics no model of this package has produced.

The robots, their equations of motion and the scoring are in `wipx.concealed`.
"""

import csv
import io
import multiprocessing
import os
import secrets
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from tqdm import tqdm

from wipx.concealed.cases import TIERS
from wipx.concealed.picture import draw_confusions
from wipx.concealed.score import CaseScore, ParameterScore, UnseenErrors, failed, read_json, score_folder
from wipx.concealed.table import confusions, markdown, misses, tier_scores
from wipx.concealed.write import TRUTH, write_numbered
from wipx.core.errors import InputError, unknown_name
from wipx.tasks.job import Job
from wipx.tasks.results import replace_table, write_json, written_together

RESULT, SEED = "result.json", "seed.json"

ONE_THREAD = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # a worker has one core


@dataclass(frozen=True)
class Concealed:
    """Draw cases, diagnose each, and count what was found.

    A run that was interrupted continues in the same folder: cases with an answer are not done again.

    Attributes:
        cases: How many.
        seed: Of the draws; None for a fresh one, or that of the run that is continued.
        workers: Processes that draw and diagnose.
        tiers: Tiers to draw from; empty for all.
        time_limit: For one diagnosis [s].
        page: Markdown page whose table is renewed; None for none.
    """

    cases: int = 40
    seed: int | None = None
    workers: int = 2
    tiers: tuple[str, ...] = ()
    time_limit: float = 900.0
    page: str | None = None

    def __post_init__(self) -> None:
        for name, value in (("task.cases", self.cases), ("task.workers", self.workers)):
            if value < 1:
                raise InputError(f"{name} is {value}, expected 1 or more")
        for tier in self.tiers:
            if tier not in TIERS:
                raise unknown_name("tier", tier, TIERS, "task.tiers")

    def run(self, job: Job) -> None:
        """Diagnose all cases and write the tables."""
        seed = self._seed(job.out)
        print(f"{self.cases} cases of seed {seed}, {self.workers} at a time; in {job.out / 'cases'}")
        scores = sorted(self._scores(job.out / "cases", seed), key=lambda one: one.case)
        text = markdown(scores)
        with written_together(job.out) as folder:
            (folder / "score.md").write_text(text, encoding="utf-8")
            (folder / "score.csv").write_text(_csv(scores), encoding="utf-8")
            write_json(folder / "score.json", _summary(seed, scores))
            draw_confusions(confusions(scores), folder / "confusions.png")
        if self.page is not None:
            replace_table(Path(self.page), text.partition("\n")[2].strip())  # without its title
        print(f"\n{text}\nwritten to {job.out}")

    def _seed(self, out: Path) -> int:
        """The seed that is asked for, that of the run that is continued, or a fresh one."""
        path = out / SEED
        begun = int(read_json(path)["seed"]) if path.is_file() else None
        if begun is not None and self.seed not in (None, begun):
            raise InputError(f"{path}: the cases here are of seed {begun}, not {self.seed}; set another hydra.run.dir")
        seed = begun if begun is not None else secrets.randbits(32) if self.seed is None else self.seed
        write_json(path, {"seed": seed})
        return seed

    def _scores(self, folder: Path, seed: int) -> Iterator[CaseScore]:
        tiers = self.tiers or tuple(TIERS)
        context = multiprocessing.get_context("spawn")  # compiled code and threads do not survive a fork
        with ProcessPoolExecutor(self.workers, mp_context=context) as pool, _bar(self.cases) as bar:
            pending: list[Future[CaseScore]] = [
                pool.submit(draw_and_diagnose, folder, seed, number, tiers, self.time_limit)
                for number in range(1, self.cases + 1)
            ]
            try:
                for done in as_completed(pending):
                    yield done.result()
                    bar.update()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


def _bar(cases: int) -> tqdm:
    return tqdm(
        total=cases,
        desc="cases",
        bar_format="{desc} |{bar:24}| {n_fmt}/{total_fmt}, {elapsed} gone, about {remaining} left",
        file=sys.stderr,
        leave=False,
        disable=None,
    )


def draw_and_diagnose(folder: Path, seed: int, number: int, tiers: tuple[str, ...], time_limit: float) -> CaseScore:
    """The score of one case; drawn and diagnosed unless its answer is there."""
    place = write_numbered(folder, seed, number, tiers)
    if (place / RESULT).is_file():
        scored = _read_score(place / RESULT)
        if not scored.failure:
            return scored
    scored = diagnose_case(place, time_limit)
    write_json(place / RESULT, asdict(scored))
    return scored


def diagnose_case(folder: Path, time_limit: float) -> CaseScore:
    """Diagnose a case's visible recordings, predict its unseen ones, and score both."""
    answer = folder / "answer"
    begun = time.perf_counter()
    failure = _call("diagnose", folder / "visible", answer, time_limit)
    seconds = time.perf_counter() - begun
    if failure:
        return failed(folder.name, read_json(folder / TRUTH), seconds, failure)
    return score_folder(folder, answer / "diagnosis.json", seconds, _unseen_errors(folder, answer, time_limit))


def _unseen_errors(folder: Path, answer: Path, time_limit: float) -> UnseenErrors | None:
    """Errors of both models on the unseen recordings; None where they cannot be predicted."""
    model = f"model.path='{answer / 'model.yaml'}'"
    if _call("predict", folder / "unseen", folder / "prediction", time_limit, model):
        return None
    metrics = read_json(folder / "prediction" / "metrics.json")
    # the sensors' noise is known; what it does to the state from which a prediction starts comes on top
    sensors, propagated = read_json(folder / TRUTH)["noise"], metrics["noise_floor"]
    floor = {name: max(noise, propagated[name] or 0.0) for name, noise in sensors.items()}
    return UnseenErrors(metrics["rms_nominal"], metrics["rms"], floor)


def _call(task: str, recordings: Path, out: Path, time_limit: float, *more: str) -> str:
    """Run a task of this program; returns why it failed, empty where it did not."""
    command = [sys.executable, "-m", "wipx", f"task={task}", "tracking=none", "sim.threads=1"]
    command += [f"recordings.path='{recordings.resolve()}'", f"hydra.run.dir='{out.resolve()}'", *more]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=time_limit, check=False, env=ONE_THREAD)
    except subprocess.TimeoutExpired:
        return f"no answer within {time_limit:g} s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines() or ["no message"]
    return f"exit status {done.returncode}: {lines[-1]}"


def _read_score(path: Path) -> CaseScore:
    data = read_json(path)
    for name in ("truth", "answer"):
        data[name] = tuple(data[name])
    data["parameters"] = tuple(ParameterScore(**one) for one in data["parameters"])
    return CaseScore(**data)


def _summary(seed: int, scores: list[CaseScore]) -> dict[str, object]:
    return {
        "schema": 1,
        "seed": seed,
        "tiers": [asdict(tier) for tier in tier_scores(scores)],
        "misses": [one.case for one in misses(scores)],
        "cases": [asdict(one) for one in scores],
    }


def _csv(scores: list[CaseScore]) -> str:
    """One line for each case; names joined by spaces, parameters as name=value(true)."""
    text = io.StringIO()
    names = [field.name for field in fields(CaseScore)]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for one in scores:
        row = {name: value for name, value in asdict(one).items() if value is not None}
        row |= {"truth": " ".join(one.truth), "answer": " ".join(one.answer)}
        row["parameters"] = " ".join(f"{p.name}={p.value:.6g}({p.true:.6g})" for p in one.parameters)
        writer.writerow(row)
    return text.getvalue()
