"""`task=diagnose`: say what physics a nominal model lacks, and leave the completed model."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.report.diagnosis_json import diagnosis_json
from wipx.report.diagnosis_summary import summary
from wipx.tasks.files.results import write_csv, write_json, written_together
from wipx.tasks.files.tracked import error_metrics, log_run, note_run, parameter_metrics, recorded_data
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress
from wipx.tasks.shared.proposed import record_command
from wipx.tracking.run_note import DataNote

EMULATED = "The recordings are of an emulated robot, not of a real one."


@dataclass(frozen=True)
class Diagnose:
    """Diagnose the recordings of a source.

    Attributes:
        suspects: Effects to ask about once the answer is complete, by "site/kind", each with the values that are
            suspected, by symbol [SI], or with none; None for no questions.
    """

    suspects: dict[str, dict[str, float]] | None = None

    def run(self, job: Job) -> None:
        """Read, diagnose, write."""
        self.of(job, job.part("recordings"))

    def of(self, job: Job, source: RecordingSource) -> Diagnosis:
        """Diagnose the recordings of a source and leave the results in the job's folder.

        Raises:
            InputError: the simulator has no observer, or the recordings or their description are at fault.
        """
        description = source.describe()
        recordings = source.load()
        # Slow to import: input at fault is refused before.
        from wipx.diagnosis.pipeline import KnownRobot, diagnose
        from wipx.library import feedback_of
        from wipx.sim.analytic import AnalyticSimulator

        simulator = job.part("sim")
        if not isinstance(simulator, AnalyticSimulator):
            raise InputError("a diagnosis follows recordings with an observer, which sim=analytic alone has; choose it")
        robot = KnownRobot(
            job.part("plant").nominal(description.model),
            description.uncertainty,
            feedback_of(description),
            description.limits,
        )
        with StageProgress("diagnose") as progress:
            diagnosis = diagnose(
                recordings,
                robot,
                simulator,
                title=source.name,
                source=source.place if source.robot is None else "recordings.robot",
                rng=np.random.default_rng(job.seed),
                watcher=progress,
                suspects=self.suspects,
                rules=job.part("diagnosis"),
            )
        if description.emulated:
            diagnosis = replace(diagnosis, notes=(EMULATED, *diagnosis.notes))
        with written_together(job.out) as folder:
            write_diagnosis(diagnosis, folder)
            _note(job, folder, diagnosis, recorded_data(source, recordings, "diagnosis"))
        log_run(job)
        print(summary(diagnosis))
        command = record_command(diagnosis, source, job.out)
        if command is not None:
            print(f"record it: {command}")
        print(f"\npage: {job.out / 'report.html'}")
        return diagnosis


def write_diagnosis(diagnosis: Diagnosis, folder: Path) -> None:
    """Write diagnosis.json, model.yaml, report.html, diagnosis.png and, where there is one, next_experiment.csv."""
    from wipx.report.diagnosis_figure import draw_diagnosis
    from wipx.report.diagnosis_page import write_diagnosis_page

    write_json(folder / "diagnosis.json", diagnosis_json(diagnosis))
    write_model(diagnosis.model, folder / "model.yaml")
    write_diagnosis_page(diagnosis, folder / "report.html")
    draw_diagnosis(diagnosis, folder / "diagnosis.png")
    if diagnosis.next_experiment is not None and diagnosis.next_experiment.reference:
        write_csv(folder / "next_experiment.csv", diagnosis.next_experiment.reference)


def _note(job: Job, folder: Path, diagnosis: Diagnosis, data: DataNote) -> None:
    plant = diagnosis.nominal.plant
    figures = error_metrics({"fit": diagnosis.fit, "heldout": diagnosis.held_out}, plant)
    figures |= parameter_metrics({p.name: p.value for effect in diagnosis.effects for p in effect.parameters}, plant)
    figures |= {f"evidence/{effect.name} in nats": effect.log_evidence_gain for effect in diagnosis.effects}
    figures |= {"effects found": float(len(diagnosis.effects)), "diagnosis/time in s": diagnosis.seconds}
    named = ", ".join(effect.name for effect in diagnosis.effects) or "none"
    tags = {"plant": plant.kind, "source": diagnosis.source, "verdict": diagnosis.verdict, "effects": named}
    note_run(job, folder, data.name, metrics=figures, tags=tags, data=[data])
