"""`task=real_recordings`: what identification finds on recordings of real hardware, as one table.

Each case is a dataset, physics that is switched on, and a horizon. A case leaves a folder like
that of `task=identify`; the table is written from them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from wipx.core.results import Estimate, IdentificationResult
from wipx.identify.friction import JointFriction
from wipx.identify.objectives import MultiStep, Windowed
from wipx.recordings.source import RecordingSource
from wipx.report.numbers import compact, with_interval
from wipx.tasks.identify import Identify
from wipx.tasks.job import Job
from wipx.tasks.results import replace_table


@dataclass(frozen=True)
class Case:
    """One identification.

    Attributes:
        dataset: Name of the source.
        model: What is switched on, in words.
        effects: Effects whose parameters are free, as "site/kind".
        free: Further free parameters, with the relative standard deviation of a prior or None.
        held_out: Files that are held out instead of the dataset's own choice.
        horizon: Length of the predictions by which models are judged [s].
        lead: Time before a prediction from which its state is estimated [s].
        fit_horizon: Length of the windows that are fitted [s].
        windowed: Whether to fit predictions instead of multiple shooting.
        show: Parameters that the table names.
        known: What is known of them from elsewhere, in words.
    """

    dataset: str
    model: str
    effects: tuple[str, ...] = ()
    free: dict[str, float | None] = field(default_factory=dict)
    held_out: tuple[str, ...] = ()
    horizon: float = 0.5
    lead: float = 0.1
    fit_horizon: float = 0.5
    windowed: bool = False
    show: tuple[str, ...] = ()
    known: str = ""


@dataclass(frozen=True)
class RealRecordings:
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

    def run(self, job: Job) -> None:
        """Identify case by case and write the table."""
        cases = {
            name: job.build({"_target_": f"{Case.__module__}.Case", **settings}, f"task.cases.{name}")
            for name, settings in self.cases.items()
            if not self.only or name in self.only
        }
        sources = {name: job.build(node, f"task.sources.{name}") for name, node in self.sources.items()}
        rows = []
        for number, (name, case) in enumerate(cases.items(), start=1):
            print(f"\n[{number}/{len(cases)}] {name}")
            rows.append(_row(case, self._identify(job, name, case, sources[case.dataset])))
        table = "\n".join([*_HEAD, *rows]) + "\n"
        (job.out / "table.md").write_text(table, encoding="utf-8")
        if self.page is not None:
            replace_table(Path(self.page), table)
        print(f"\n{table}\ntable: {job.out / 'table.md'}")

    def _identify(self, job: Job, name: str, case: Case, source: RecordingSource) -> IdentificationResult:
        objective = Windowed(case.fit_horizon, case.lead) if case.windowed else MultiStep(case.fit_horizon)
        own: Mapping[str, Any] = {"objective": objective, "friction": JointFriction(())}
        chosen = replace(source, held_out=list(case.held_out)) if case.held_out else source
        part = job.part

        def given(group: str) -> Any:
            return own[group] if group in own else part(group)

        mine = replace(job, out=job.out / name, effects=case.effects, free=case.free, part=given)
        return Identify(case.horizon, case.lead).complete(mine, chosen)


_HEAD = [
    "| recordings | model | horizon, s | held-out error before | after | identified | known from elsewhere |",
    "| --- | --- | --- | --- | --- | --- | --- |",
]


def _row(case: Case, result: IdentificationResult) -> str:
    errors = result.held_out or result.fit
    before, after = (
        ", ".join(f"{column} {compact(value, 3)} {result.units[column]}" for column, value in model.items())
        for model in (errors.nominal, errors.completed)
    )
    estimates = {e.name: e for e in result.estimates}
    found = "; ".join(_shown(estimates[name]) for name in case.show)
    return f"| {result.title} | {case.model} | {case.horizon:g} | {before} | {after} | {found} | {case.known} |"


def _shown(estimate: Estimate) -> str:
    rounded = with_interval(estimate.value, estimate.low, estimate.high)
    return f"{estimate.name} = {rounded.value} {rounded.ends} {estimate.unit}"
