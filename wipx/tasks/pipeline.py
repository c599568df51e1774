"""`task=pipeline`: the whole chain on a robot: record, identify, judge on fresh recordings."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from wipx.core.errors import InputError, check_positive
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.hardware.excitations import KINDS, excitation
from wipx.hardware.target import Target, Trial
from wipx.hardware.testbed import EmulatedTestbed
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.identify import Identify
from wipx.tasks.job import Job
from wipx.tasks.results import write_csv, written_together
from wipx.tasks.trials import recording_controller, write_robot

FITTED = tuple(f"r{i}.csv" for i in range(1, 7))
FRESH = tuple(f"fresh{i}.csv" for i in range(1, 4))
RELEASED_AT, LEANING = (0.03, 0.06), 0.01  # [rad] pitch at the start of a release, and of the other runs


@dataclass(frozen=True)
class Pipeline:
    """Record the target without load, complete its model, judge the model on recordings that it never saw.

    Attributes:
        effects: Switched on beside the friction where the run names none.
        horizon: Length of the predictions by which models are judged [s].
        lead: Time before a prediction from which its state is estimated [s].
        duration: Of each recording [s].
        log_every: Ticks of the loop per row of the log; a row has the mean of their commands.
    """

    effects: tuple[str, ...] = ("actuator/delay", "actuator/dead_zone", "sensor_theta/bias")
    horizon: float = 0.5
    lead: float = 0.3
    duration: float = 10.0
    log_every: int = 2

    def __post_init__(self) -> None:
        check_positive(duration=self.duration, log_every=self.log_every)

    def run(self, job: Job) -> None:
        """Record, identify, judge, write."""
        target: Target | RecordingSource = job.part("target")
        if isinstance(target, RecordingSource):
            raise InputError(
                "task=pipeline runs a robot; use task=diagnose or task=identify recordings.path=... for recordings"
            )
        nominal: Model = job.part("plant").nominal(target.nominal())
        controller = recording_controller(job)
        rng = np.random.default_rng(job.seed)
        trials = [self._trial(k, name, nominal, rng) for k, name in enumerate((*FITTED, *FRESH))]
        print(f"recording {len(trials)} runs of a {nominal.plant.kind} ({type(target).__name__}) ...")
        with written_together(job.out) as folder:
            (folder / "recordings").mkdir()
            write_robot(folder / "recordings" / "robot.yaml", nominal, controller, {})
            for recording in target.run(trials, controller.loop(nominal), rng):
                slow = logged_slower(recording, self.log_every)
                write_csv(folder / "recordings" / slow.name, dict(slow.columns))
            if isinstance(target, EmulatedTestbed):
                hidden = target.hidden()
                write_model(hidden.model, folder / "hidden.yaml")
                _write_yaml(folder / "hidden_signals.yaml", hidden.beside_the_model())
        source = RecordingSource(path=str(job.out / "recordings"), title=type(target).__name__, held_out=list(FRESH))
        effects = job.effects or self.effects
        Identify(self.horizon, self.lead).complete(replace(job, effects=effects), source)
        if isinstance(target, EmulatedTestbed):
            print(f"what the testbed really had: {job.out / 'hidden.yaml'}, {job.out / 'hidden_signals.yaml'}")

    def _trial(self, number: int, name: str, nominal: Model, rng: np.random.Generator) -> Trial:
        pitch = rng.uniform(*RELEASED_AT) if number % KINDS == 0 else rng.uniform(-LEANING, LEANING)
        return Trial(name, self.duration, pitch=pitch, reference=excitation(number, nominal.plant, rng))


def logged_slower(recording: Recording, every: int) -> Recording:
    """Every so many rows of a recording; commands and reported forces are the mean until the next row."""
    if every == 1:
        return recording
    rows = (len(recording) - 1) // every * every
    seconds = np.diff(recording.t)[:rows].reshape(-1, every)
    columns = {}
    for name, values in recording.columns.items():
        if name.startswith("u"):
            columns[name] = (values[:rows].reshape(-1, every) * seconds).sum(axis=1) / seconds.sum(axis=1)
        else:
            columns[name] = values[:rows:every]
    return Recording(recording.name, columns, recording.source, recording.periods * every)


def _write_yaml(path: Path, content: dict[str, Any]) -> None:
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
