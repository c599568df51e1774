"""`task=record`: excitations, or the experiment that a diagnosis proposes, run on a target and recorded."""

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from wipx.control.controller import Controller
from wipx.core.errors import InputError, check_positive
from wipx.core.loop_quality import quality_words
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.hardware.excitations import EXCITATIONS, ExcitationName
from wipx.hardware.target import KeepsLogs, Target, Trial
from wipx.recordings.source import RecordingSource
from wipx.tasks.files.results import written_together
from wipx.tasks.files.tracked import log_run, note_run, recorded_data
from wipx.tasks.shared.driven import driven_target, excited_trial, logged_slower
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.loops import missed, worst
from wipx.tasks.shared.proposed import ProposedExperiment, named, read_experiment
from wipx.tasks.shared.record_note import begin_note, note_recording, read_note
from wipx.tasks.shared.trials import write_recording, write_robot

SHORTEST = 1.0  # [s] of a recording; a prediction of 0.5 s starts 0.5 s after the first row
SLOWEST = 20.0  # [Hz] rows of a recording on average: a window of 0.5 s needs a few even where the loop stalled
GRID = 1e-3  # [s] at which a reference is looked at before the robot moves


@dataclass(frozen=True)
class Record:
    """Leave recordings, robot.yaml and, of hardware, the raw CAN log and the loop's quality of every trial.

    Recordings are written as they come: what stops a trial or the program leaves all that was recorded until then, and
    the same command records what is missing.

    Attributes:
        excitations: What the robot does, one recording each.
        duration: Of each excitation [s].
        experiment: Done in their place: the folder of a diagnosis, or a table with t and x_ref; None for none.
        log_every: Ticks of the loop per row of the log; a row has the mean of their commands.
    """

    excitations: tuple[ExcitationName, ...] = EXCITATIONS
    duration: float = 8.0
    experiment: str | None = None
    log_every: int = 6

    def __post_init__(self) -> None:
        check_positive(duration=self.duration, log_every=self.log_every)
        if not self.excitations:
            raise InputError(f"task.excitations is empty; name at least one of {', '.join(EXCITATIONS)}")
        if self.duration < SHORTEST:
            raise InputError(f"task.duration is {self.duration:g} s, expected {SHORTEST:g} s or more")

    def run(self, job: Job) -> None:
        """Record what is missing."""
        target = driven_target(job, job.out)
        nominal: Model = job.part("plant").nominal(target.nominal())
        controller: Controller = job.part("controller")
        feedback = controller.state_feedback(nominal)
        if feedback is None:
            raise InputError("controller: recordings are made under a plain state feedback; use controller=lqr")
        proposed = None if self.experiment is None else read_experiment(Path(self.experiment), nominal.plant)
        trials = self._trials(proposed, nominal, np.random.default_rng(job.seed))
        _check_room(trials, nominal, target.rail)
        loop = controller.loop(nominal)
        begin_note(job.out, job.overrides)
        missing = [trial for trial in trials if not (job.out / trial.name).is_file()]
        write_robot(job.out / "robot.yaml", nominal, (feedback, controller.rate), {}, emulated=target.emulated)
        rng = np.random.default_rng([job.seed, len(trials) - len(missing)])
        try:
            for recording in _shown(target.run(missing, loop, rng), missing, target):
                self._keep(job.out, logged_slower(recording, self.log_every, controller.rate))
        finally:
            print(_summary(job.out, trials, proposed, target))
        self._note(job, target)

    def _trials(self, proposed: ProposedExperiment | None, nominal: Model, rng: np.random.Generator) -> list[Trial]:
        if proposed is not None:
            names = _numbered([proposed.trial.name] * proposed.repeats)
            return [named(proposed.trial, name) for name in names]
        names = _numbered(self.excitations)
        kinds = zip(names, self.excitations, strict=True)
        return [excited_trial(name, kind, self.duration, nominal, rng) for name, kind in kinds]

    def _keep(self, folder: Path, recording: Recording) -> None:
        """Write a recording, if it is long enough to be diagnosed, and note it."""
        kept = recording.duration >= SHORTEST and len(recording) >= SLOWEST * recording.duration
        if kept:
            write_recording(folder / recording.name, recording)
        note_recording(folder, recording, kept=kept)

    def _note(self, job: Job, target: Target) -> None:
        """Leave what MLflow shows of the run."""
        source = RecordingSource(path=str(job.out))
        recordings = source.load()
        figures = {"recordings": float(len(recordings)), "recorded/time in s": sum(r.duration for r in recordings)}
        for name, values in worst(_loops(job.out)).items():
            figures |= {f"loop/{name.replace('_', ' ')} {share} in s": value for share, value in values.items()}
        origin = "emulated" if target.emulated else "real"
        with written_together(job.out) as folder:
            data = [recorded_data(source, recordings, "recorded")]
            tags = {"plant": target.nominal().plant.kind, "target": job.chosen.get("target", ""), "robot": origin}
            note_run(job, folder, f"{origin} recordings", metrics=figures, tags=tags, data=data)
        log_run(job)


