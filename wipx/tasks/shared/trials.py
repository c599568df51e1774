"""Trials of a robot with known loads on its body, recorded once and read by every job that needs them."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from tqdm import tqdm

from wipx.control.controller import Controller
from wipx.core.errors import InputError, check_positive
from wipx.core.load import Load
from wipx.core.locked import locked
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.whole_file import write_whole
from wipx.hardware.target import Target, Trial
from wipx.hardware.testbed import EmulatedTestbed
from wipx.recordings.model_file import write_model
from wipx.recordings.source import RecordingSource
from wipx.sim.cache import simulator_digest
from wipx.sim.simulator import StateFeedback
from wipx.tasks.files.results import write_csv
from wipx.tasks.shared.driven import driven_target
from wipx.tasks.shared.job import Job

FOLDER = Path("runs/trials")
DECIDING = ("target", "controller", "plant")  # parts whose settings change what is recorded


@dataclass(frozen=True)
class TrialPlan:
    """What is recorded.

    Attributes:
        per_load: Trials with each load.
        duration: Of a trial [s].
        seed: Of what differs between trials of an emulated robot.
    """

    per_load: int = 5
    duration: float = 1.25
    seed: int = 0

    def __post_init__(self) -> None:
        check_positive(per_load=self.per_load, duration=self.duration)


def trials_of(job: Job, plan: TrialPlan) -> RecordingSource:
    """The recorded trials of the chosen target; made now if they do not exist.

    Trials are kept in a folder of their own, one for each target, controller and plan. An interrupted recording goes
    on where it stopped, and parallel jobs wait for each other.

    Raises:
        InputError: the target cannot be run, or its recordings are at fault.
    """
    if isinstance(job.part("target"), RecordingSource):
        return job.part("target")
    folder = FOLDER / _digest(job, plan, job.part("target"))
    target = driven_target(job, folder)
    with locked(folder / ".lock"):
        _record(job, target, plan, folder)
    return RecordingSource(path=str(folder), title=f"trials of {type(target).__name__}")


def hidden_file(folder: Path) -> Path:
    """Where the true robot of emulated trials is written down, beside their folder; no adaptation reads it."""
    return folder.with_name(f"{folder.name}.hidden.yaml")


def _record(job: Job, target: Target, plan: TrialPlan, folder: Path) -> None:
    trials = [Trial(f"{load}_{k + 1}.csv", plan.duration, load) for load in target.loads for k in range(plan.per_load)]
    missing = [(k, trial) for k, trial in enumerate(trials) if not (folder / trial.name).is_file()]
    if not missing:
        return
    controller: Controller = job.part("controller")
    nominal = job.part("plant").nominal(target.nominal())
    feedback = controller.state_feedback(nominal)
    if feedback is None:
        raise InputError("controller: recordings for a model are made under a plain state feedback; use controller=lqr")
    if not (folder / "robot.yaml").is_file():
        write_robot(folder / "robot.yaml", nominal, (feedback, controller.rate), target.loads, emulated=target.emulated)
    if isinstance(target, EmulatedTestbed):
        write_model(target.hidden().model, hidden_file(folder))
    loop = controller.loop(nominal)
    for k, trial in tqdm(missing, desc=f"recording {len(target.loads)} loads", leave=False, disable=None):
        (recording,) = target.run([trial], loop, np.random.default_rng([plan.seed, k]))
        write_recording(folder / trial.name, recording)


def write_robot(
    path: Path, nominal: Model, feedback: tuple[StateFeedback, float], loads: Mapping[str, Load], *, emulated: bool
) -> None:
    """Describe a robot, its controller with its rate [Hz], and the loads of its recordings as robot.yaml."""
    gains, rate = feedback[0].gains.tolist(), feedback[1]
    robot: dict[str, Any] = {
        "plant": nominal.plant.kind,
        "parameters": dict(nominal.parameters),
        "controller": {"kind": "lqr", "gains": gains[0] if len(gains) == 1 else gains, "rate": rate},
    }
    if emulated:
        robot["emulated"] = True
    if nominal.effects:
        robot["effects"] = {name: dict(values) for name, values in nominal.effects.items()}
    if loads:
        robot["loads"] = {
            name: {"mass": load.mass, "height": load.height, "side": load.side, "recordings": f"{name}_*.csv"}
            for name, load in loads.items()
        }
    write_whole(path, yaml.safe_dump(robot, sort_keys=False).rstrip())


def write_recording(path: Path, recording: Recording) -> None:
    """Write a recording as CSV, whole or not at all."""
    draft = path.with_name(f".{path.name}")
    write_csv(draft, dict(recording.columns))
    draft.replace(path)


def _digest(job: Job, plan: TrialPlan, target: Target) -> str:
    """Short name of everything that decides what is recorded."""
    deciding = {group: job.settings[group] for group in DECIDING}
    deciding["plan"] = [plan.per_load, plan.duration, plan.seed]
    if isinstance(target, EmulatedTestbed):
        deciding["simulator"] = simulator_digest()
    return hashlib.sha256(json.dumps(deciding, sort_keys=True).encode()).hexdigest()[:12]
