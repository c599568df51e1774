"""`task=real_recordings`: what the diagnosis finds, blind, on recordings of real hardware, as one table.

Each case is a dataset, what its authors know of the physics that their nominal model lacks, and their model with
that physics. The diagnosis sees neither before its answer is complete; then it is asked about the authors' figures.
It never sees the held-out recordings, on which the nominal, the completed and the authors' model are compared. A case
leaves a folder like that of `task=diagnose`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.model import Model
from wipx.core.recording import Recording, RecordingSplit
from wipx.core.results import HORIZON
from wipx.diagnosis.answer.suspects import check_suspects
from wipx.identify.parameter_space import scales_of
from wipx.proof.baseline_answers import MethodAnswer, ask, check_methods
from wipx.proof.real_machines.group_results import OURS, answer_of
from wipx.proof.real_machines.published import Published, published_of
from wipx.proof.real_machines.recordings_table import HeldOutErrors, Outcome, markdown
from wipx.proof.unseen import unseen
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.diagnose import Diagnose
from wipx.tasks.files.results import replace_table, write_json, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class Rig:
    """One diagnosis.

    Attributes:
        dataset: Name of the source.
        published: Settings of `Published`: what the authors found missing.
        spans: Parts of recordings to use instead of the dataset's, as in `RecordingSource`.
        horizons: Lengths of the predictions by which models are judged [s].
    """

    dataset: str
    published: dict[str, Any] = field(default_factory=dict)
    spans: dict[str, list[float | None]] = field(default_factory=dict)
    horizons: tuple[float, ...] = (HORIZON,)

    def __post_init__(self) -> None:
        for horizon in self.horizons:
            check_positive(horizons=horizon)

    def of(self, source: RecordingSource) -> RecordingSource:
        """A dataset with the case's own choices."""
        return replace(source, spans=self.spans or source.spans)


@dataclass(frozen=True)
class Prepared:
    """A case whose recordings have been read.

    Attributes:
        case: Its settings.
        source: The dataset with the case's own choices.
        split: What the diagnosis sees, and what it does not.
        published: What the authors published.
        authors: The authors' full model; None where they published none.
    """

    case: Rig
    source: RecordingSource
    split: RecordingSplit
    published: Published
    authors: Model | None


@dataclass(frozen=True)
class RealRecordings:
    """All cases, one after the other.

    Attributes:
        sources: Options of the group `recordings`, by name.
        cases: Settings of the cases, by name.
        methods: Options of the group `baseline`, by name.
        only: Names of the cases to run; empty for all.
        baselines: Methods that are given the same recordings, names of `methods`.
        page: Markdown file whose part between the table marks is replaced; None for none.
    """

    sources: dict[str, Any] = field(default_factory=dict)
    cases: dict[str, Any] = field(default_factory=dict)
    methods: dict[str, Any] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    baselines: tuple[str, ...] = ()
    page: str | None = None

    def __post_init__(self) -> None:
        for name in self.only:
            if name not in self.cases:
                raise unknown_name("case", name, self.cases, "task.only")
        check_methods(self.baselines, self.methods)

    def run(self, job: Job) -> None:
        """Diagnose case by case and write the table."""
        prepared = self._prepared(job)
        outcomes = []
        for number, (name, one) in enumerate(prepared.items(), start=1):
            print(f"\n[{number}/{len(prepared)}] {name}")
            outcomes.append(outcome_of(replace(job, out=job.out / name), one, self._baselines))
        table = markdown(outcomes)
        (job.out / "table.md").write_text(table, encoding="utf-8")
        if self.page is not None:
            replace_table(Path(self.page), table)
        print(f"\n{table}\ntable: {job.out / 'table.md'}")

    @property
    def _baselines(self) -> dict[str, Any]:
        return {name: self.methods[name] for name in self.baselines}

    def _prepared(self, job: Job) -> dict[str, Prepared]:
        """Every dataset, read before the first diagnosis, so that a missing one is reported at once."""
        cases = {
            name: job.build({"_target_": f"{Rig.__module__}.Rig", **settings}, f"task.cases.{name}")
            for name, settings in self.cases.items()
            if not self.only or name in self.only
        }
        sources = {name: case.of(self._source(job, case.dataset)) for name, case in cases.items()}
        check_there(sources.values())
        prepared = {}
        for name, case in cases.items():
            source = sources[name]
            where, nominal, recordings = f"task.cases.{name}", source.describe().model, source.load()
            published = published_of(job, case.published, f"{where}.published")
            authors = published.authors_model(nominal, f"{where}.published.authors")
            split = source.split(recordings)
            check_suspects(published.suspects, nominal, scales_of(nominal, split.fit), f"{where}.published.known")
            prepared[name] = Prepared(case, source, split, published, authors)
        return prepared

    def _source(self, job: Job, dataset: str) -> RecordingSource:
        if dataset not in self.sources:
            raise unknown_name("dataset", dataset, self.sources, "task.cases")
        return job.build(self.sources[dataset], f"task.sources.{dataset}")


