"""`task=identify`: complete the nominal model from recordings, and show that it fits better."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from wipx.core.errors import check_positive
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.recording import RecordingSplit
from wipx.core.results import FitErrors, IdentificationResult
from wipx.effects.catalogue import effect_of
from wipx.identify.identification import Identified, Request, identify
from wipx.identify.objectives import Objective
from wipx.identify.windows import check_long_enough
from wipx.library import feedback_of
from wipx.recordings.model_file import read_model, write_model
from wipx.recordings.robot_file import RobotDescription
from wipx.recordings.source import RecordingSource
from wipx.report.tables import summary
from wipx.tasks.files.results import write_csv, write_json, written_together
from wipx.tasks.files.tracked import error_metrics, in_unit, log_run, note_run, recorded_data
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import SearchProgress
from wipx.tracking.run_note import DataNote


@dataclass(frozen=True)
class Identify:
    """Identify the switched-on physics.

    Attributes:
        horizon: Length of the predictions by which models are judged [s]; contract: 0.5.
    """

    horizon: float = 0.5

    def __post_init__(self) -> None:
        check_positive(horizon=self.horizon)

    def run(self, job: Job) -> None:
        """Read, identify, judge, write."""
        self.complete(job, job.part("recordings"))

    def complete(self, job: Job, source: RecordingSource) -> IdentificationResult:
        """Identify on the recordings of a source and leave the results in the job's folder."""
        robot = source.describe()
        recordings = source.load()
        check_long_enough(recordings)
        split = source.split(recordings)
        request = self._request(job, robot)
        objective: Objective = job.part("objective")
        optimizer = job.part("optimizer")
        simulator = job.part("sim")
        with SearchProgress() as progress:
            found = identify(
                request,
                split,
                simulator,
                objective,
                optimizer,
                horizon=self.horizon,
                rng=np.random.default_rng(job.seed),
                watcher=progress,
            )
        result = _result(source, split, request.nominal, found, objective)
        with written_together(job.out) as folder:
            _write(folder, result, found, request.nominal)
            data = recorded_data(source, recordings, "identification")
            _note(job, folder, result, request.nominal.plant, data)
        log_run(job)
        print(summary(result))
        print(f"\npage: {job.out / 'report.html'}")
        return result

    def _request(self, job: Job, robot: RobotDescription) -> Request:
        nominal: Model = job.part("plant").nominal(robot.model)
        earlier = read_model(job.model_path) if job.model_path else None
        friction = job.part("friction")
        nominal = nominal.with_effects(friction.given(nominal, earlier))
        switched_on = tuple(dict.fromkeys((*friction.switched_on(nominal, earlier), *job.effects)))
        return Request(nominal, switched_on, robot.uncertainty, job.free, job.bounds, feedback_of(robot))


def _result(
    source: RecordingSource, split: RecordingSplit, nominal: Model, found: Identified, objective: Objective
) -> IdentificationResult:
    plant = nominal.plant
    columns = (*plant.coordinates, *plant.commands)
    effects = {name: effect_of(name, plant) for name in found.model.effects}
    return IdentificationResult(
        title=source.name,
        plant=plant.kind,
        source=source.place,
        split=split.rule,
        objective=objective.describe(),
        units={column: plant.unit_of(column) for column in columns},
        nominal=_numbers(nominal),
        effects=tuple((name, effect.law, effect.source) for name, effect in effects.items()),
        estimates=found.estimates,
        fit=found.fit,
        held_out=found.held_out,
        history=found.history,
        traces=found.traces,
        notes=found.notes,
    )


def _numbers(model: Model) -> tuple[tuple[str, float, str], ...]:
    plant = model.plant
    body = [(name, value, plant.parameters[name].unit) for name, value in model.parameters.items()]
    for name, values in model.effects.items():
        angular = plant.is_angular(name.partition("/")[0])
        units = {p.name: p.unit(angular=angular) for p in effect_of(name, plant).parameters}
        body += [(f"{name}.{symbol}", value, units[symbol]) for symbol, value in values.items()]
    return tuple(body)


def _write(folder: Path, result: IdentificationResult, found: Identified, nominal: Model) -> None:
    from wipx.report.figure import draw_fit, draw_search
    from wipx.report.page import write_page

    write_model(found.model, folder / "model.yaml")
    write_model(nominal, folder / "nominal.yaml")
    write_json(folder / "metrics.json", metrics(result))
    history = result.history
    write_csv(
        folder / "search.csv",
        {"evaluations": history.evaluations, "seconds": history.seconds, "best_loss": history.best_loss},
    )
    write_page(result, folder / "report.html")
    draw_fit(result, folder / "fit.png")
    draw_search(result, folder / "search.png")


def metrics(result: IdentificationResult) -> dict[str, object]:
    """The figures of a result: errors as in contract section 5 `fit`, and the identified numbers."""
    errors = {"train": result.fit, "heldout": result.held_out}
    return {
        "schema": 1,
        "fit": {"horizon_s": result.fit.horizon, **{k: _errors(e) for k, e in errors.items() if e is not None}},
        "parameters": {
            e.name: {
                "value": e.value,
                "ci95": [e.low, e.high],
                "unit": e.unit,
                "nominal": e.nominal,
                "at_bound": e.at_bound,
            }
            for e in result.estimates
        },
        "search": {
            "optimizer": result.history.optimizer,
            "evaluations": result.history.evaluations[-1],
            "seconds": result.history.seconds[-1],
            "loss": result.history.best_loss[-1],
            "stopped": result.history.stopped,
        },
        "split": result.split,
        "notes": list(result.notes),
    }


def _errors(errors: FitErrors) -> Mapping[str, object]:
    kept = asdict(errors)
    return {name: kept[name] for name in ("nominal", "completed", "noise_floor", "windows")}


def _note(job: Job, folder: Path, result: IdentificationResult, plant: Plant, data: DataNote) -> None:
    figures = error_metrics({"fit": result.fit, "heldout": result.held_out}, plant)
    figures |= {in_unit(f"parameter/{e.name}", e.unit): e.value for e in result.estimates}
    history = result.history
    figures["search/time in s"] = float(history.seconds[-1])
    note_run(
        job,
        folder,
        data.name,
        metrics=figures,
        histories={"search/best_loss": np.column_stack([history.evaluations, history.best_loss])},
        tags={"plant": result.plant, "source": result.source, "effects": ", ".join(n for n, *_ in result.effects)},
        data=[data],
    )
