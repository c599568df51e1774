"""Names of keys, groups and options that have another name: the command line takes both, and says which one it is."""

import re
import sys

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


def renamed(arguments: list[str]) -> list[str]:
    """The arguments with their names of today; one line on standard error for each that had another one."""
    return [_renamed(argument) for argument in arguments]


def _renamed(argument: str) -> str:
    rest = argument.lstrip("+~")
    sign = argument[: len(argument) - len(rest)]
    for name, other in RENAMED:
        changed = re.sub(rf"\A{name}", other, rest)
        if changed != rest:
            print(f"{argument}: the name is {sign}{changed}", file=sys.stderr)
            return sign + changed
    return argument
