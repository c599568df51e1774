"""`task=export`: a completed model as a file for other simulators, and what that costs; contract section 6."""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.export_result import FILE, RUNTIME, WIPX, ExportErrors, Statement
from wipx.core.model import Model
from wipx.export.isaac import isaac_actuators
from wipx.export.judged import judged
from wipx.export.mjcf import ExportedFile, export_mjcf
from wipx.export.urdf_file import export_urdf
from wipx.recordings.model_file import read_model, write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.files.results import write_json, written_together
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress

FORMATS = {"mjcf": (export_mjcf, "robot.xml"), "urdf": (export_urdf, "robot.urdf")}
WORDS = {WIPX: "wipx", FILE: "the file alone", RUNTIME: "the file with its runtime"}


@dataclass(frozen=True)
class Export:
    """Write a completed model as MJCF or URDF.

    Attributes:
        step: Of the file's integrator [s]; None for that of the owner's file, or 1 ms.
    """

    step: float | None = None

    def __post_init__(self) -> None:
        if self.step is not None:
            check_positive(step=self.step)

    def run(self, job: Job) -> None:
        """Write the robot, model.yaml, isaac_lab.yaml, export.json and, with recordings, export.png."""
        form = str(job.settings["format"])
        if form not in FORMATS:
            raise unknown_name("format", form, FORMATS)
        if job.model_path is None:
            raise InputError("task=export needs a completed model; give model.path=OUT/model.yaml")
        model = read_model(job.model_path)
        write, name = FORMATS[form]
        file = write(model, self.step)
        if job.settings["strict"]:
            _refuse(file, form)
        source: RecordingSource = job.part("recordings")
        errors = None
        if source.path is not None:
            file, errors = self._judged(job, model, file, source)
        with written_together(job.out) as folder:
            (folder / name).write_text(file.text, encoding="utf-8")
            write_model(model, folder / "model.yaml")
            (folder / "isaac_lab.yaml").write_text(isaac_actuators(model, file.step), encoding="utf-8")
            write_json(folder / "export.json", _content(job, form, name, file, errors))
            if errors is not None:
                from wipx.report.export_figure import draw_export

                units = {column: model.plant.unit_of(column) for column in model.plant.coordinates}
                draw_export(errors, units, job.part("recordings").name, folder / "export.png")
        print(_summary(model, file, errors, job.out / name))

    def _judged(
        self, job: Job, model: Model, file: ExportedFile, source: RecordingSource
    ) -> tuple[ExportedFile, ExportErrors]:
        """The file's statements with what they cost on the recordings, and all errors there."""
        described = source.describe().model.plant
        if described.coordinates != model.plant.coordinates or described.commands != model.plant.commands:
            raise InputError(
                f"{job.model_path}: a model with {', '.join(model.plant.coordinates)}, the recordings in "
                f"{source.place} are of a robot with {', '.join(described.coordinates)}; choose those of the same robot"
            )
        with StageProgress("export") as progress:
            errors, said = judged(model, file, job.part("sim"), source.load(), progress)
        return replace(file, statements=said), errors


def _refuse(file: ExportedFile, form: str) -> None:
    """Refuse a file that lacks an effect.

    Raises:
        InputError: the format cannot say an effect.
    """
    for statement in file.statements:
        if statement.status != "exact":
            raise InputError(
                f"strict=true: format={form} cannot say {statement.effect} ({statement.status}: {statement.how}); "
                f"leave strict out, or use wipx.export.mujoco_runtime"
            )


def _content(job: Job, form: str, name: str, file: ExportedFile, errors: ExportErrors | None) -> dict[str, object]:
    """Content of export.json."""
    content: dict[str, object] = {
        "schema": 1,
        "format": form,
        "file": name,
        "model": str(job.model_path),
        "built_from": "model.yaml" if file.source is None else str(file.source),
        "owners_file_not_used": file.note or None,
        "step_s": file.step,
        "effects": {s.effect: {"status": s.status, "how": s.how, "cost": s.cost} for s in file.statements},
    }
    if errors is not None:
        content["errors"] = {
            "recordings": [trace.name for trace in errors.traces],
            "horizon_s": errors.horizon,
            "windows": errors.windows,
            "rms": errors.rms,
            "noise_floor": errors.noise_floor,
        }
    return content


def _summary(model: Model, file: ExportedFile, errors: ExportErrors | None, path: Path) -> str:
    """What a person wants to know at once."""
    counts = Counter(statement.status for statement in file.statements)
    said = ", ".join(f"{counts[status]} {status}" for status in ("exact", "approximated", "lost") if counts[status])
    lines = [f"{path}: effects {said or 'none'}", *(_line(model, statement) for statement in file.statements)]
    if file.note:
        lines.append(f"built from model.yaml, not from the owner's file: {file.note}")
    if errors is not None:
        lines.append(f"rms error of {errors.windows} predictions over {errors.horizon:g} s:")
        for way, values in errors.rms.items():
            figures = ", ".join(f"{name} {value:.4g} {model.plant.unit_of(name)}" for name, value in values.items())
            lines.append(f"  {WORDS[way]}: {figures}")
    return "\n".join(lines)


def _line(model: Model, statement: Statement) -> str:
    cost = ""
    if statement.cost is not None:
        parts = (f"{value:+.2g} {model.plant.unit_of(name)} of {name}" for name, value in statement.cost.items())
        cost = f"; costs {', '.join(parts)}"
    return f"  {statement.effect}: {statement.status} ({statement.how}){cost}"
