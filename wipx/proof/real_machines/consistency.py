"""`task=real_consistency`: whether a diagnosis of a real machine depends on the runs that it was given.

The runs of every rig are divided into disjoint groups in several ways. Each group is diagnosed alone, as
`task=diagnose` does, and the completed model predicts all other groups of the same way. Beside it stand the nominal
model, the model that `identify` fits to the same group when it is told the published names, the authors' full model,
and other methods. A group leaves a folder like that of `task=diagnose`, and is not diagnosed again.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model
from wipx.core.recording import Recording, RecordingSplit
from wipx.core.results import HORIZON
from wipx.identify.identification import Request, identify
from wipx.library import feedback_of
from wipx.proof.baseline_answers import MethodAnswer, ask, check_methods
from wipx.proof.real_machines.consistency_table import markdown, size_series
from wipx.proof.real_machines.group_results import OURS, GroupResult, answer_of, read_group, sizes_of, write_group
from wipx.proof.real_machines.published import Published, published_of
from wipx.proof.real_machines.recordings import check_there
from wipx.proof.real_machines.run_groups import ChosenRecordings, Way, choose, usable
from wipx.proof.unseen import Unseen, unseen
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.diagnose import Diagnose
from wipx.tasks.files.results import replace_table, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class Rig:
    """A rig and the ways of dividing its runs.

    Attributes:
        dataset: Name of the source.
        ways: Settings of `Way`, by name.
        published: Settings of `Published`.
        title: In place of the source's; None for that.
        files: Patterns of file names in place of the source's; empty for those.
        parts: Intervals [from, to] in s by pattern of file names, in place of the source's spans.
    """

    dataset: str
    ways: dict[str, dict[str, Any]]
    published: dict[str, Any] = field(default_factory=dict)
    title: str | None = None
    files: list[str] = field(default_factory=list)
    parts: dict[str, list[list[float]]] = field(default_factory=dict)


@dataclass(frozen=True)
class Group:
    """A group that is to be diagnosed.

    Attributes:
        rig: Name of the rig.
        way: Of splitting its runs.
        name: Of the group.
        source: Its recordings.
        others: Recordings of all other groups of the way.
        published: What the authors of the rig published.
        nominal: The model before.
        authors: The authors' full model; None where they published none.
    """

    rig: str
    way: str
    name: str
    source: ChosenRecordings
    others: tuple[Recording, ...]
    published: Published
    nominal: Model
    authors: Model | None

    @property
    def label(self) -> str:
        """Place of the group among all, as a path."""
        return f"{self.rig}/{self.way}/{self.name}"


@dataclass(frozen=True)
class RealConsistency:
    """All groups of all rigs, one after the other.

    Attributes:
        sources: Options of the group `recordings`, by name.
        rigs: Settings of the rigs, by name.
        methods: Options of the group `baseline`, by name.
        only: Names of the rigs to run; empty for all.
        baselines: Methods that are given the same groups, names of `methods`.
        ways: Ways of splitting a rig, at most; None for all.
        groups: Groups of one way that are diagnosed, at most, spread over all; None for all.
        page: Markdown file whose part between the table marks is replaced; None for none.
    """

    sources: dict[str, Any] = field(default_factory=dict)
    rigs: dict[str, Any] = field(default_factory=dict)
    methods: dict[str, Any] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    baselines: tuple[str, ...] = ()
    ways: int | None = None
    groups: int | None = None
    page: str | None = None

    def __post_init__(self) -> None:
        for name in self.only:
            if name not in self.rigs:
                raise unknown_name("rig", name, self.rigs, "task.only")
        for name, most in (("ways", self.ways), ("groups", self.groups)):
            if most is not None and most < 1:
                raise InputError(f"task.{name} is {most}, expected 1 or more, or null for all")
        check_methods(self.baselines, self.methods)

    def run(self, job: Job) -> None:
        """Diagnose group by group, and write table and figure from all that is done."""
        if self.page is not None and not Path(self.page).is_file():
            raise InputError(f"task.page: there is no file {self.page}; correct it")
        groups = self._prepared(job)
        results: list[GroupResult] = []
        published = {group.rig: (group.source.name, group.published) for group in groups}
        begun, worked = time.monotonic(), 0
        try:
            for number, group in enumerate(groups, start=1):
                left = _time_left(time.monotonic() - begun, worked, len(groups) - number + 1)
                print(f"\n[{number}/{len(groups)}] {group.label}{left}", flush=True)
                result, fresh = self._result(replace(job, out=job.out / group.label), group)
                worked += fresh
                results.append(result)
        except BaseException:
            if results:
                self._write(job, results, published)
                print(f"{len(results)} of {len(groups)} groups are done; the same command goes on")
            raise
        table = self._write(job, results, published)
        if self.page is not None:
            replace_table(Path(self.page), table)

    def _write(self, job: Job, results: list[GroupResult], published: Mapping[str, tuple[str, Published]]) -> str:
        from wipx.report.consistency_figure import draw_consistency

        table = markdown(results, published)
        (job.out / "table.md").write_text(table, encoding="utf-8")
        draw_consistency(size_series(results, published), job.out / "sizes.png")
        print(f"\n{table}\ntable: {job.out / 'table.md'}\nfigure: {job.out / 'sizes.png'}")
        return table

    def _prepared(self, job: Job) -> list[Group]:
        """All groups, read before the first diagnosis, so that what is missing is reported at once."""
        rigs = {
            name: job.build({"_target_": f"{Rig.__module__}.Rig", **settings}, f"task.rigs.{name}")
            for name, settings in self.rigs.items()
            if not self.only or name in self.only
        }
        sources = {name: self._source(job, rig) for name, rig in rigs.items()}
        check_there(sources.values())
        return [group for name, rig in rigs.items() for group in self._groups(job, name, rig, sources[name])]

    def _source(self, job: Job, rig: Rig) -> RecordingSource:
        if rig.dataset not in self.sources:
            raise unknown_name("dataset", rig.dataset, self.sources, "task.rigs")
        source = job.build(self.sources[rig.dataset], f"task.sources.{rig.dataset}")
        return replace(source, files=rig.files or source.files, title=rig.title or source.title)

    def _groups(self, job: Job, name: str, rig: Rig, source: RecordingSource) -> list[Group]:
        where = f"task.rigs.{name}"
        published = published_of(job, rig.published, f"{where}.published")
        nominal = job.part("plant").nominal(source.describe().model)
        authors = published.authors_model(nominal, f"{where}.published.authors")
        runs = usable(source, rig.parts)
        groups = []
        for way, settings in list(rig.ways.items())[: self.ways]:
            rule: Way = job.build({"_target_": f"{Way.__module__}.Way", **settings}, f"{where}.ways.{way}")
            divided = rule.groups(runs)
            for group in _spread(tuple(divided), self.groups):
                others = tuple(recording for other in divided if other != group for recording in divided[other])
                chosen = choose(source, divided[group])
                groups.append(Group(name, way, group, chosen, others, published, nominal, authors))
        return groups

    def _result(self, job: Job, group: Group) -> tuple[GroupResult, bool]:
        """The group's result, and whether something had to be computed for it."""
        asked = _asked(job, group)
        result = read_group(asked, job.out)
        fresh = result is None
        predicted = unseen(job, group.source, group.others)
        if result is None:
            result = _diagnosed(job, group, predicted)
            _keep(job, result, asked)
        for method in self.baselines:
            if method not in result.answers:
                fresh = True
                answer = ask(job, method, self.methods[method], group.source, predicted)
                result = replace(result, answers={**result.answers, method: answer})
                _keep(job, result, asked)
        return replace(result, answers={name: result.answers[name] for name in (OURS, *self.baselines)}), fresh


