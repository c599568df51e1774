"""`task=pipeline`: the whole chain on a testbed: record, identify, judge on fresh recordings."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.sim.simulator import StateFeedback
from wipx.tasks.identify import Identify
from wipx.tasks.job import Job
from wipx.tasks.results import write_csv, written_together

FITTED = tuple(f"r{i}" for i in range(1, 7))
FRESH = tuple(f"fresh{i}" for i in range(1, 4))


@dataclass(frozen=True)
class Pipeline:
    """Record the target, complete its model, judge the model on recordings that it never saw.

    Attributes:
        effects: Switched on beside the friction where the run names none.
        horizon: Length of the predictions by which models are judged [s].
        lead: Time before a prediction from which its state is estimated [s].
    """

    effects: tuple[str, ...] = ("actuator/delay", "actuator/dead_zone")
    horizon: float = 0.5
    lead: float = 0.3

    def run(self, job: Job) -> None:
        """Record, identify, judge, write."""
        testbed = job.part("target")
        nominal: Model = job.part("plant").nominal(testbed.nominal())
        controller = job.part("controller")
        feedback: StateFeedback = controller.feedback(nominal)
        rng = np.random.default_rng(job.seed)
        names = tuple(f"{name}.csv" for name in (*FITTED, *FRESH))
        print(f"recording the emulated testbed ({len(names)} runs), a {nominal.plant.kind} ...")
        run = testbed.record(nominal, feedback, controller.rate, rng, names)
        with written_together(job.out) as folder:
            (folder / "recordings").mkdir()
            _write_robot(folder / "recordings" / "robot.yaml", nominal, feedback, controller.rate)
            for recording in run.recordings:
                _write_recording(folder / "recordings" / recording.name, recording)
            write_model(run.hidden, folder / "hidden.yaml")
        source = RecordingSource(
            path=str(job.out / "recordings"), title="emulated testbed", held_out=[f"{name}.csv" for name in FRESH]
        )
        effects = job.effects or self.effects
        Identify(self.horizon, self.lead).complete(replace(job, effects=effects), source)
        print(f"what the testbed really had: {job.out / 'hidden.yaml'}")


def _write_robot(path: Path, nominal: Model, feedback: StateFeedback, rate: float) -> None:
    gains = feedback.gains.tolist()
    robot = {
        "plant": nominal.plant.kind,
        "parameters": dict(nominal.parameters),
        "controller": {"kind": "lqr", "gains": gains[0] if len(gains) == 1 else gains, "rate": rate},
    }
    path.write_text(yaml.safe_dump(robot, sort_keys=False), encoding="utf-8")


def _write_recording(path: Path, recording: Recording) -> None:
    write_csv(path, dict(recording.columns))
