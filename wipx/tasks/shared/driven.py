"""Driving a target: which one, what it does to show its physics, and the log that it leaves."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.hardware.excitations import ExcitationName, excitation
from wipx.hardware.target import KeepsLogs, Target, Trial
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.job import Job

RELEASED_AT, LEANING = (0.03, 0.06), 0.01  # [rad] pitch at the start of a release, and of the other runs


def driven_target(job: Job, logs: Path) -> Target:
    """The chosen target, if it can be driven.

    Args:
        job: The run.
        logs: Folder that takes the raw CAN log and the loop's quality of every trial of hardware.

    Raises:
        InputError: it is recordings.
    """
    target = job.part("target")
    if isinstance(target, RecordingSource):
        raise InputError(
            f"task={job.chosen.get('task', '')} drives a robot, and recordings cannot be driven; choose another "
            "target, or diagnose the recordings with task=diagnose recordings.path=..."
        )
    return replace(cast(Any, target), logs=str(logs)) if isinstance(target, KeepsLogs) else target


def excited_trial(name: str, kind: ExcitationName, duration: float, nominal: Model, rng: np.random.Generator) -> Trial:
    """A trial in which a robot without load follows an excitation.

    Args:
        name: Of its recording.
        kind: The excitation.
        duration: [s].
        nominal: The robot.
        rng: Draws the pitch of the release, and phases.
    """
    pitch = rng.uniform(*RELEASED_AT) if kind == "release" else rng.uniform(-LEANING, LEANING)
    return Trial(name, duration, pitch=pitch, reference=excitation(kind, nominal.plant, rng))


def logged_slower(recording: Recording, every: int, rate: float) -> Recording:
    """A recording with fewer rows; commands and reported forces are the mean until the next row.

    Args:
        recording: One row per step of the loop.
        every: Periods of the loop from one row to the next; where steps were skipped it takes fewer rows for them.
        rate: Of the loop [Hz].
    """
    if every == 1:
        return recording
    t, begins = recording.t, [0]
    for k in range(1, len(t)):
        if t[k] - t[begins[-1]] >= (every - 0.5) / rate:
            begins.append(k)
    if len(begins) < 2:
        return recording
    first, end = np.array(begins[:-1]), begins[-1]
    seconds = np.diff(t)[:end]
    columns = {}
    for name, values in recording.columns.items():
        if name.startswith("u"):
            columns[name] = np.add.reduceat(values[:end] * seconds, first) / np.add.reduceat(seconds, first)
        else:
            columns[name] = values[first]
    return Recording(recording.name, columns, recording.source, recording.periods * every)