def _keep(job: Job, result: GroupResult, asked: Mapping[str, Any]) -> None:
    with written_together(job.out) as folder:
        write_group(result, asked, folder)


def _asked(job: Job, group: Group) -> dict[str, Any]:
    """What the result of a group depends on, beside the program."""
    spans = [[r.name, len(r), float(r.t[0]), float(r.t[-1])] for r in (*group.source.load(), *group.others)]
    published = {"told": list(group.published.known), "authors": group.published.authors}
    return {"robot": group.source.robot, **published, "recordings": spans, "seed": job.seed}


def _diagnosed(job: Job, group: Group, predicted: Unseen) -> GroupResult:
    """Diagnose a group, and predict the others with every model."""
    recordings = tuple(recording.name for recording in group.source.load())
    plant = group.nominal.plant
    units = {column: plant.unit_of(column) for column in plant.coordinates}
    errors = {"nominal": predicted.errors(group.nominal)}
    try:
        errors["identified"] = _identified(job, group, predicted)
    except InputError as refusal:
        print(f"identify refused: {refusal}")
    if group.authors is not None:
        errors["authors"] = predicted.errors(group.authors)
    try:
        diagnosis = Diagnose().of(job, group.source)
    except InputError as refusal:
        print(f"refused: {refusal}")
        answers = {OURS: MethodAnswer(OURS, refusal=str(refusal))}
        return GroupResult(group.rig, group.way, group.name, recordings, "", answers, (), errors, units)
    errors["noise floor"] = predicted.noise_floor(diagnosis.model)
    answers = {OURS: answer_of(diagnosis, predicted.errors(diagnosis.model))}
    return GroupResult(
        group.rig, group.way, group.name, recordings, diagnosis.verdict, answers, sizes_of(diagnosis), errors, units
    )


def _identified(job: Job, group: Group, predicted: Unseen) -> Mapping[str, float]:
    """Errors of the model that multiple shooting fits to the group when it is told the published names."""
    description = group.source.describe()
    told = tuple(name for name in group.published.known if name not in group.nominal.effects)
    request = Request(group.nominal, told, description.uncertainty, {}, {}, feedback_of(description))
    found = identify(
        request,
        RecordingSplit(group.source.load(), (), "all other groups are held out"),
        job.part("sim"),
        job.part("objective"),
        job.part("optimizer"),
        horizon=HORIZON,
        rng=np.random.default_rng(job.seed),
    )
    with written_together(job.out) as folder:
        write_model(found.model, folder / "identified.yaml")
    return predicted.errors(found.model)


def _spread(names: tuple[str, ...], most: int | None) -> tuple[str, ...]:
    """At most so many of the names, spread evenly, the first and the last among them."""
    if most is None or most >= len(names):
        return names
    return tuple(names[round(place)] for place in np.linspace(0, len(names) - 1, most))


def _time_left(seconds: float, worked: int, left: int) -> str:
    """In words, from the groups that were computed in this run."""
    return f", about {seconds / worked * left / 60.0:.0f} min left" if worked else ""