def check_there(sources: Iterable[RecordingSource]) -> None:
    """Refuse sources whose folders are missing.

    Raises:
        InputError: it lists all missing folders, the files that are needed of each, and where they come from.
    """
    missing = [
        f"{source.place}: {', '.join(source.files)} (from {source.origin})"
        for source in sources
        if source.path is None or not Path(source.place).expanduser().is_dir()
    ]
    if missing:
        remedy = "get them, or set WIPX_RECORDINGS=FOLDER (for arms WIPX_ARMS=FOLDER)"
        raise InputError(f"recordings are missing; {remedy}: {'; '.join(missing)}")


def outcome_of(job: Job, prepared: Prepared, baselines: Mapping[str, Any]) -> Outcome:
    """Diagnose what is to be fitted, and predict what is held out; other methods, settings by name, do the same.

    Leaves heldout.json, heldout.png and, where there is one, authors.yaml beside the diagnosis.
    """
    case, source, split, published = prepared.case, prepared.source, prepared.split, prepared.published
    seen = only(source, split.fit)
    predicted = unseen(job, seen, split.held_out)
    plant = source.describe().model.plant
    outcome = Outcome(source.name, published, None, (), units={c: plant.unit_of(c) for c in plant.coordinates})
    try:
        diagnosis = Diagnose(published.suspects).of(job, seen)
    except InputError as refusal:
        print(f"refused: {refusal}")
        outcome, ours = replace(outcome, refusal=str(refusal)), MethodAnswer(OURS, refusal=str(refusal))
    else:
        errors = tuple(_errors(job, prepared, diagnosis, horizon) for horizon in case.horizons)
        _write(job, prepared, diagnosis, errors)
        outcome = replace(outcome, diagnosis=diagnosis, errors=errors)
        ours = answer_of(diagnosis, predicted.errors(diagnosis.model))
    others = tuple(ask(job, method, settings, seen, predicted) for method, settings in baselines.items())
    return replace(outcome, methods=(ours, *others) if others else ())


def _write(job: Job, prepared: Prepared, diagnosis: Diagnosis, errors: tuple[HeldOutErrors, ...]) -> None:
    with written_together(job.out) as folder:
        recordings = [recording.name for recording in prepared.split.held_out]
        write_json(folder / "heldout.json", {"recordings": recordings, "errors": [asdict(e) for e in errors]})
        _draw(job, prepared, diagnosis, folder / "heldout.png")
        if prepared.authors is not None:
            write_model(prepared.authors, folder / "authors.yaml")


def only(source: RecordingSource, recordings: tuple[Recording, ...]) -> RecordingSource:
    """The source of these recordings, or parts of them, alone."""
    spans: dict[str, list[float | None]] = {
        r.name: [float(r.t[0]), float(np.nextafter(r.t[-1], np.inf))] for r in recordings
    }
    return replace(source, files=list(spans), spans=spans)


def _errors(job: Job, prepared: Prepared, diagnosis: Diagnosis, horizon: float) -> HeldOutErrors:
    predicted = unseen(job, only(prepared.source, prepared.split.fit), prepared.split.held_out, horizon)
    found, _ = predicted.compare(diagnosis.nominal, diagnosis.model)
    authors = None if prepared.authors is None else predicted.errors(prepared.authors)
    return HeldOutErrors(horizon, found.nominal, found.completed, authors, found.noise_floor)


def _draw(job: Job, prepared: Prepared, diagnosis: Diagnosis, path: Path) -> None:
    """The picture of a diagnosis, with predictions of the held-out recordings instead of those that it saw."""
    from wipx.report.diagnosis_figure import draw_diagnosis

    seen = only(prepared.source, prepared.split.fit)
    predicted = unseen(job, seen, prepared.split.held_out, prepared.case.horizons[0])
    errors, traces = predicted.compare(diagnosis.nominal, diagnosis.model)
    draw_diagnosis(replace(diagnosis, held_out=errors, traces=traces), path)
