"""What a task is given: the settings of one run, and the swappable parts it may ask for."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Job:
    """One run of a task.

    Attributes:
        out: Folder that takes the results; it exists.
        seed: Of every random number.
        effects: Physics that is switched on, as "site/kind".
        free: Further parameters that may change, with the relative standard deviation of their
            prior; None without a prior.
        bounds: Search intervals (low, high) that replace the usual ones, by parameter [SI].
        model_path: A model.yaml to start from; None for the nominal model.
        part: Gives the chosen part of a group, e.g. `part("optimizer")`. It is built when it is
            first asked for, so that a part that is never used costs nothing.
        build: Builds a part from a mapping with `_target_`; takes its name for messages too.
        settings: The whole configuration in plain containers, for logging.
        chosen: Option that was chosen of each group, by group; empty where a run was put together otherwise.
        sweep: Folder of the sweep that the run is a job of; None for a single run.
        overrides: What the command line asked for, each as KEY=VALUE.
        launcher: What the command line asked of hydra/launcher, each as KEY=VALUE; empty in a job of a sweep.
        started: Time at which the run began [s since the epoch].
    """

    out: Path
    seed: int
    effects: tuple[str, ...]
    free: Mapping[str, float | None]
    bounds: Mapping[str, tuple[float, float]]
    model_path: Path | None
    part: Callable[[str], Any]
    build: Callable[[object, str], Any]
    settings: Mapping[str, Any]
    chosen: Mapping[str, str] = field(default_factory=dict)
    sweep: Path | None = None
    overrides: tuple[str, ...] = ()
    launcher: tuple[str, ...] = ()
    started: float = field(default_factory=time.time)