def _numbered(names: Sequence[str]) -> list[str]:
    """File names; of the second of a kind on with a number."""
    files = []
    for i, name in enumerate(names):
        count = names[: i + 1].count(name)
        files.append(f"{name}.csv" if count == 1 else f"{name}{count}.csv")
    return files


def _check_room(trials: Sequence[Trial], nominal: Model, rail: float) -> None:
    """Refuse a reference that leaves the rail, before the robot moves."""
    if "x" not in nominal.plant.coordinates:
        return
    x = nominal.plant.coordinates.index("x")
    for trial in trials:
        if trial.reference is None:
            continue
        furthest = max(abs(float(trial.reference(t)[x])) for t in np.arange(0.0, trial.duration, GRID))
        if furthest > rail:
            raise InputError(
                f"{trial.name}: the reference reaches {furthest:.3g} m, and the robot may go {rail:.3g} m to either "
                "side; choose another one, or widen target.limits.rail (target=emulated: target.rail) if there is room"
            )


def _shown(runs: Iterator[Recording], trials: Sequence[Trial], target: Target) -> Iterator[Recording]:
    """With a bar, where the target does not tell itself how each trial went."""
    told = isinstance(target, KeepsLogs)
    yield from tqdm(runs, desc="record", total=len(trials), leave=False, disable=True if told else None)


def _loops(folder: Path) -> list[dict[str, Any]]:
    """The loop's quality of every trial; none of an emulated testbed, which has no clock."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*_loop.json"))]


def _summary(folder: Path, trials: Sequence[Trial], proposed: ProposedExperiment | None, target: Target) -> str:
    """What is there, how well the loop kept time, and the command that diagnoses it."""
    note = read_note(folder)["recordings"]
    kept = [trial for trial in trials if (folder / trial.name).is_file()]
    seconds = sum(note[trial.name]["seconds"] for trial in kept if trial.name in note)
    origin = "of an emulated robot, not of a real one" if target.emulated else "of a real robot"
    lines = [f"{len(kept)} of {len(trials)} recordings in {folder}, {seconds:.1f} s, {origin}"]
    for trial in trials:
        known = note.get(trial.name)
        if known is not None and not known["kept"]:
            needed = f"expected {SHORTEST:g} s and {SLOWEST:g} rows per second"
            lines.append(f"  {trial.name}: left out, {known['rows']} rows in {known['seconds']:.2f} s ({needed})")
        elif known is not None and known["seconds"] < 0.95 * trial.duration:
            lines.append(f"  {trial.name}: stopped after {known['seconds']:.2f} of {trial.duration:g} s")
    loops = _loops(folder)
    if loops:
        skipped, lost = missed(loops)
        lines.append(f"loop, worst trial: {quality_words(worst(loops))}; {skipped} steps skipped, {lost} replies lost")
    if kept:
        path = str(folder) if proposed is None or proposed.diagnosed is None else f"[{proposed.diagnosed},{folder}]"
        lines.append(f"diagnose: {shlex.join(['python', '-m', 'wipx', 'task=diagnose', f'recordings.path={path}'])}")
    return "\n".join(lines)
