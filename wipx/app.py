"""The command line: composes the configuration, runs its task, and turns errors into exit statuses.

What the configuration may hold is in `wipx.config`; what a run does is in `wipx.tasks`.
"""

import errno
import os
import shutil
import sys
import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any, cast

import hydra
import yaml
from hydra._internal.hydra import Hydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException, ValidationError

from wipx.config import RunConfig, build, mistyped_root_key, register, typed, unknown_key
from wipx.core.errors import InputError, unknown_name
from wipx.core.locked import locked
from wipx.core.whole_file import write_whole
from wipx.renamed import renamed, spelled_out, unambiguous
from wipx.sweep import RunFailed, check_launcher, watch_ended
from wipx.tasks.files.finished import ERROR, SETTINGS
from wipx.tasks.files.results import UNFINISHED
from wipx.tasks.files.sweep_folder import RUNNING, begin_job, end_job
from wipx.tasks.shared.job import Job

ROOT_KEYS = tuple(item.name for item in fields(RunConfig))
FLAGS = ("-m", "--multirun", "--config-dir=")
DONE, DEFECT, INPUT_AT_FAULT, INTERRUPTED = 0, 1, 2, 130
AGAIN = "and the same command does the rest"
REFUSED_BY_DISK = {
    errno.ENOSPC: f"make room, {AGAIN}",
    errno.EDQUOT: f"make room, {AGAIN}",
    errno.EROFS: "choose a folder that can be written to",
    errno.EACCES: "choose a folder that can be written to",
}
LAUNCHERS = ("joblib", "submitit", "ray")  # packages whose errors are a launcher's
NEW_LINE = "\n"
HELP = Path("hydra") / "help" / "wipx.yaml"


def main() -> int:
    """Run what the command line asks for.

    Returns:
        Exit status: 0 done; 1 a defect of the program; 2 the input or the configuration is at
        fault; 130 interrupted.
    """
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra then raises its errors instead of printing them
    os.environ.setdefault("MUJOCO_GL", "disable")  # nothing is rendered; MuJoCo's window library would start a process
    register()
    started = time.time()

    def run(config: DictConfig) -> None:
        with _removed_if_left_empty(Path(HydraConfig.get().runtime.output_dir), started) as out:
            _run_reported(config, out)

    if sys.argv[1:] in (["--help"], ["-h"]):
        try:
            print(help_text(), flush=True)
        except BrokenPipeError:  # nobody reads on
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    try:
        arguments = unambiguous(spelled_out(renamed(sys.argv[1:])))
        # Hydra does not read overrides on both sides of a flag.
        sys.argv[1:] = sorted(arguments, key=lambda argument: argument.startswith(FLAGS))
        with watch_ended(), _composed_once(arguments):
            hydra.main(version_base="1.3", config_path=str(configuration_folder()), config_name="config")(run)()
    except RunFailed as failure:
        return _report(failure.error, explanation(failure.error))
    except OSError as error:
        return _report(error, explanation(error) if isinstance(error, HydraException) else _folder_at_fault(error))
    except Exception as error:
        return _report(error, explanation(error))
    except KeyboardInterrupt:
        print("interrupted; the run was not finished", file=sys.stderr)
        return INTERRUPTED
    except SystemExit as stop:  # after --help, or after Hydra has refused a flag
        return INPUT_AT_FAULT if stop.code else DONE
    return DONE


@contextmanager
def _composed_once(arguments: list[str]) -> Iterator[None]:
    """Keep Hydra from composing a configuration twice, the first time to see whether its hydra.mode asks for a sweep.

    A sweep is asked for by -m, or by hydra.mode among the arguments.
    """
    get_mode = Hydra.get_mode
    if not any(argument.startswith("hydra.mode=") for argument in arguments):
        Hydra.get_mode = lambda *_, **__: None
    try:
        yield
    finally:
        Hydra.get_mode = get_mode


def configuration_folder() -> Path:
    """Where the YAML files are: inside an installed package, or beside the package in a checkout."""
    package = Path(__file__).resolve().parent
    inside = package / "conf"
    return inside if inside.is_dir() else package.parent / "conf"


