"""Answers of other methods to the recordings that a diagnosis was given, judged as the diagnosis is."""

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wipx.baselines.case import Baseline, Problem
from wipx.core.errors import InputError, unknown_name
from wipx.proof.unseen import Unseen
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was named.

    Attributes:
        name: "site/kind".
        equivalent: Effects that explain the recordings as well.
    """

    name: str
    equivalent: tuple[str, ...] = ()


@dataclass(frozen=True)
class MethodAnswer:
    """What a method answers, and how well its model predicts.

    Attributes:
        method: Its name.
        effects: What it names.
        errors: Root mean square of predictions of recordings that it never saw, by column [SI]; empty if none.
        seconds: That it took [s].
        refusal: Why there is no answer; empty where there is one.
    """

    method: str
    effects: tuple[NamedEffect, ...] = ()
    errors: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    refusal: str = ""


def check_methods(baselines: Iterable[str], methods: Mapping[str, Any]) -> None:
    """Refuse methods that are not there.

    Raises:
        InputError: it lists those that are.
    """
    for name in baselines:
        if name not in methods:
            raise unknown_name("method", name, methods, "task.baselines")


def ask(job: Job, method: str, settings: object, source: RecordingSource, unseen: Unseen) -> MethodAnswer:
    """A method's answer to a source's recordings.

    Args:
        job: Gives seed, nominal model and simulator.
        method: Name of the method.
        settings: Its option of the group `baseline`.
        source: The recordings that it sees.
        unseen: Those that it predicts.

    Raises:
        InputError: the method's settings are at fault, or it lacks a package.
    """
    baseline: Baseline = job.build(settings, f"task.methods.{method}")
    description = source.describe()
    nominal = job.part("plant").nominal(description.model)
    case = Problem(source.load(), nominal, description.uncertainty, job.part("sim"))
    begun = time.perf_counter()
    try:
        answer = baseline.answer(case, np.random.default_rng(job.seed))
    except (InputError, ArithmeticError, np.linalg.LinAlgError) as failure:  # what these recordings are too hard for
        return MethodAnswer(method, seconds=time.perf_counter() - begun, refusal=f"{failure}")
    seconds = time.perf_counter() - begun
    named = tuple(NamedEffect(found.name, tuple(found.equivalent)) for found in answer.found)
    return MethodAnswer(method, named, unseen.errors(answer.model), seconds)
