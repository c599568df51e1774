"""The tables of `task=real_consistency`: names, prediction errors and sizes over groups of runs, per rig and pooled."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from wipx.core.sizes import Size, SizeSeries
from wipx.proof.real_machines.group_results import OURS, GroupResult
from wipx.proof.real_machines.published import Published, counted
from wipx.report.numbers import compact, significant

Rigs = Mapping[str, tuple[str, Published]]  # title and what is published, by the rig's name

NAMES = ("rig", "method", "groups", "main effects by name", "as a tie", "same physics", "missed", "names not published")
ERRORS = ("rig", "signal", "groups", "nominal", "completed", "told the names", "authors", "sensor noise")
EFFECTS = (
    "rig",
    "effect",
    "published",
    "groups that name it",
    "of",
    "number",
    "median",
    "least",
    "largest",
    "pairs that agree",
)
POOLED = ("pooled", "method", "value")
NOTHING = "-"


def markdown(results: Sequence[GroupResult], rigs: Rigs) -> str:
    """All tables as Markdown."""
    parts = (
        ("What is named", NAMES, _names(results, rigs)),
        ("Error of 0.5 s predictions of all other groups, median over the groups", *_errors(results, rigs)),
        ("Effects and their sizes", EFFECTS, _effects(results, rigs)),
        ("All rigs", POOLED, _pooled(results, rigs)),
    )
    return "\n".join(f"**{title}**\n\n{_table(head, rows)}" for title, head, rows in parts)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return "".join(f"| {' | '.join(line)} |\n" for line in (head, ("---",) * len(head), *rows))


def _by_rig(results: Sequence[GroupResult]) -> dict[str, list[GroupResult]]:
    grouped: dict[str, list[GroupResult]] = {}
    for result in results:
        grouped.setdefault(result.rig, []).append(result)
    return grouped


def _methods(results: Sequence[GroupResult]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(method for result in results for method in result.answers))


def _names(results: Sequence[GroupResult], rigs: Rigs) -> list[tuple[str, ...]]:
    rows = []
    for rig, mine in _by_rig(results).items():
        title, published = rigs[rig]
        rows += [(title, method, *_named(mine, method, {rig: (title, published)})) for method in _methods(mine)]
    if len(rigs) > 1:
        rows += [("all", method, *_named(results, method, rigs)) for method in _methods(results)]
    return rows


def _named(results: Sequence[GroupResult], method: str, rigs: Rigs) -> tuple[str, ...]:
    """Cells after rig and method: groups, the four ways of naming, and names that are not published."""
    answered = [result for result in results if method in result.answers]
    counts = counted(rigs[r.rig][1].naming(r.answers[method].effects) for r in answered)
    beside = sum(len(rigs[r.rig][1].not_published(r.answers[method].effects)) for r in answered)
    ways = (counts["name"], counts["tie"], counts["same physics"], counts["missed"])
    return (str(len(answered)), *map(str, ways), str(beside))


def _errors(results: Sequence[GroupResult], rigs: Rigs) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and rows of the prediction errors, with one column for each other method."""
    others = tuple(method for method in _methods(results) if method != OURS)
    rows = []
    for rig, mine in _by_rig(results).items():
        for column, unit in mine[0].units.items():
            models = {name: _median(r.errors.get(name, {}).get(column) for r in mine) for name in _MODELS}
            methods = {name: _median(r.answers[name].errors.get(column) for r in mine) for name in (OURS, *others)}
            ordered = (models["nominal"], methods[OURS], models["identified"], models["authors"], models["noise floor"])
            shown = (_with_unit(value, unit) for value in (*ordered, *(methods[name] for name in others)))
            rows.append((rigs[rig][0], column, str(len(mine)), *shown))
    return (*ERRORS, *others), rows


_MODELS = ("nominal", "identified", "authors", "noise floor")


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _with_unit(value: float | None, unit: str) -> str:
    return NOTHING if value is None else f"{compact(value, 3)} {unit}"


def _effects(results: Sequence[GroupResult], rigs: Rigs) -> list[tuple[str, ...]]:
    rows = []
    for rig, mine in _by_rig(results).items():
        title, published = rigs[rig]
        counts: dict[str, int] = dict.fromkeys(published.known, 0)
        for result in mine:
            for effect in result.ours.effects:
                counts[effect.name] = counts.get(effect.name, 0) + 1
        for name, count in sorted(counts.items(), key=lambda item: -item[1]):
            standing = _standing(name, published)
            sizes = [(r, size) for r in mine for size in r.sizes if size.effect == name]
            for symbol in dict.fromkeys(size.symbol for _, size in sizes) or (NOTHING,):
                same = [(r, size) for r, size in sizes if size.symbol == symbol]
                rows.append((title, name, standing, str(count), str(len(mine)), symbol, *_spread(same)))
    return rows