def help_text() -> str:
    """What `--help` says: the template of Hydra's help with all groups, read off the folder, which takes no time."""
    folder = configuration_folder()
    template = yaml.safe_load((folder / HELP).read_text(encoding="utf-8"))["template"]
    options: dict[str, list[str]] = {}
    for path in sorted(folder.rglob("*/*.yaml")):
        group = path.parent.relative_to(folder).as_posix()
        if not group.startswith("hydra"):
            options.setdefault(group, []).append(path.stem)
    groups = "".join(f"{group}: {', '.join(names)}\n" for group, names in sorted(options.items()))
    return template.replace("$APP_CONFIG_GROUPS", groups).replace("\\${", "${").replace("$$", "$")


def run_task(config: DictConfig, out: Path) -> None:
    """Build the task of a composed configuration, run it, and save the configuration beside its results.

    Args:
        config: As composed, with the keys of `RunConfig`.
        out: Folder that takes the results; it exists.

    Raises:
        InputError: the configuration or the input is at fault.
    """
    settings = _resolved(config)

    @cache
    def part(group: str) -> Any:
        return build(settings[group], group)

    model_path = settings["model"]["path"]
    job = Job(
        out=out,
        seed=settings["seed"],
        effects=tuple(settings["effects"]),
        free=typed(settings["free"], dict[str, float | None], "free"),
        bounds=_intervals(settings["bounds"]),
        model_path=None if model_path is None else Path(model_path),
        part=part,
        build=build,
        settings=settings,
        chosen=dict(HydraConfig.get().runtime.choices) if HydraConfig.initialized() else {},
        sweep=sweep_of(out),
        overrides=tuple(HydraConfig.get().overrides.task) if HydraConfig.initialized() else (),
        launcher=_launcher(),
    )
    part("task").run(job)
    write_whole(out / SETTINGS, OmegaConf.to_yaml(OmegaConf.create(settings)).rstrip())


def sweep_of(out: Path) -> Path | None:
    """Folder of the sweep that a job in `out` belongs to; None for a single run."""
    if not HydraConfig.initialized() or HydraConfig.get().mode is not RunMode.MULTIRUN:
        return None
    return out.parent


def _launcher() -> tuple[str, ...]:
    """What the command line of a single run asks of a launcher, which must be installed; its task may hand out jobs."""
    if not HydraConfig.initialized() or HydraConfig.get().mode is not RunMode.RUN:
        return ()
    composed = HydraConfig.get()
    asked = tuple(o for o in composed.overrides.hydra if o.lstrip("+").startswith(("hydra/launcher", "hydra.launcher")))
    if asked:
        check_launcher(str(composed.launcher._target_), str(composed.runtime.choices["hydra/launcher"]))
    return asked


def explanation(error: BaseException) -> str | None:
    """One line that tells a user what to mend; None where the error is not the user's."""
    cause = error.__cause__ if isinstance(error.__cause__, OmegaConfBaseException) else error
    if isinstance(error, InputError):
        text = str(error)
    elif isinstance(error, MissingConfigException) and error.options:
        group, _, option = str(error.missing_cfg_file).rpartition("/")
        text = str(unknown_name("option", option, error.options, group))
    elif isinstance(error, OverrideParseException):
        detail = _without_details(error.message)
        text = f"override {error.override!r}: {detail}; write KEY=VALUE, and quote special characters: 'KEY=\"VALUE\"'"
    elif isinstance(cause, OmegaConfBaseException):
        text = _value_at_fault(cause)
    elif isinstance(error, HydraException):
        text = _without_details(str(error))
    elif isinstance(error, OSError) and error.errno in REFUSED_BY_DISK:
        place = f"{error.filename}: " if error.filename else ""
        text = f"{place}{error.strerror}; {REFUSED_BY_DISK[error.errno]}"
    elif type(error).__module__.partition(".")[0] in LAUNCHERS:
        text = f"the launcher gave up: {str(error).strip().partition(NEW_LINE)[0]}; what is finished is kept, {AGAIN}"
    else:
        return None
    return " ".join(text.split())


