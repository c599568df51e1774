"""What the page of a run of the blind benchmark says about dirty robots."""

from collections.abc import Sequence

from wipx.proof.blind.diagnosing import OURS
from wipx.proof.blind.evidence import count_in_words
from wipx.proof.blind.judging import Opened
from wipx.proof.blind_robots.dirty_table import DirtyGroup, dirty_group, dirty_groups
from wipx.proof.blind_robots.score import CaseScore
from wipx.report.numbers import significant
from wipx.report.score_page import Table

CAPTION = (
    "Named: dominant effects named, by their name or as an equivalent. Kin: others for which another law of the same "
    "physics at the same site was named. Corrected: named laws that correct what the owner has wrong, such as masses. "
    "Not there: other named laws. Error: of the completed model on unseen recordings over 0.5 s, over that of the true "
    "effects fitted at this horizon to the visible ones; with dirt only, over that of the owner's model."
)
HEAD = (
    "robots",
    "named",
    "kin",
    "corrected",
    "not there",
    "robots with a law not there",
    "error, median",
    "error, 95th percentile",
    "seconds, median",
    "no answer",
)


def dirty_tables(cases: Sequence[Opened]) -> tuple[Table, ...]:
    """Scores of dirty robots by number of effects, and of all methods on the same robots; none without such robots."""
    dirty = [one for one in cases if one.scores[OURS].dirty is not None]
    if not dirty:
        return ()
    groups = dirty_groups([one.scores[OURS] for one in dirty])
    tables = [
        Table(
            "Dirty robots",
            CAPTION,
            ("dominant effects", *HEAD),
            tuple((group.name, *_cells(group)) for group in groups),
        )
    ]
    names = list(dict.fromkeys(method for one in dirty for method in one.scores))
    shared = [one for one in dirty if set(one.scores) == set(names)]
    if len(names) > 1 and shared:
        rows = []
        for name in names:
            label = "wipx (this package)" if name == OURS else name.replace("_", " ")
            for group in dirty_groups([one.scores[name] for one in shared])[-2:]:
                if group.name in ("all with effects", "dirt only"):
                    rows.append((label, group.name, *_cells(group)))
        head = ("method", "dominant effects", *HEAD)
        tables.append(Table("Dirty robots: against what people would use instead", CAPTION, head, tuple(rows)))
    return tuple(tables)


def dirty_sentence(scores: Sequence[CaseScore]) -> str:
    """What a reader should take away."""
    dirty = [one for one in scores if one.dirty is not None]
    with_effects = [one for one in dirty if one.truth]
    parts = []
    if with_effects:
        group = dirty_group("", with_effects)
        parts.append(
            f"Of dirty robots {group.named.right} of {group.named.total} dominant effects were named, and "
            f"{group.false_laws} laws that are not there in {group.cases} robots; the error on unseen recordings is "
            f"{_number(group.error(0.5))} times that of the fitted true effects (median)."
        )
    if len(dirty) > len(with_effects):
        accused = dirty_group("", [one for one in dirty if not one.truth]).accused
        parts.append(f"With dirt only a law was named in {accused.right} of {accused.total}.")
    return " ".join(parts)


def dirty_row(one: CaseScore) -> str:
    """The score of a dirty robot in one cell of a table."""
    dirty = one.dirty
    assert dirty is not None
    return (
        f"named={dirty.named}/{dirty.dominant} kin={dirty.kin} corrected={dirty.corrected} "
        f"not_there={dirty.false_laws} error={_number(dirty.over_reference)}"
    )


def _cells(group: DirtyGroup) -> tuple[str, ...]:
    return (
        str(group.cases),
        count_in_words(group.named),
        f"{group.kin.right}" if group.kin.total else "-",
        str(group.corrected),
        str(group.false_laws),
        count_in_words(group.accused),
        _number(group.error(0.5)),
        _number(group.error(0.95)),
        f"{group.seconds:.0f}",
        str(group.failures),
    )


def _number(value: float | None) -> str:
    return "-" if value is None else significant(value)
