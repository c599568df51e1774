"""A sweep in the process that starts it: writes down its jobs, and shows how far they are.

How jobs are handed out is the launcher's business (hydra/launcher), what a job does is `wipx.app`.
"""

import importlib
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper  # hydra's own option hydra/sweeper=basic
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf
from tqdm import tqdm

from wipx.config import build
from wipx.core.errors import InputError
from wipx.tasks.files.sweep_folder import SweepPlan, states, write_plan
from wipx.tasks.shared.sweep_progress import SweepProgress

EXTRAS = {"hydra_submitit_launcher": "wipx[slurm]", "hydra_ray_launcher": "wipx[ray]"}
PERIOD = 2.0  # [s] between two looks at the jobs
QUIET_PERIOD = 60.0  # [s] between two lines where standard error is no terminal


class RunFailed(BaseException):
    """What was asked for cannot be done; no `Exception`, which Hydra would only warn of, or add a report to.

    Attributes:
        error: Why.
    """

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


class SweepStart(Callback):
    """What Hydra calls before a sweep; see conf/config.yaml."""

    def on_multirun_start(self, config: DictConfig, **kwargs: Any) -> None:
        """Refuse what cannot be done, write down the jobs, and begin to watch them.

        Raises:
            RunFailed: the launcher is not installed, or the tracking store cannot take runs.
        """
        try:
            check_launcher(str(config.hydra.launcher._target_), str(config.hydra.runtime.choices["hydra/launcher"]))
            build(OmegaConf.to_container(config.tracking, resolve=True), "tracking").check()
            folder = Path(str(config.hydra.sweep.dir))
            plan = SweepPlan(jobs_of(config), str(config.hydra.runtime.choices["hydra/launcher"]))
            write_plan(folder, plan)
        except Exception as error:
            raise RunFailed(error) from error
        Watch.begin(folder, plan)


def check_launcher(target: str, option: str) -> None:
    """Refuse a launcher whose packages or programs are missing.

    Args:
        target: Full name of its class.
        option: Of the group hydra/launcher.

    Raises:
        InputError: it tells what to install, or where to start the sweep.
    """
    package = target.rpartition(".")[0]
    try:
        importlib.import_module(package)
    except ModuleNotFoundError as error:
        extra = EXTRAS.get(package.split(".")[1])
        remedy = f"install them with: python -m pip install '{extra}'" if extra else "correct hydra.launcher._target_"
        raise InputError(
            f"hydra/launcher={option} needs packages that are not installed ({error.name}); {remedy}"
        ) from error
    if target.endswith(".SlurmLauncher") and shutil.which("sbatch") is None:
        raise InputError(
            f"hydra/launcher={option}: there is no sbatch on this machine; start the sweep on a login node of the "
            "cluster, or choose hydra/launcher=submitit_local"
        )


def jobs_of(config: DictConfig) -> list[list[str]]:
    """What each job of a sweep is asked to do, as KEY=VALUE, in the order of Hydra's sweeper."""
    swept = [f"{key}={value}" for key, value in (config.hydra.sweeper.params or {}).items()]
    given = OmegaConf.to_container(config.hydra.overrides.task, resolve=False)  # a label's ${...} is each job's own
    asked = [*swept, *cast(list[str], given)]
    hydra = GlobalHydra.instance().hydra
    assert hydra is not None
    overrides = OverridesParser.create(config_loader=hydra.config_loader).parse_overrides(asked)
    return BasicSweeper.split_arguments(overrides, None)[0]


@contextmanager
def watch_ended() -> Iterator[None]:
    """End the watch of a sweep that was begun in the block, also where the sweep fails."""
    try:
        yield
    finally:
        Watch.end()


class Watch:
    """One line on standard error that tells how far a sweep is."""

    _current: "Watch | None" = None

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self._folder, self._plan = folder, plan
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, name="sweep-progress", daemon=True)

    @classmethod
    def begin(cls, folder: Path, plan: SweepPlan) -> None:
        """Watch a sweep until `end` is called."""
        cls._current = cls(folder, plan)
        cls._current._thread.start()

    @classmethod
    def end(cls) -> None:
        """Say how far the sweep is in the end; nothing where none was begun."""
        watch, cls._current = cls._current, None
        if watch is not None:
            watch._end()

    def _end(self) -> None:
        self._over.set()
        self._thread.join()
        with suppress(OSError, InputError):  # the sweep's own error is told as well
            progress = self._progress()
            failed = f"; why: task=status task.folder='{self._folder}'" if progress.named("failed") else ""
            print(f"{self._folder}: {progress.line()}{failed}", file=sys.stderr)

    def _look(self) -> None:
        terminal = sys.stderr.isatty()
        with tqdm(total=len(self._plan.jobs), bar_format="{desc}", file=sys.stderr, leave=False, disable=None) as bar:
            while not self._over.wait(PERIOD if terminal else QUIET_PERIOD):
                with suppress(OSError):  # a file system that does not answer is not the sweep's end
                    line = f"{self._folder}: {self._progress().line()}"
                    if terminal:
                        bar.set_description_str(line)
                    else:
                        print(line, file=sys.stderr)

    def _progress(self) -> SweepProgress:
        return SweepProgress.of(states(self._folder, self._plan))