def _run_reported(config: DictConfig, out: Path) -> None:
    """Run the task; a failure leaves in the form that Hydra hands on without adding to it."""
    try:
        if HydraConfig.get().mode is RunMode.RUN:
            run_task(config, out)
        else:
            _run_job(config, out)
    except Exception as error:
        if isinstance(error, OSError) and error.errno in REFUSED_BY_DISK and error.filename is None:
            error.filename = str(out)  # a failed write does not know its file
        if HydraConfig.get().mode is RunMode.RUN:
            raise RunFailed(error) from error
        line = explanation(error)
        with suppress(OSError):  # a full disk has no place for its own error
            told = line or f"{type(error).__name__}: {error}"
            (out / ERROR).write_text(f"{told}\n\n{traceback.format_exc()}", encoding="utf-8")
        raise (RuntimeError(f"the job in {out} failed") if line is None else InputError(line)) from error


def _run_job(config: DictConfig, out: Path) -> None:
    """Run one job of a sweep; another process that works on the same one is waited for."""
    with locked(out / RUNNING):
        for unfinished in out.glob(f"{UNFINISHED}*"):  # of a process that was killed
            shutil.rmtree(unfinished, ignore_errors=True)
        asked = OmegaConf.to_container(HydraConfig.get().overrides.task, resolve=False)
        note = begin_job(out, cast(list[str], asked))
        run_task(config, out)
        end_job(out, note)


@contextmanager
def _removed_if_left_empty(out: Path, started: float) -> Iterator[Path]:
    """The output folder; removed when the run fails, unless it has content or is older than the run."""
    made_by_this_run = out.stat().st_mtime >= started
    try:
        yield out
    except BaseException:
        if made_by_this_run and not any(out.iterdir()):
            out.rmdir()
        raise


def _resolved(config: DictConfig) -> dict[str, Any]:
    """The configuration in plain containers, with the keys of `RunConfig` and no others."""
    for key in map(str, config):
        if key not in ROOT_KEYS:
            raise unknown_key(key, ROOT_KEYS, "configuration")
    for key in ROOT_KEYS:
        if key not in config or OmegaConf.is_missing(config, key):
            raise InputError(f"configuration: {key} is missing; give {key}=VALUE")
    try:
        return cast(dict[str, Any], OmegaConf.to_container(config, resolve=True))
    except OmegaConfBaseException as error:
        raise InputError(explanation(error)) from error


def _intervals(bounds: Mapping[str, object]) -> dict[str, tuple[float, float]]:
    intervals: dict[str, tuple[float, float]] = typed(bounds, dict[str, tuple[float, float]], "bounds")
    for name, (low, high) in intervals.items():
        if not low < high:
            raise InputError(f"bounds.{name} is [{low:g}, {high:g}], expected [low, high] with low < high; correct it")
    return intervals


def _value_at_fault(error: OmegaConfBaseException) -> str:
    """What is wrong with one key or its value."""
    path = str(error.full_key)
    parent, _, key = path.rpartition(".")
    if isinstance(error, ConfigAttributeError | ConfigKeyError) and isinstance(error.parent_node, Mapping):
        siblings = [str(name) for name in error.parent_node if name != "_target_"]
        return str(unknown_key(key, siblings if parent else ROOT_KEYS, parent or "configuration"))
    mistyped = mistyped_root_key(path, error.value) if isinstance(error, ValidationError) else None
    return str(mistyped or f"{path}: {_without_details(str(error))}; correct it")


def _without_details(message: str) -> str:
    """The lines of a message of Hydra or OmegaConf that say what is wrong, joined."""
    details = ("Error parsing override", "See https://", "full_key:", "object_type=", "reference_type=")
    kept = []
    for line in map(str.strip, message.splitlines()):
        if line.startswith("Config search path"):
            break
        if line and not line.startswith(details):
            kept.append(line)
    return "; ".join(kept)


def _folder_at_fault(error: OSError) -> str:
    remedy = "choose another with hydra.run.dir=FOLDER, or hydra.sweep.dir=FOLDER for a sweep"
    return f"output folder {error.filename}: {error.strerror}; {remedy}"


def _report(error: Exception, line: str | None) -> int:
    if line is None:
        traceback.print_exception(error)
        return DEFECT
    print(line, file=sys.stderr)
    return INPUT_AT_FAULT