def _standing(name: str, published: Published) -> str:
    if name in published.main:
        return "main"
    if name in published.known:
        return "yes"
    if any(name in published.same_physics(main) for main in published.main):
        return "same physics"
    return "plausible" if name in published.plausible else "no"


def _spread(sizes: Sequence[tuple[GroupResult, Size]]) -> tuple[str, ...]:
    """Median, least and largest value, and how many pairs of disjoint groups agree."""
    if not sizes:
        return (NOTHING,) * 4
    values, unit = [size.value for _, size in sizes], sizes[0][1].unit.removesuffix("1")  # "1": no unit
    agree, pairs = _agreement(sizes)
    numbers = (float(np.median(values)), min(values), max(values))
    shown = (f"{significant(number, 3)} {unit}".strip() for number in numbers)
    return (*shown, f"{agree} of {pairs}" if pairs else NOTHING)


def _agreement(sizes: Sequence[tuple[GroupResult, Size]]) -> tuple[int, int]:
    """Pairs of groups of one way whose sizes agree within their intervals, and all pairs."""
    pairs = [
        first.agrees(second)
        for (a, first), (b, second) in combinations(sizes, 2)
        if a.way == b.way and a.group != b.group
    ]
    return sum(pairs), len(pairs)


def _pooled(results: Sequence[GroupResult], rigs: Rigs) -> list[tuple[str, ...]]:
    rows = []
    for method in _methods(results):
        answered = [result for result in results if method in result.answers]
        complete = sum("missed" not in rigs[r.rig][1].naming(r.answers[method].effects).values() for r in answered)
        rows.append(("groups with every main effect named", method, f"{complete} of {len(answered)}"))
        for model, title in (("nominal", "nominal model"), ("authors", "authors' full model")):
            known = [ratio for r in answered if (ratio := r.ratio(method, model)) is not None]
            worse = sum(ratio > 1.0 for ratio in known)
            rows.append((f"groups that predict worse than the {title}", method, f"{worse} of {len(known)}"))
        told = [ratio for r in answered if (ratio := r.ratio(method, "identified")) is not None]
        for title, value in (("median", np.median), ("worst", np.max)):
            shown = significant(float(value(told)), 3) if told else NOTHING
            rows.append((f"error over that of identify, told the names: {title}", method, shown))
    agree, pairs = _all_agreements(results)
    rows.append(("pairs of groups whose sizes agree", OURS, f"{agree} of {pairs}"))
    return rows


def size_series(results: Sequence[GroupResult], rigs: Rigs) -> tuple[SizeSeries, ...]:
    """Sizes over the groups of each rig, the most important first.

    Known effects come before other laws of the same physics, these before the rest; of those, the first number of each
    effect before its others, and what most groups name before what few name.
    """
    return tuple(one for rig, mine in _by_rig(results).items() for one in _series_of(mine, *rigs[rig]))


def _series_of(results: Sequence[GroupResult], title: str, published: Published) -> list[SizeSeries]:
    numbers: dict[tuple[str, str], list[tuple[GroupResult, Size]]] = {}
    for result in results:
        for size in result.sizes:
            numbers.setdefault((size.effect, size.symbol), []).append((result, size))
    figures = published.suspects
    alike = {other for main in published.main for other in published.same_physics(main)}
    first = {effect: symbol for effect, symbol in reversed(numbers)}

    def rank(number: tuple[str, str]) -> tuple[bool, bool, bool, int]:
        effect, symbol = number
        return effect not in figures, effect not in alike, symbol != first[effect], -len(numbers[number])

    return [
        SizeSeries(
            title,
            tuple(result.way for result, _ in numbers[effect, symbol]),
            tuple(size for _, size in numbers[effect, symbol]),
            figures.get(effect, {}).get(symbol),
        )
        for effect, symbol in sorted(numbers, key=rank)
    ]


def _all_agreements(results: Sequence[GroupResult]) -> tuple[int, int]:
    """Agreement over all numbers of all effects of all rigs."""
    numbers: dict[tuple[str, str, str], list[tuple[GroupResult, Size]]] = {}
    for result in results:
        for size in result.sizes:
            numbers.setdefault((result.rig, size.effect, size.symbol), []).append((result, size))
    counts = [_agreement(sizes) for sizes in numbers.values()]
    return sum(agree for agree, _ in counts), sum(pairs for _, pairs in counts)
