"""One page for each effect, from what its module says."""

from dataclasses import fields
from importlib import import_module
from inspect import getdoc

from markdown_table import table

from wipx.core.effect import Effect
from wipx.core.parameters import UNITS, Parameter
from wipx.effects.catalogue import kinds

FOLDER = "reference/effects"
SHOWN = {"kind", "parameters", "law", "source", "sites", "steady"}  # what the page shows in a place of its own


def effect_pages() -> dict[str, str]:
    """Markdown by path, the index among them."""
    pages = {f"{FOLDER}/{kind}.md": _page(effect) for kind, effect in kinds().items()}
    pages[f"{FOLDER}/index.md"] = _index()
    return pages


def _page(effect: Effect) -> str:
    parts = [
        f"# {effect.kind}",
        getdoc(import_module(f"wipx.effects.{effect.kind}")) or "",
        "## Law",
        f"```text\n{effect.law}\n```",
        f"Source: {effect.source}.",
        f"![{effect.kind}: its law and a motion with and without it]({effect.kind}.svg)",
        "## Parameters",
        table(("symbol", "meaning", "unit", "absent at", "searched from", "to"), map(_parameter, effect.parameters)),
        "The ends of the search interval are multiples of the joint's characteristic sizes in the recordings "
        "(`wipx.core.parameters.Scales`). A unit after *or* is that of a turning joint.",
        "## Sites",
        ", ".join(f"`{site}/{effect.kind}`" for site in effect.sites),
    ]
    others = [(f"`{name}`", text) for name, text in _other_fields(effect)]
    if others:
        parts += ["## Further fields", table(("field", "value"), others), "`wipx.core.effect.Effect` explains them."]
    return "\n\n".join(parts) + "\n"


def _parameter(parameter: Parameter) -> tuple[str, ...]:
    sliding, turning = UNITS[parameter.dimension]
    unit = sliding if sliding == turning else f"{sliding} or {turning}"
    ends = (f"{value:g}" for value in (parameter.neutral, parameter.low, parameter.high))
    return f"`{parameter.name}`", parameter.meaning, unit, *ends


def _other_fields(effect: Effect) -> list[tuple[str, str]]:
    """Fields that say something and can be written down."""
    found = []
    for item in fields(effect):
        value = getattr(effect, item.name)
        if item.name not in SHOWN and value not in (None, (), "", False, 0.0) and not callable(value):
            found.append((item.name, ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)))
    return found


def _index() -> str:
    rows = [
        (f"[{kind}]({kind}.md)", f"`{effect.law}`", ", ".join(effect.sites), _answer(not effect.outside_vocabulary))
        for kind, effect in kinds().items()
    ]
    return (
        "# Effects\n\nWhat a model can have beside its rigid body. `effects=[site/kind, ...]` switches it on. "
        "A diagnosis looks for the effects of the *vocabulary* first, and for the others if these leave something over."
        f"\n\n{table(('effect', 'law', 'sites', 'vocabulary'), rows)}\n"
    )


def _answer(truth: bool) -> str:
    return "yes" if truth else "no"
