"""`task=optimizer_table` and `task=method_table`: finished sweeps of `task=adapt` as tables and figures."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wipx.core.adaptation import AdaptationResult
from wipx.core.errors import InputError
from wipx.recordings.model_file import read_model
from wipx.tasks.files.adaptation import read_adaptation
from wipx.tasks.files.finished import finished_jobs
from wipx.tasks.files.results import FIGURES, replace_table, write_csv, written_together
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.trials import hidden_file


@dataclass(frozen=True)
class OptimizerTable:
    """Which optimizers succeed, from a sweep over optimizers and seeds.

    Attributes:
        folder: Of the sweep.
        page: Markdown page whose table is renewed; None for none.
    """

    folder: str
    page: str | None = None

    def run(self, job: Job) -> None:
        """Read the finished jobs, compare, write."""
        from wipx.report.adaptation_figures import draw_convergence
        from wipx.report.adaptation_tables import optimizer_scores, optimizer_table

        sweep = Path(self.folder)
        runs = _runs(sweep)
        searched = [run for run in runs if run.history is not None]
        if len(searched) < len(runs):
            raise InputError(f"{sweep}: jobs in which nothing was searched; task=optimizer_table compares optimizers")
        scores = optimizer_scores(searched, _truth(searched))
        table = optimizer_table(scores)
        with written_together(job.out) as folder:
            (folder / "table.md").write_text(table, encoding="utf-8")
            for suffix in FIGURES:
                draw_convergence(searched, folder / f"convergence{suffix}")
        _publish(job, sweep, table, self.page, job.out / "convergence.png")


@dataclass(frozen=True)
class MethodTable:
    """The reality gap that each method leaves, from a sweep over methods and seeds.

    Attributes:
        folder: Of the sweep.
        page: Markdown page whose table is renewed; None for none.
    """

    folder: str
    page: str | None = None

    def run(self, job: Job) -> None:
        """Read the finished jobs, compare, write."""
        from wipx.report.adaptation_figures import draw_trajectories
        from wipx.report.adaptation_tables import method_table

        sweep = Path(self.folder)
        runs = _runs(sweep)
        table = method_table(runs)
        typical = [
            _typical([run for run in runs if run.method == name]) for name in dict.fromkeys(r.method for r in runs)
        ]
        with written_together(job.out) as folder:
            (folder / "table.md").write_text(table, encoding="utf-8")
            for suffix in FIGURES:
                draw_trajectories(typical, folder / f"trajectories{suffix}")
            write_csv(folder / "trajectories.csv", _columns(typical))
        _publish(job, sweep, table, self.page, job.out / "trajectories.png")


def _runs(sweep: Path) -> list[AdaptationResult]:
    """All results of a sweep, which must be of one robot."""
    runs = [read_adaptation(folder) for folder in finished_jobs(sweep)]
    targets = sorted({run.target for run in runs})
    if len(targets) > 1:
        raise InputError(f"{sweep}: jobs with different recordings ({', '.join(targets)}); compare one robot at a time")
    return runs


def _truth(runs: Sequence[AdaptationResult]) -> dict[str, float] | None:
    """The true numbers of an emulated robot, where its physics is that of the model; only tables look at them."""
    path = hidden_file(Path(runs[0].target))
    if not path.is_file():
        return None
    hidden = read_model(path)
    try:
        return {name: hidden.value(name) for run in runs for name in run.parameters}
    except KeyError:
        return None


def _typical(runs: Sequence[AdaptationResult]) -> AdaptationResult:
    """The run of median loss."""
    ranked = sorted(runs, key=lambda run: run.fit.value)
    return ranked[(len(ranked) - 1) // 2]


def _columns(runs: Sequence[AdaptationResult]):
    """Recorded trajectories and those of every method, by column of a table."""
    columns = {"t": runs[0].classes[0].t}
    for i, c in enumerate(runs[0].classes):
        for j, column in enumerate(runs[0].coordinates):
            columns[f"{c.name}.{column}.recorded"] = c.recorded[:, j]
            for run in runs:
                columns[f"{c.name}.{column}.{run.method}"] = run.classes[i].simulated[:, j]
    return columns


def _publish(job: Job, sweep: Path, table: str, page: str | None, picture: Path) -> None:
    job.part("tracking").log_sweep(sweep, {}, [job.out / "table.md", picture])
    if page is not None:
        replace_table(Path(page), table)
    print(f"{table}\npicture: {picture}")
