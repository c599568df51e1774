"""`task=real_diagnosis`: what the diagnosis finds, blind, on recordings of real hardware, as one table.

Each case is a dataset and what its authors know of the physics that their nominal model lacks. The diagnosis sees
neither that nor the held-out recordings. A case leaves a folder like that of `task=diagnose`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.diagnosis import Diagnosis, FoundEffect
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.recording import Recording, RecordingSplit
from wipx.core.results import FitErrors
from wipx.diagnosis.case import HORIZON
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.recordings.source import RecordingSource
from wipx.report.diagnosis_words import value_in_words
from wipx.report.numbers import compact
from wipx.tasks.diagnose import Diagnose
from wipx.tasks.job import Job
from wipx.tasks.results import replace_table, write_json, written_together


@dataclass(frozen=True)
class Case:
    """One diagnosis.

    Attributes:
        dataset: Name of the source.
        known: What the authors found missing, by "site/kind", with the figure that they give, in words.
        spans: Parts of recordings to use instead of the dataset's, as in `RecordingSource`.
        uncertainty: Relative standard deviation of further nominal numbers that are not exact.
        lead: Time before a prediction from which its state is estimated [s].
    """

    dataset: str
    known: dict[str, str]
    spans: dict[str, list[float | None]] = field(default_factory=dict)
    uncertainty: dict[str, float] = field(default_factory=dict)
    lead: float = 0.3

    def __post_init__(self) -> None:
        check_positive(lead=self.lead)

    def of(self, source: RecordingSource) -> RecordingSource:
        """A dataset with the case's own choices."""
        robot = source.robot
        if robot is not None and self.uncertainty:
            robot = {**robot, "uncertainty": {**robot.get("uncertainty", {}), **self.uncertainty}}
        return replace(source, robot=robot, spans=self.spans or source.spans)


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes:
        title: Of the dataset.
        known: What the authors found missing, see `Case`.
        diagnosis: The answer; None where the diagnosis refused the recordings.
        errors: On recordings that the diagnosis never saw; None without an answer.
        refusal: Why there is no answer; empty where there is one.
    """

    title: str
    known: Mapping[str, str]
    diagnosis: Diagnosis | None
    errors: FitErrors | None
    refusal: str = ""


@dataclass(frozen=True)
class RealDiagnosis:
    """All cases, one after the other.

    Attributes:
        sources: Options of the group `recordings`, by name.
        cases: Settings of the cases, by name.
        only: Names of the cases to run; empty for all.
        page: Markdown file whose part between the table marks is replaced; None for none.
    """

    sources: dict[str, Any] = field(default_factory=dict)
    cases: dict[str, Any] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    page: str | None = None

    def __post_init__(self) -> None:
        for name in self.only:
            if name not in self.cases:
                raise unknown_name("case", name, self.cases, "task.only")

    def run(self, job: Job) -> None:
        """Diagnose case by case and write the table."""
        cases = {
            name: job.build({"_target_": f"{Case.__module__}.Case", **settings}, f"task.cases.{name}")
            for name, settings in self.cases.items()
            if not self.only or name in self.only
        }
        sources = {name: case.of(self._source(job, case.dataset)) for name, case in cases.items()}
        # every dataset is read before the first diagnosis, so that a missing one is reported at once
        splits = {name: source.split(source.load()) for name, source in sources.items()}
        rows = []
        for number, (name, case) in enumerate(cases.items(), start=1):
            print(f"\n[{number}/{len(cases)}] {name}")
            rows.append(row(outcome_of(replace(job, out=job.out / name), case, sources[name], splits[name])))
        table = "\n".join([*HEAD, *rows]) + "\n"
        (job.out / "table.md").write_text(table, encoding="utf-8")
        if self.page is not None:
            replace_table(Path(self.page), table)
        print(f"\n{table}\ntable: {job.out / 'table.md'}")

    def _source(self, job: Job, dataset: str) -> RecordingSource:
        if dataset not in self.sources:
            raise unknown_name("dataset", dataset, self.sources, "task.cases")
        return job.build(self.sources[dataset], f"task.sources.{dataset}")


def outcome_of(job: Job, case: Case, source: RecordingSource, split: RecordingSplit) -> Outcome:
    """Diagnose what is to be fitted and predict what is held out; leaves heldout.json beside the diagnosis."""
    try:
        diagnosis = Diagnose(case.lead).of(job, only(source, split.fit))
    except InputError as refusal:
        print(f"refused: {refusal}")
        return Outcome(source.name, case.known, None, None, str(refusal))
    noise = sensor_noise(split.fit, diagnosis.nominal.plant)
    judge = Judge(job.part("sim"), noise, HORIZON, case.lead)
    errors, _ = judge.compare(diagnosis.nominal, diagnosis.model, split.held_out, held_out=True)
    with written_together(job.out) as folder:
        parts = {"nominal": errors.nominal, "completed": errors.completed, "noise_floor": errors.noise_floor}
        recordings = [recording.name for recording in split.held_out]
        write_json(folder / "heldout.json", {"horizon_s": errors.horizon, "recordings": recordings, **parts})
    return Outcome(source.name, case.known, diagnosis, errors)


def only(source: RecordingSource, recordings: tuple[Recording, ...]) -> RecordingSource:
    """The source of these recordings, or parts of them, alone."""
    spans: dict[str, list[float | None]] = {
        r.name: [float(r.t[0]), float(np.nextafter(r.t[-1], np.inf))] for r in recordings
    }
    return replace(source, files=list(spans), spans=spans)


HEAD = [
    "| recordings | the authors know | found blind | known effects named | verdict "
    "| held-out error: before -> after -> floor |",
    "| --- | --- | --- | --- | --- | --- |",
]


def row(outcome: Outcome) -> str:
    """An outcome as a row of the table."""
    known = "; ".join(f"{name}: {figure}" for name, figure in outcome.known.items())
    diagnosis = outcome.diagnosis
    if diagnosis is None or outcome.errors is None:
        return f"| {outcome.title} | {known} | no answer: {outcome.refusal} | - | - | - |"
    found = "; ".join(_shown(effect) for effect in diagnosis.effects) or "nothing"
    cells = [outcome.title, known, found, score(outcome.known, diagnosis.effects), diagnosis.verdict]
    return f"| {' | '.join(cells)} | {_shown_errors(outcome.errors, diagnosis.units)} |"


def score(known: Mapping[str, str], found: tuple[FoundEffect, ...]) -> str:
    """How many of the known effects were named, how many more only as a tie, and how many other effects were named."""
    names = {effect.name for effect in found}
    ties = {name for effect in found for name in effect.equivalent} - names
    counts = [f"{len(names & known.keys())} of {len(known)}"]
    if ties & known.keys():
        counts.append(f"{len(ties & known.keys())} tied")
    if names - known.keys():
        counts.append(f"{len(names - known.keys())} beside")
    return ", ".join(counts)


def _shown(effect: FoundEffect) -> str:
    values = ", ".join(value_in_words(number) for number in effect.parameters)
    alike = f" (or {', '.join(effect.equivalent)})" if effect.equivalent else ""
    return f"{effect.name}{alike}: {values}"


def _shown_errors(errors: FitErrors, units: Mapping[str, str]) -> str:
    models = (errors.nominal, errors.completed, errors.noise_floor)
    return ", ".join(
        f"{column} {' -> '.join(compact(model[column], 3) for model in models)} {units[column]}"
        for column in errors.nominal
    )
