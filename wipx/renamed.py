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
