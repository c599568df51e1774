"""One page for each effect, from what its module says."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from inspect import getdoc

from docstrings import attributes
from markdown_table import table

from wipx.core.effect import Effect
from wipx.core.parameters import UNITS, Parameter
from wipx.effects.catalogue import kinds, of_trees

FOLDER = "reference/effects"
PICTURE = "![{kind}: its law and a motion with and without it]({kind}.svg)"
SHOWN = {"kind", "parameters", "law", "source", "sites", "steady"}  # what the page shows in a place of its own


def effect_pages() -> dict[str, str]:
    """Markdown by path, the index among them."""
    pages = {f"{FOLDER}/{kind}.md": _page(effect, "wipx.effects", PICTURE) for kind, effect in kinds().items()}
    pages |= {f"{FOLDER}/trees/{kind}.md": _page(effect, "wipx.effects.trees") for kind, effect in of_trees().items()}
    pages[f"{FOLDER}/index.md"] = _index()
    return pages


def _page(effect: Effect, package: str, picture: str = "") -> str:
    parts = [
        f"# {effect.kind}",
        getdoc(import_module(f"{package}.{effect.kind}")) or "",
        "## Law",
        f"```text\n{effect.law}\n```",
        f"Source: {effect.source}.",
        *([picture.format(kind=effect.kind)] if picture else []),
        "## Parameters",
        table(("symbol", "meaning", "unit", "absent at", "searched from", "to"), map(_parameter, effect.parameters)),
        "The ends of the search interval are multiples of the joint's characteristic sizes in the recordings "
        "(`wipx.core.parameters.Scales`). A unit after *or* is that of a turning joint.",
        "## Sites",
        ", ".join(f"`{site}/{effect.kind}`" for site in effect.sites),
    ]
    others = _other_fields(effect)
    if others:
        parts += ["## What else is known of it", table(("field", "value", "meaning"), others)]
    return "\n\n".join(parts) + "\n"


def _parameter(parameter: Parameter) -> tuple[str, ...]:
    sliding, turning = UNITS[parameter.dimension]
    unit = sliding if sliding == turning else f"{sliding} or {turning}"
    ends = (f"{value:g}" for value in (parameter.neutral, parameter.low, parameter.high))
    return f"`{parameter.name}`", parameter.meaning, unit, *ends


def _other_fields(effect: Effect) -> list[tuple[str, str, str]]:
    """Name, value and meaning of the fields that say something and can be written down."""
    meaning = attributes(Effect)
    values = [(item.name, _plain(getattr(effect, item.name))) for item in fields(effect) if item.name not in SHOWN]
    return [(f"`{name}`", f"`{value}`", meaning.get(name, "")) for name, value in values if value]


def _plain(value: object) -> str:
    """A value in a cell; empty where it says nothing or is code."""
    if isinstance(value, tuple):
        return ", ".join(filter(None, map(_plain, value)))
    if isinstance(value, Mapping):
        return ", ".join(f"{name}: {_plain(item)}" if _plain(item) else str(name) for name, item in value.items())
    if is_dataclass(value):
        return "; ".join(filter(None, (_plain(getattr(value, item.name)) for item in fields(value))))
    return str(value) if isinstance(value, str | bool | int | float) and value else ""


def _index() -> str:
    rows = [
        (f"[{kind}]({kind}.md)", f"`{effect.law}`", ", ".join(effect.sites), _answer(not effect.outside_vocabulary))
        for kind, effect in kinds().items()
    ]
    trees = [
        (f"[{kind}](trees/{kind}.md)", f"`{effect.law}`", ", ".join(effect.sites))
        for kind, effect in of_trees().items()
    ]
    return (
        "# Effects\n\nWhat a model can have beside its rigid body. `effects=[site/kind, ...]` switches it on. "
        "A diagnosis looks for the effects of the *vocabulary* first, and for the others if these leave something over."
        f"\n\n{table(('effect', 'law', 'sites', 'vocabulary'), rows)}\n\n"
        "The sites `joint`, `drive`, `drives`, `sensor`, `link` and `base` are those of a "
        "[robot from a model file](../../howto/robot.md). Some effects exist or act otherwise only there:\n\n"
        f"{table(('effect', 'law', 'sites'), trees)}\n"
    )


def _answer(truth: bool) -> str:
    return "yes" if truth else "no"
