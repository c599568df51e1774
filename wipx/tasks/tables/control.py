"""`task=table_control`: finished sweeps of `task=control` as tables, figures and a moving picture."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from wipx.core.control_result import ControlResult
from wipx.core.errors import InputError
from wipx.tasks.files.control import read_control
from wipx.tasks.files.finished import finished_jobs
from wipx.tasks.files.results import FIGURES, replace_table, written_together
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class ControlTable:
    """Controllers beside the baseline, and what the reality gap costs.

    Attributes:
        folder: Of the sweep over controllers and scenarios.
        methods: Of the sweep over methods, scenarios and seeds; None to leave that table out.
        baseline: Controller that the others are compared with.
        ours: Controller that is compared load by load.
        film_scenario: Of the moving picture.
        film_load: Likewise.
        film: Where a copy of the moving picture goes; None for none.
        page: Markdown page whose table is renewed; None for none.
    """

    folder: str
    methods: str | None = None
    baseline: str = "lqr"
    ours: str = "lqr_equilibrium"
    film_scenario: str = "balancing"
    film_load: str = "b5"
    film: str | None = None
    page: str | None = None

    def run(self, job: Job) -> None:
        """Read the finished jobs, compare, write."""
        from wipx.report.control_animation import animate
        from wipx.report.control_figures import draw_errors

        sweep = Path(self.folder)
        scenarios = by_scenario(_results(sweep), sweep, (self.baseline, self.ours))
        studied = [] if self.methods is None else comparable(_results(Path(self.methods)), Path(self.methods))
        pair = self._film_pair(scenarios)
        with written_together(job.out) as folder:
            table = self._write_tables(folder, scenarios, studied)
            for name, results in scenarios.items():
                for suffix in FIGURES:
                    draw_errors(results, folder / f"{name}{suffix}")
            animate(pair, self.film_load, folder / "control.gif")
        self._publish(job, table)

    def _write_tables(
        self, folder: Path, scenarios: dict[str, list[ControlResult]], studied: Sequence[ControlResult]
    ) -> str:
        """Write all tables as Markdown and as LaTeX; returns the former."""
        from wipx.report.control_table import (
            CONTROLLERS_HEAD,
            METHODS_HEAD,
            PAYLOADS_HEAD,
            controller_rows,
            method_rows,
            payload_rows,
            tables,
        )

        payloads, controllers = [], []
        for results in scenarios.values():
            baseline, ours = (next(r for r in results if r.controller == name) for name in (self.baseline, self.ours))
            payloads += payload_rows(baseline, ours)
            controllers += controller_rows(baseline, results)
        written = [tables(PAYLOADS_HEAD, payloads), tables(CONTROLLERS_HEAD, controllers)]
        if studied:
            written.append(tables(METHODS_HEAD, method_rows(studied)))
        for kind, texts in zip(("md", "tex"), zip(*written, strict=True), strict=True):
            (folder / f"table.{kind}").write_text("\n".join(texts), encoding="utf-8")
        return "\n".join(markdown for markdown, _ in written)

    def _film_pair(self, scenarios: dict[str, list[ControlResult]]) -> list[ControlResult]:
        """Baseline and ours in the scenario of the moving picture."""
        if self.film_scenario not in scenarios:
            raise InputError(
                f"task.film_scenario is {self.film_scenario}, expected one of the sweep: {', '.join(scenarios)}"
            )
        results = scenarios[self.film_scenario]
        pair = [next(r for r in results if r.controller == name) for name in (self.baseline, self.ours)]
        if self.film_load not in pair[0].loads:
            raise InputError(f"task.film_load is {self.film_load}, expected one of {', '.join(pair[0].loads)}")
        return pair

    def _publish(self, job: Job, table: str) -> None:
        files = sorted(path for path in job.out.iterdir() if path.suffix in (".md", ".tex", ".png", ".gif"))
        job.part("tracking").log_sweep(Path(self.folder), {}, files)
        if self.page is not None:
            replace_table(Path(self.page), table)
        if self.film is not None:
            Path(self.film).write_bytes((job.out / "control.gif").read_bytes())
        print(f"{table}\npictures: {', '.join(str(path) for path in files if path.suffix in ('.png', '.gif'))}")


def comparable(results: Sequence[ControlResult], sweep: Path) -> list[ControlResult]:
    """The results, which must be of one robot, one rail in each scenario, and the same trials.

    Raises:
        InputError: they are not.
    """
    for name in dict.fromkeys(result.scenario for result in results):
        own = [result for result in results if result.scenario == name]
        for what, found in (
            ("targets", {r.target for r in own}),
            ("rails", {r.rail for r in own}),
            ("loads or numbers of trials", {tuple((t.load, t.number, t.pitch) for t in r.trials) for r in own}),
        ):
            if len(found) > 1:
                raise InputError(f"{sweep}: jobs of {name} with different {what}; compare one experiment at a time")
    return list(results)


def by_scenario(
    results: Sequence[ControlResult], sweep: Path, needed: tuple[str, ...]
) -> dict[str, list[ControlResult]]:
    """The results of each scenario, one for each controller, the `needed` ones first.

    Raises:
        InputError: they cannot be compared, a scenario lacks a controller that others have, or has one twice.
    """
    comparable(results, sweep)
    controllers = tuple(dict.fromkeys((*needed, *(result.controller for result in results))))
    ordered = {}
    for name in dict.fromkeys(result.scenario for result in results):
        own = [result for result in results if result.scenario == name]
        for controller in controllers:
            count = sum(result.controller == controller for result in own)
            if count != 1:
                raise InputError(
                    f"{sweep}: {count} jobs of {name} with controller={controller}, expected one; run the sweep again"
                )
        ordered[name] = sorted(own, key=lambda result: controllers.index(result.controller))
    return ordered


def _results(sweep: Path) -> list[ControlResult]:
    return [read_control(folder) for folder in finished_jobs(sweep)]
