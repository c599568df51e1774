"""`task=table_methods` and `task=table_estimators`: the paper's Tables I and II from sweeps of `task=train`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.core.estimation import EstimationResult
from wipx.tasks.files.estimation import read_estimation
from wipx.tasks.files.finished import finished_jobs
from wipx.tasks.files.results import FIGURES, replace_table, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class MethodsTable:
    """Table I: one estimator, trained in the simulations of the five methods.

    Attributes:
        folder: Of the sweep over methods and seeds.
        page: Markdown page whose table is renewed; None for none.
    """

    folder: str
    page: str | None = None

    def run(self, job: Job) -> None:
        """Read the finished jobs, compare, write."""
        from wipx.report.estimation_figures import draw_estimates
        from wipx.report.estimation_tables import methods_table

        results = _results(Path(self.folder), "estimator")
        typical = [
            _typical([r for r in results if r.method == name]) for name in dict.fromkeys(r.method for r in results)
        ]
        table, latex = methods_table(results)
        with written_together(job.out) as folder:
            for suffix in FIGURES:
                draw_estimates(typical, folder / f"estimates{suffix}")
            _write(folder, table, latex)
        _publish(job, Path(self.folder), table, self.page)


@dataclass(frozen=True)
class EstimatorsTable:
    """Table II: estimators and lengths of their windows, trained in one simulation.

    Attributes:
        folder: Of the sweep over estimators, lengths and seeds.
        page: Markdown page whose table is renewed; None for none.
    """

    folder: str
    page: str | None = None

    def run(self, job: Job) -> None:
        """Read the finished jobs, compare, write."""
        from wipx.report.estimation_figures import draw_estimates, draw_lengths
        from wipx.report.estimation_tables import estimators_table

        results = _results(Path(self.folder), "method")
        longest = max(result.length for result in results)
        best = sorted((r for r in results if r.length == longest), key=lambda r: r.recorded.rmse)
        table, latex = estimators_table(results)
        with written_together(job.out) as folder:
            shown = list({r.estimator: r for r in reversed(best)}.values())[::-1]
            for suffix in FIGURES:
                draw_lengths(results, folder / f"lengths{suffix}")
                draw_estimates(shown, folder / f"estimates{suffix}")
            _write(folder, table, latex)
        _publish(job, Path(self.folder), table, self.page)


def _results(sweep: Path, same: str) -> list[EstimationResult]:
    """All results of a sweep, which must share one option and the target."""
    results = [read_estimation(folder) for folder in finished_jobs(sweep)]
    for name in (same, "target"):
        found = sorted({str(getattr(result, name)) for result in results})
        if len(found) > 1:
            raise InputError(f"{sweep}: jobs with different {name}s ({', '.join(found)}); compare one at a time")
    return results


def _typical(results: Sequence[EstimationResult]) -> EstimationResult:
    """The result of median error on recorded robots."""
    ranked = sorted(results, key=lambda result: result.recorded.rmse)
    return ranked[(len(ranked) - 1) // 2]


def _write(folder: Path, table: str, latex: str) -> None:
    (folder / "table.md").write_text(table, encoding="utf-8")
    (folder / "table.tex").write_text(latex, encoding="utf-8")


def _publish(job: Job, sweep: Path, table: str, page: str | None) -> None:
    files = sorted(path for path in job.out.iterdir() if path.suffix in (".md", ".tex", ".png"))
    job.part("tracking").log_sweep(sweep, {}, files)
    if page is not None:
        replace_table(Path(page), table)
    print(f"{table}\npictures: {', '.join(str(path) for path in files if path.suffix == '.png')}")
