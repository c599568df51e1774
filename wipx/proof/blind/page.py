"""Results of a run of the blind benchmark: score.md, score.csv, score.json, confusions.png and the page."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path

from wipx.proof.blind.diagnosing import OURS
from wipx.proof.blind.dirty_page import dirty_row, dirty_sentence, dirty_tables
from wipx.proof.blind.evidence import FALSE_ALARM_BAR, Account, bar, count_in_words, interval, notes, proof, robots
from wipx.proof.blind.judging import Opened
from wipx.proof.blind.tree_page import tree_row, tree_sentence, tree_tables
from wipx.proof.blind_robots.folder import RunFolder
from wipx.proof.blind_robots.picture import draw_confusions
from wipx.proof.blind_robots.score import CaseScore
from wipx.proof.blind_robots.table import (
    Count,
    GroupScore,
    by_contrast,
    by_tier,
    confusions,
    covered,
    group_score,
    is_right,
    median,
    misses,
    nothing_hidden,
    parameter_groups,
)
from wipx.report.numbers import significant
from wipx.report.score_page import (
    Confusions,
    Link,
    Rate,
    Rates,
    ScorePage,
    Table,
    Tile,
    score_markdown,
    write_score_page,
)
from wipx.tasks.files.results import replace_table, write_json, written_together

SIGNAL_TO_NOISE = (
    "Cases with hidden physics, by the root mean square difference that it makes in the signal that shows it best, "
    "over the noise of that signal; of several effects, the faintest counts."
)


def write_results(folder: RunFolder, cases: Sequence[Opened], account: Account, page: Path | None) -> str:
    """Write all results to the run's folder; returns them as Markdown.

    Args:
        folder: Of the run.
        cases: Those that are opened, one at least.
        account: How the run came about.
        page: Markdown page whose table is renewed; None for none.
    """
    scores = [one.scores[OURS] for one in cases]
    shown = score_page_of(folder, cases, account)
    text = score_markdown(shown)
    with written_together(folder.path) as draft:
        write_score_page(shown, draft / "index.html")
        (draft / "score.md").write_text(f"# {shown.title}\n\n{text}", encoding="utf-8")
        (draft / "score.csv").write_text(_csv(cases), encoding="utf-8")
        write_json(draft / "score.json", _summary(cases, account))
        draw_confusions(confusions(scores), draft / "confusions.png")
    if page is not None:
        replace_table(page, score_markdown(replace(shown, details=()), links=False))
    return f"\n{shown.headline}\npage: {folder.path / 'index.html'}"


def score_page_of(folder: RunFolder, cases: Sequence[Opened], account: Account) -> ScorePage:
    """What the page says."""
    scores = [one.scores[OURS] for one in cases]
    everything, nulls = group_score("all", scores), nothing_hidden(scores)
    alarms = group_score("nothing hidden", nulls).false_alarms if nulls else Count(0, 0)
    return ScorePage(
        title=f"{robots(len(scores))} with hidden physics",
        headline=_headline(scores, alarms),
        tiles=_tiles(everything, alarms),
        notes=notes(cases, account, alarms),
        proof=proof(folder, cases, account),
        check=f"python -m wipx task=blind_check task.folder='{folder.path}'",
        methods=_methods(cases),
        groups=(
            *dirty_tables(cases),
            *tree_tables(cases),
            *_groups("By tier", "", "tier", by_tier(scores)),
            *_groups("By signal to noise", f" {SIGNAL_TO_NOISE}", "signal to noise", by_contrast(scores)),
        ),
        rates=_charts(scores),
        confusions=_confusions(scores),
        misses=_misses(scores),
        details=(_parameters(scores),),
    )


def _headline(scores: Sequence[CaseScore], alarms: Count) -> str:
    """What a reader should take away."""
    failed = [one for one in scores if one.failure]
    hidden = [one for one in scores if one.truth]
    outside = [one for one in scores if one.outside is not None]
    parts = [dirty_sentence(scores)] if any(one.dirty is not None for one in scores) else []
    if any(one.tree is not None for one in scores):
        parts.append(tree_sentence(scores))
    if hidden:
        right = group_score("hidden", hidden).exact
        parts.append(f"Physics was hidden in {robots(right.total)} and named exactly in {right.right}.")
    if alarms.total:
        raised = "1 false alarm" if alarms.right == 1 else f"{alarms.right or 'no'} false alarms"
        parts.append(f"Nothing was missing in {robots(alarms.total)}: {raised}.")
    if outside:
        flagged = group_score("outside", outside).flagged
        parts.append(
            f"In {robots(flagged.total)} it was physics that the vocabulary lacks: {flagged.right} called unexplained."
        )
    if failed:
        parts.append(f"No answer for {robots(len(failed))} ({failed[0].case}: {failed[0].failure}).")
    return " ".join(part for part in parts if part)


def _tiles(everything: GroupScore, alarms: Count) -> tuple[Tile, ...]:
    exact, cover = everything.exact, everything.covered
    tiles = [
        Tile("Exact sets of effects", _percent(exact), f"of {exact.total}", f"95 %: {interval(exact)}"),
        Tile(
            "False alarms where nothing is hidden",
            f"{alarms.right}",
            f"of {alarms.total}",
            f"95 %: {interval(alarms)}; bar: {bar()}",
            worse=alarms.total > 0 and alarms.right > FALSE_ALARM_BAR * alarms.total,
        ),
        Tile("Error removed on unseen recordings", _share(everything.removed), "", "median of what can be explained"),
        Tile(
            "True parameters in their 95 % interval", _percent(cover), f"of {cover.total}", f"95 %: {interval(cover)}"
        ),
    ]
    return tuple(tiles)


def _methods(cases: Sequence[Opened]) -> Table | None:
    """All methods on the cases that all of them answered."""
    names = list(dict.fromkeys(method for one in cases for method in one.scores))
    shared = [one for one in cases if set(one.scores) == set(names)]
    if len(names) < 2 or not shared:
        return None
    rows = []
    for name in names:
        scores = [one.scores[name] for one in shared]
        whole = group_score(name, scores)
        hidden = [one for one in scores if one.truth]
        named = group_score(name, hidden).exact if hidden else Count(0, 0)
        black_box = not any(one.answer for one in scores) and any(one.verdict == "mismatch" for one in scores)
        silent = [one.failure for one in scores if one.failure]
        rows.append(
            (
                "wipx (this package)" if name == OURS else name.replace("_", " "),
                "names nothing" if black_box else count_in_words(named),
                "-" if black_box else count_in_words(whole.false_alarms),
                _share(whole.removed),
                _number(whole.over_floor),
                f"{whole.seconds:.1f}",
                f"{len(silent)}: {silent[0]}" if silent else "0",
            )
        )
    return Table(
        "Against what people would use instead",
        f"The same {robots(len(shared))}. Names right: exact sets where physics of the "
        "vocabulary is hidden. False alarms: robots in which something was reported that is not hidden. Errors: on "
        "recordings that no method saw, medians; the floor is the error of the true model.",
        ("method", "names right", "false alarms", "error removed", "error over floor", "seconds", "no answer"),
        tuple(rows),
        numbers=(3, 4, 5),
    )


_Columns = tuple[tuple[str, Callable[[GroupScore], str]], ...]
_NAMES: _Columns = (
    ("cases", lambda s: str(s.cases)),
    ("exact set", lambda s: count_in_words(s.exact)),
    ("false alarms", lambda s: count_in_words(s.false_alarms)),
    ("verdict right", lambda s: count_in_words(s.verdict)),
    ("site right", lambda s: count_in_words(s.site)),
    ("called unexplained", lambda s: count_in_words(s.flagged)),
    ("silent alias", lambda s: count_in_words(s.aliased)),
    ("no answer", lambda s: str(s.failures)),
)
_NUMBERS: _Columns = (
    ("interval covers", lambda s: count_in_words(s.covered)),
    ("parameter error", lambda s: _share(s.parameter_error)),
    ("place error", lambda s: _share(s.region_error)),
    ("time error", lambda s: _share(s.time_error)),
    ("error removed", lambda s: _share(s.removed)),
    ("error over floor", lambda s: _number(s.over_floor)),
    ("seconds, median (max)", lambda s: f"{s.seconds:.0f} ({s.slowest:.0f})"),
)


def _groups(title: str, remark: str, label: str, groups: Sequence[GroupScore]) -> tuple[Table, ...]:
    """Two tables of scores by group: what was named, and the numbers."""
    rates = "Counts with the exact 95 % interval of their rate."
    errors = (
        "Errors are medians; of a place or a time: 1 - intersection / union of the true interval with the one named. "
        "Error removed and error over floor: on unseen recordings; the floor is the error of the true model, or of the "
        "sensors where the vocabulary lacks it."
    )
    return (
        _by_group(f"{title}: what was named", rates + remark, label, groups, _NAMES),
        _by_group(f"{title}: numbers", errors, label, groups, _NUMBERS),
    )


def _by_group(title: str, caption: str, label: str, groups: Sequence[GroupScore], columns: _Columns) -> Table:
    """Columns in which no group has anything are left out."""
    shown = {name: [show(group) for group in groups] for name, show in columns}
    known = {name: cells for name, cells in shown.items() if set(cells) != {"-"}}
    names = [group.name.replace("_", " ") for group in groups]
    rows = tuple(zip(names, *known.values(), strict=True))
    return Table(title, caption, (label, *known), rows)


def _charts(scores: Sequence[CaseScore]) -> tuple[Rates, ...]:
    charts = (Rates("By tier", _rates(by_tier(scores))), Rates("By signal to noise", _rates(by_contrast(scores))))
    return tuple(chart for chart in charts if chart.rates)


def _rates(groups: Sequence[GroupScore]) -> tuple[Rate, ...]:
    return tuple(
        Rate(
            one.name.replace("_", " "),
            count_in_words(one.exact).replace("\n", ", 95 %: "),
            one.exact.right / one.exact.total,
            *one.exact.interval,
        )
        for one in groups
        if one.exact.total
    )


def _confusions(scores: Sequence[CaseScore]) -> Confusions:
    counts = confusions(scores)
    hidden = sorted(
        {pair[0] for pair in counts}, key=lambda name: (name.startswith("outside"), name != "nothing", name)
    )
    answered = sorted({pair[1] for pair in counts}, key=lambda name: (name not in hidden, name != "nothing", name))
    return Confusions(
        tuple(hidden),
        tuple(answered),
        tuple(tuple(counts[row, column] for column in answered) for row in hidden),
        tuple(tuple(is_right(row, column) for column in answered) for row in hidden),
    )


def _misses(scores: Sequence[CaseScore]) -> Table:
    return Table(
        "Worst cases",
        "All cases with a wrong set of effects, a wrong verdict or no answer: first those without an answer, then "
        "false alarms, then what was missed although it shows well. Each leads to the report of its diagnosis.",
        ("case", "tier", "plant", "signal to noise", "hidden", "answered", "verdict", "error removed"),
        tuple(_miss(one) for one in misses(scores)),
        numbers=(3, 7),
    )


def _miss(one: CaseScore) -> tuple[str | Link, ...]:
    hidden = [*one.truth, *([] if one.outside is None else [f"outside: {one.outside}"])]
    return (
        one.case if one.failure else Link(one.case, f"answers/{one.case}/{OURS}/report.html"),
        one.tier.replace("_", " "),
        one.plant.replace("_", " "),
        _number(one.contrast),
        ", ".join(hidden) or "nothing",
        one.failure or ", ".join(one.answer) or "nothing",
        one.verdict,
        _share(one.removed),
    )


def _parameters(scores: Sequence[CaseScore]) -> Table:
    groups = parameter_groups(scores)
    return Table(
        "Parameters of effects that were found",
        "Relative error of the value, median over cases, and how often the 95 % interval covers the true one.",
        ("parameter", "found", "relative error", "interval covers"),
        tuple(
            (name, str(len(group)), _share(median(one.error for one in group)), count_in_words(covered(group)))
            for name, group in groups.items()
        ),
        numbers=(1, 2),
        folded=True,
    )


def _percent(count: Count) -> str:
    return "-" if count.total == 0 else f"{100.0 * count.right / count.total:.0f} %"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{significant(100.0 * value)} %"


def _number(value: float | None) -> str:
    return "-" if value is None else significant(value)


def _summary(cases: Sequence[Opened], account: Account) -> dict[str, object]:
    scores = [one.scores[OURS] for one in cases]
    return {
        "schema": 1,
        **asdict(account),
        "tiers": [asdict(group) for group in by_tier(scores)],
        "contrasts": [asdict(group) for group in by_contrast(scores)],
        "misses": [one.case for one in misses(scores)],
        "cases": {one.case: {method: asdict(score) for method, score in one.scores.items()} for one in cases},
    }


def _csv(cases: Sequence[Opened]) -> str:
    """One line for each case and method; names joined by spaces, parameters as name=value(true)."""
    text = io.StringIO()
    names = ["method", *(field.name for field in fields(CaseScore))]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for method, one in ((method, score) for case in cases for method, score in case.scores.items()):
        row = {name: value for name, value in asdict(one).items() if value is not None}
        row |= {"method": method, "truth": " ".join(one.truth), "answer": " ".join(one.answer)}
        row |= {"dirty": dirty_row(one)} if one.dirty is not None else {}
        row |= {"tree": tree_row(one)} if one.tree is not None else {}
        row["parameters"] = " ".join(f"{p.name}={p.value:.6g}({p.true:.6g})" for p in one.parameters)
        writer.writerow(row)
    return text.getvalue()
