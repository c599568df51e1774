"""`task=margins`: how far closed loops are from instability, and from which loads they recover."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.control.balance_watch import check_carriage
from wipx.control.controller import Controller
from wipx.control.margins import margins
from wipx.control.recovery import Releases, recovery_region
from wipx.core.errors import InputError
from wipx.core.margins import Margins, RecoveryRegion
from wipx.core.model import Model
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.report.numbers import significant
from wipx.tasks.control import Control
from wipx.tasks.dataset import Dataset, training_set_of
from wipx.tasks.files.finished import finish, finished
from wipx.tasks.files.results import FIGURES, written_together
from wipx.tasks.files.tracked import log_run, note_run, training_data
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress


@dataclass(frozen=True)
class ControllerMargins:
    """Compare closed loops on the completed model.

    The model is the simulation of the chosen method, adapted to trials under `controller=lqr`; loops are those of
    task=control, with the estimator that is trained in that simulation where they need one.

    Attributes:
        dataset: Settings of the training set, as of task=dataset.
        controllers: What is compared, by name.
        length: Samples of the estimator's window.
        releases: Settings of `wipx.control.recovery.Releases`: the loads, and what counts as recovered.
    """

    dataset: dict[str, Any] = field(default_factory=dict)
    controllers: dict[str, Any] = field(default_factory=dict)
    length: int = 30
    releases: dict[str, Any] = field(default_factory=dict)

    def run(self, job: Job) -> None:
        """Compute margins, release the robot under all loads, write; nothing where it was done before."""
        if finished(job) is not None:
            log_run(job)
            print(f"{job.out}: finished before, nothing to do")
            return
        settings: Dataset = job.build(self.dataset, "task.dataset")
        releases: Releases = job.build(self.releases, "task.releases")
        controllers = {name: job.build(node, f"task.controllers.{name}") for name, node in self.controllers.items()}
        if not controllers:
            raise InputError("task.controllers is empty; add one, +controller@task.controllers.lqr=lqr")
        if not 2 <= self.length <= settings.length:
            raise InputError(
                f"task.length is {self.length}, expected 2 to {settings.length}, the samples of the training set"
            )
        _check_robot(job)
        with written_together(job.out) as folder:
            robots = training_set_of(job, settings)
            found = {name: _margins(name, controller, robots.model) for name, controller in controllers.items()}
            control = Control(length=self.length, short_rail=releases.rail)
            loops = {name: control.loop(job, controller, robots, folder) for name, controller in controllers.items()}
            with StageProgress("release") as progress:
                region = recovery_region(
                    {name: lambda _, loop=loop: loop for name, loop in loops.items()},
                    robots.model,
                    job.part("sim"),
                    releases,
                    progress,
                )
            write_model(robots.model, folder / "model.yaml")
            _write(job, folder, found, region)
            _note(job, folder, found, region, robots.training.card)
        log_run(job)
        print(f"{_summary(found, region)}: {job.out / 'table.md'}")


def _check_robot(job: Job) -> None:
    """Refuse robots that cannot carry a load, before anything is recorded."""
    target = job.part("target")
    described = target.describe().model if isinstance(target, RecordingSource) else target.nominal()
    model = job.part("plant").nominal(described)
    try:
        check_carriage(model)
    except InputError as error:
        raise InputError(
            f"task=margins releases loaded robots: it needs a body that balances on wheels or on a cart, got a "
            f"{model.plant.kind}; choose another target"
        ) from error


def _margins(name: str, controller: Controller, model: Model) -> Margins:
    """Margins of one controller; `inner` where it moves the balance about which it acts."""
    try:
        found = margins(controller, model)
    except InputError as error:
        reason = str(error).removeprefix("controller: ")
        raise InputError(f"task.controllers.{name}: {reason}; or leave it out, ~task.controllers.{name}") from error
    return replace(found, inner=controller.moves_balance)


def _write(job: Job, folder: Path, found: Mapping[str, Margins], region: RecoveryRegion) -> None:
    from wipx.report.margins_figure import draw_margins, draw_recovery
    from wipx.report.margins_table import margins_table

    for suffix in FIGURES:
        draw_margins(found, folder / f"margins{suffix}")
        draw_recovery(region, folder / f"recovery{suffix}")
    (folder / "table.md").write_text(margins_table(found, region), encoding="utf-8")
    regions = {
        name: {key: values.tolist() for key, values in asdict(recovery).items()} | {"share": recovery.share}
        for name, recovery in region.controllers.items()
    }
    finish(
        job,
        folder,
        {
            "method": job.chosen.get("method"),
            "target": job.chosen.get("target"),
            "estimator": job.chosen.get("estimator"),
            "margins": {name: asdict(one) for name, one in found.items()},
            "region": {**asdict(region), "controllers": regions},
        },
    )


def _summary(found: Mapping[str, Margins], region: RecoveryRegion) -> str:
    least = min(found, key=lambda name: found[name].phase)
    phase = significant(float(np.rad2deg(found[least].phase)))
    shares = ", ".join(f"{name} {round(100 * one.share)}" for name, one in region.controllers.items())
    return (
        f"margins of {len(found)} controllers, least phase {phase} deg ({least}); "
        f"per cent of {region.loads} loads recovered: {shares}"
    )


def _note(
    job: Job, folder: Path, found: Mapping[str, Margins], region: RecoveryRegion, card: Mapping[str, Any]
) -> None:
    figures = {}
    for name, one in found.items():
        figures |= {
            f"{name}/gain down to": one.gain_low,
            f"{name}/gain up to": one.gain_high,
            f"{name}/phase in deg": float(np.rad2deg(one.phase)),
            f"{name}/delay in ms": 1e3 * one.delay,
            f"{name}/loads recovered in per cent": 100.0 * region.controllers[name].share,
        }
    method = str(job.chosen.get("method"))
    note_run(
        job,
        folder,
        f"margins {method} seed {job.seed}",
        metrics={name: value for name, value in figures.items() if np.isfinite(value)},
        tags={"method": method, "target": str(job.chosen.get("target"))},
        data=[training_data(card)],
    )
