"""A setup as the text of a robot.yaml, with its reasons and doubts as comments."""

import textwrap
from collections.abc import Mapping, Sequence

from wipx.core.drive import Drive
from wipx.core.tree import Tree
from wipx.recordings.matching.setup import Setup
from wipx.recordings.signals import Signal
from wipx.recordings.tree_file import DRIVE_KEYS

WIDTH = 110


def robot_yaml(setup: Setup, tree: Tree, model: str, locked: Mapping[str, float], logs: Sequence[str]) -> str:
    """The content of a robot.yaml.

    Args:
        setup: What the columns are.
        tree: The robot.
        model: Name of the model file beside it.
        locked: Joints that do not move, with their positions [rad or m].
        logs: Names of the recordings.
    """
    lines = [f"# Set up by task=new from {model} and {', '.join(logs)}; correct what is not right."]
    for doubt in setup.doubts:
        lines += textwrap.wrap(f"not sure: {doubt}", WIDTH, initial_indent="# ", subsequent_indent="#   ")
    lines += ["plant: robot", f"model: {_text(model)}"]
    if locked:
        lines.append(f"locked: {_flow({joint: f'{position:g}' for joint, position in locked.items()})}")
    if setup.drives:
        lines.append("drives:")
        lines += [f"  {_text(joint)}: {_flow(_drive(drive))}" for joint, drive in setup.drives.items()]
    if setup.uncertainty:
        lines += ["uncertainty: # relative standard deviations of what was read off the motion"]
        lines += [f"  {_text(name)}: {value:g}" for name, value in setup.uncertainty.items()]
    lines.append("signals: # value = scale * column in its unit + offset")
    for joint in (None, *tree.joints):
        own = ["t"] if joint is None else [joint, f"u_{joint}", f"u_{joint}_measured", f"{joint}_dot"]
        if joint is not None:
            lines += textwrap.wrap(
                f"{joint}: {setup.reasons[joint]}", WIDTH, initial_indent="  # ", subsequent_indent="  #   "
            )
        lines += [f"  {_text(name)}: {_flow(_signal(setup.signals[name]))}" for name in own if name in setup.signals]
    return "\n".join(lines) + "\n"


def _drive(drive: Drive) -> dict[str, str]:
    plain = Drive(drive.kind)
    values = {key: vars(drive)[key] for key in DRIVE_KEYS[drive.kind]}
    kept = {key: value for key, value in values.items() if key == "kind" or value != vars(plain)[key]}
    return {key: value if isinstance(value, str) else f"{value:g}" for key, value in kept.items()}


def _signal(signal: Signal) -> dict[str, str]:
    found = {"column": _text(signal.column), "unit": _text(signal.unit)}
    if signal.scale != 1.0:
        found["scale"] = f"{signal.scale:.10g}"
    if signal.offset != 0.0:
        found["offset"] = f"{signal.offset:.10g}"
    if signal.unwrap:
        found["unwrap"] = "true"
    return found


def _flow(values: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{_text(key)}: {value}" for key, value in values.items()) + "}"


def _text(text: str) -> str:
    """A text as YAML: plain where it is plain, else in quotes."""
    plain = text.replace("_", "a").replace(".", "a").replace("/", "a").replace(" ", "a").isalnum()
    words = text.lower() in ("y", "n", "yes", "no", "on", "off", "true", "false", "null")
    if plain and not words and text.strip() == text and not text[:1].isdigit():
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
