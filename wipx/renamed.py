"""The command line before Hydra reads it: names of today for keys and options that have another name, no key twice."""

import re
import sys

from wipx.core.errors import InputError

# What an argument begins with, after +, ++ or ~, and what stands there instead.
RENAMED = (
    (r"rival(?=[.@=]|$)", "baseline"),
    (r"task=rival$", "task=baseline"),
    (r"task\.rivals(?==)", "task.baselines"),
    (r"task\.rivals_cases(?==)", "task.baselines_cases"),
    (r"target\.engine(?==)", "sim@target.engine"),
    (r"target\.step(?==)", "target.engine.step"),
    (r"task=concealed$", "task=blind"),
    (r"task=concealed_check$", "task=blind_check"),
    (r"experiment=concealed$", "experiment=blind"),
)


SETUP = "task=new"  # the task whose settings have short names


def spelled_out(arguments: list[str]) -> list[str]:
    """The arguments with the short settings of task=new, path=, model= and log=, under their full names.

    Several logs are given as log=[a.csv,b.csv], log=a.csv,b.csv or log=a.csv log=b.csv.
    """
    if SETUP not in arguments:
        return arguments
    kept, logs = [], []
    for argument in arguments:
        key, sign, value = argument.partition("=")
        if not sign or key not in ("path", "model", "log"):
            kept.append(argument)
        elif key == "log":
            logs += [_quoted(name.strip()) for name in value.removeprefix("[").removesuffix("]").split(",")]
        else:
            kept.append(f"task.{key}={_quoted(value)}")
    return [*kept, f"task.log=[{','.join(logs)}]"] if logs else kept


def _quoted(value: str) -> str:
    """A value as Hydra takes it whatever signs it has."""
    plain = value.strip("'\"")
    return "'" + plain.replace("\\", "\\\\").replace("'", "\\'") + "'"


# Tasks that are asked about an experiment in place of running it: experiment=NAME is a setting of theirs.
ASKED_ABOUT = ("task=status", "task=log_runs")


def renamed(arguments: list[str]) -> list[str]:
    """The arguments with their names of today; one line on standard error for each that had another one."""
    names = [_renamed(argument) for argument in arguments]
    if not any(task in names for task in ASKED_ABOUT):
        return names
    return [re.sub(r"\A\+?experiment=", "task.experiment=", name) for name in names]


def unambiguous(arguments: list[str]) -> list[str]:
    """The arguments.

    Raises:
        InputError: a key is given two values.
    """
    given: dict[str, str] = {}
    for argument in arguments:
        key, equals, _ = argument.lstrip("+").partition("=")
        if equals and not key.startswith("-") and given.setdefault(key, argument) != argument:
            raise InputError(f"{given[key]} and {argument} contradict each other; leave one of them out")
    return arguments


def _renamed(argument: str) -> str:
    rest = argument.lstrip("+~")
    sign = argument[: len(argument) - len(rest)]
    for name, other in RENAMED:
        changed = re.sub(rf"\A{name}", other, rest)
        if changed != rest:
            print(f"{argument}: the name is {sign}{changed}", file=sys.stderr)
            return sign + changed
    return argument
